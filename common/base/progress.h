/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Progress on stderr: on a terminal a bar that is redrawn in place, elsewhere a plain line now and then. One thread.
 */
#ifndef COMMON_BASE_PROGRESS_H
#define COMMON_BASE_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>

struct progress {
	bool is_terminal; /* stderr is a terminal that can redraw a line */
	bool is_bar_drawn;
	double printed_fraction;     /* fraction in the last plain line; negative: none yet */
	double printed_time;	     /* when the last plain line was written, s */
	char printed_state[32];	     /* state in the last plain line */
	double max_fraction;	     /* largest fraction passed to progress_max_fraction in state max_fraction_state */
	char max_fraction_state[32]; /* state in the last call of progress_max_fraction */
};

void progress_begin(struct progress *p);
/* Shows a fraction in [0,1], the state (one word), and a text after the bar. */
void progress_show(struct progress *p, double fraction, const char *state, const char *detail);
/* Returns the largest fraction passed since `state` last changed. If the total is only an estimate, the
 * fraction done falls when the estimate grows; a bar that goes backwards would confuse, and the remaining time shows
 * the change. */
double progress_max_fraction(struct progress *p, double fraction, const char *state);
/* For a fraction that falls because work was added, as when a job is extended: appends the earlier fraction to `detail`
 * if it differs in the digits that are shown. */
void progress_explain_decrease(struct progress *p, double fraction, const char *state, char *detail, size_t size);
/* Ends the bar's line, so that the next text starts on a line of its own. */
void progress_end(struct progress *p);

/* Prints a number in few characters: "3.20 k", "12.0 M". */
void progress_format_number(double x, char *text, size_t size);
/* Prints a time, rounded up to seconds: "45 s", "2:03", "1:02:03". */
void progress_format_time(double seconds, char *text, size_t size);
/* Prints a time with about two digits: "4.5 s", "31 min", "2.4 h", "12 days"; "for ever" from a million years on. */
void progress_format_duration(double seconds, char *text, size_t size);

#endif
