/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Observed time, in seconds, from which ages of finished jobs are computed. It advances with the machine's boot-time
 * clock, which nobody sets, during a run of the coordinator and between runs. Across a reboot only the wall clock knows
 * how much time has passed, and it may be wrong: at most age_clock_credit is added. Pure.
 */
#ifndef COORDINATOR_STORE_AGE_CLOCK_H
#define COORDINATOR_STORE_AGE_CLOCK_H

#include <stddef.h>

enum { AGE_CLOCK_CREDIT = 86400, AGE_CLOCK_SHARE = 30, AGE_CLOCK_BOOT = 40, AGE_CLOCK_TEXT = 256 };

struct age_clock {
	double seconds;		   /* observed so far, when the other two were: */
	double up;		   /* s since the machine was booted, including sleep */
	double wall;		   /* s since 1970 */
	char boot[AGE_CLOCK_BOOT]; /* the kernel's identifier of this boot */
};

/* now has everything but the seconds, which are filled in. last: NULL: there is none, and they start at 0. credit: s
 * that are added at most across a reboot. */
void age_clock_advance(struct age_clock *now, const struct age_clock *last, double credit);
/* A thirtieth of what results are kept for, at most a day, so that no jump of the wall clock removes a result that is
 * not nearly that old. keep: s; 0: for ever. */
double age_clock_credit(double keep);

/* One line, with a checksum. Returns its length. */
size_t age_clock_to_text(const struct age_clock *s, char text[AGE_CLOCK_TEXT]);
int age_clock_from_text(const char *text, size_t size, struct age_clock *s); /* -EBADMSG */

#endif
