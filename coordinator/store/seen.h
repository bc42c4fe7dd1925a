/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Time that was seen to pass, in seconds: what the ages of finished jobs are made of. It grows by the clock of the
 * machine since it was started, which nobody sets, while it runs and from one run of the coordinator to the next.
 * Where the machine has been started anew in between, only the wall clock knows how long that took, and may be wrong:
 * SEEN_CREDIT at most is believed. Pure.
 */
#ifndef COORDINATOR_STORE_SEEN_H
#define COORDINATOR_STORE_SEEN_H

#include <stddef.h>

enum { SEEN_CREDIT = 86400, SEEN_BOOT = 40, SEEN_TEXT = 256 };

struct seen {
	double seconds;	      /* seen so far, at this moment of the other two: */
	double up;	      /* s since the machine was started, those that it slept included */
	double wall;	      /* s since 1970 */
	char boot[SEEN_BOOT]; /* the name that the kernel gave to this start */
};

/* now has all but the seconds, which it gets. last: NULL: there is none, they begin at 0. */
void seen_go_on(struct seen *now, const struct seen *last);

/* One line, with a checksum. Returns its length. */
size_t seen_to_text(const struct seen *s, char text[SEEN_TEXT]);
int seen_from_text(const char *text, size_t size, struct seen *s); /* -EBADMSG */

#endif
