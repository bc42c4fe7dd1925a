/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Progress on stderr: on a terminal a bar that redraws itself, elsewhere a plain line now and then. One thread.
 */
#ifndef COMMON_BASE_PROGRESS_H
#define COMMON_BASE_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>

struct progress {
	bool terminal, drawn;
	double shown;	   /* fraction in the last plain line; negative: none yet */
	double shown_time; /* s */
	char state[32];	   /* when the last plain line was written */
	double most;	   /* of progress_kept */
	char most_state[32];
};

void progress_start(struct progress *p);
/* fraction in [0,1]; state: one word; detail: text after the bar. */
void progress_show(struct progress *p, double fraction, const char *state, const char *detail);
/* What is done of an amount that is only estimated falls when the estimate grows, or is withdrawn. People are shown the
 * most that it was in this state; the time that is left tells them the rest. */
double progress_kept(struct progress *p, double fraction, const char *state);
/* Where it falls because there is more to be done than before, as for a job that is extended: appends to the detail
 * what it was, if that is another number on the screen. */
void progress_explain_fall(struct progress *p, double fraction, const char *state, char *detail, size_t size);
void progress_end(struct progress *p); /* leaves the cursor at the start of a line */

/* A rate in few characters: "3.2 k", "12 M"; a time: "1:02:03", "45 s". */
void progress_number(double x, char *text, size_t size);
void progress_time(double seconds, char *text, size_t size);
/* Two digits: "4.5 s", "31 min", "2.4 h", "12 days"; "for ever". */
void progress_duration(double seconds, char *text, size_t size);

#endif
