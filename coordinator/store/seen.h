/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Observed time, in seconds, from which ages of finished jobs are computed. It advances with the machine's boot-time
 * clock, which nobody sets, during a run of the coordinator and between runs. Across a reboot only the wall clock knows
 * how much time has passed, and it may be wrong: at most seen_credit is added. Pure.
 */
#ifndef COORDINATOR_STORE_SEEN_H
#define COORDINATOR_STORE_SEEN_H

#include <stddef.h>

enum { SEEN_CREDIT = 86400, SEEN_SHARE = 30, SEEN_BOOT = 40, SEEN_TEXT = 256 };

struct seen {
	double seconds;	      /* observed so far, when the other two were: */
	double up;	      /* s since the machine was booted, including sleep */
	double wall;	      /* s since 1970 */
	char boot[SEEN_BOOT]; /* the kernel's identifier of this boot */
};

/* now has everything but the seconds, which are filled in. last: NULL: there is none, and they start at 0. credit: s
 * that are added at most across a reboot. */
void seen_go_on(struct seen *now, const struct seen *last, double credit);
/* A thirtieth of what results are kept for, at most a day, so that no jump of the wall clock removes a result that is
 * not nearly that old. keep: s; 0: for ever. */
double seen_credit(double keep);

/* One line, with a checksum. Returns its length. */
size_t seen_to_text(const struct seen *s, char text[SEEN_TEXT]);
int seen_from_text(const char *text, size_t size, struct seen *s); /* -EBADMSG */

#endif
