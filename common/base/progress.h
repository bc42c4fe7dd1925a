/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Progress on stderr: a bar that redraws itself on a terminal, a plain line now and then elsewhere. One thread.
 */
#ifndef COMMON_BASE_PROGRESS_H
#define COMMON_BASE_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>

struct progress {
	bool terminal, drawn;
	double shown;	   /* fraction of the last plain line; negative: none */
	double shown_time; /* s */
	char state[32];	   /* of the last plain line */
};

void progress_start(struct progress *p);
/* fraction in [0,1]; state: a word; detail: what follows the bar. */
void progress_show(struct progress *p, double fraction, const char *state, const char *detail);
void progress_end(struct progress *p); /* leaves the cursor on a line of its own */

/* "3.2 k", "12 M": a rate in few characters; "1:02:03", "45 s": a time. */
void progress_number(double x, char *text, size_t size);
void progress_time(double seconds, char *text, size_t size);
/* In two figures: "4.5 s", "31 min", "2.4 h", "12 days"; "for ever". */
void progress_duration(double seconds, char *text, size_t size);

#endif
