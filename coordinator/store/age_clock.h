/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A clock of observed time, in seconds, from which the ages of finished jobs are computed. During a run of the
 * coordinator and between two runs it advances with the machine's boot-time clock, which nobody can set. Across a
 * reboot only the wall clock knows how much time has passed, and it may be wrong, so no more than age_clock_max_credit
 * is added. Pure.
 */
#ifndef COORDINATOR_STORE_AGE_CLOCK_H
#define COORDINATOR_STORE_AGE_CLOCK_H

#include <stddef.h>

enum {
	AGE_CLOCK_CREDIT_MAX = 86400,
	AGE_CLOCK_CREDIT_DIVISOR = 30,
	AGE_CLOCK_BOOT_ID_SIZE = 40,
	AGE_CLOCK_TEXT_MAX = 256
};

struct age_clock {
	double observed_seconds;	      /* observed time at the moment of the other members */
	double uptime;			      /* s since the machine was booted, including sleep */
	double wall_time;		      /* s since 1970 */
	char boot_id[AGE_CLOCK_BOOT_ID_SIZE]; /* the kernel's identifier of this boot */
};

/* Sets now->observed_seconds; the other members of `now` have been set by the caller. previous: the clock as stored
 * last; NULL: none, and observed time starts at 0. max_credit: limit in s on what is added across a reboot. */
void age_clock_advance(struct age_clock *now, const struct age_clock *previous, double max_credit);
/* Returns a thirtieth of the time that results are kept, but at most a day, so that no jump of the wall clock can
 * remove a result that is not nearly that old already. retention_seconds: 0: results are kept forever. */
double age_clock_max_credit(double retention_seconds);

/* Writes the clock as one line with a checksum. Returns the length of the line. */
size_t age_clock_to_text(const struct age_clock *s, char text[AGE_CLOCK_TEXT_MAX]);
int age_clock_from_text(const char *text, size_t size, struct age_clock *s); /* -EBADMSG: damaged, or not such a line */

#endif
