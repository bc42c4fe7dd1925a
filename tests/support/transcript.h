/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Conversations with the coordinator's core as readable text, one line an event and all that the core says to it:
 *
 *   [110] w2 batch j1 g3 p0 e1 -> merge, merged, w2 gets j1 g3 p0 e2
 *
 * Events:
 *   wN joins F threads=T | wN leaves | wN heartbeat | wN wants N
 *   wN batch KEY [bad TEXT] | wN fails KEY TEXT | wN lacks KEY TEXT (its own machine's fault) | wN refuses KEY TEXT
 * (its states) | wN denies KEY TEXT | wN recalls KEY TEXT (the same, and what came before them is gone) | wN returns
 * KEY        KEY: j1 g0 p0 e0, or j1 g0 p0 boot submit [NAME=VALUE ...]: priority mixed groups parts rounds seconds
 * target boot owner restore [asked] J boot|render N,N,... [fingerprint=F] [elapsed=T] [completed=T] [black] [as
 * submit]: the slots' next epochs hold [order] J TEXT | release [order] J | priority J N | extend J [as submit: the new
 * plan]        (order: by somebody, not for want of room) cancel J | prepared J [black | bad TEXT] | error J R E |
 * broken J TEXT | tick
 * "[60] unread=40 ...": with any of them: what came in the last so many seconds may not have been read.
 * "[0] wake -> T": when the core wants to be called again, as it said last.
 * "-> -" is silence. A line that does not fit is printed beside what was said, and the test fails at the end; so it
 * does when, after a line, a job waits and does not say for what.
 */
#ifndef TESTS_SUPPORT_TRANSCRIPT_H
#define TESTS_SUPPORT_TRANSCRIPT_H

#include "coordinator/core/farm.h"

struct farm *transcript_farm(void);				/* default configuration */
void transcript_play(struct farm *f, const char *const *lines); /* up to NULL */
/* Both, and frees the farm. */
void transcript(const char *const *lines);

#endif
