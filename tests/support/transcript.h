/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Transcripts: the events of a farm and the core's answers, as readable text, one event per line:
 *
 *  [110] w2 batch j1 g3 p0 e1 -> merge, merged, w2 gets j1 g3 p0 e2
 *
 * The time in seconds is in brackets, and all actions of the core follow the arrow; "-> -" means none. If an answer
 * differs, both are printed and the test fails at its end. It also fails if a job is waiting after a line without
 * stating for what.
 *
 * Events of worker N (KEY: j1 g0 p0 e0, or j1 g0 p0 boot):
 *
 *  wN joins F threads=T [certificate=C] [name=N] [home=H] [start=K]
 *  wN leaves
 *  wN heartbeat
 *  wN wants N
 *  wN batch KEY [bad] [says X]      a result; X: its digest
 *  wN stored KEY [says X]           a result of an earlier run, read from the journal
 *  wN delivers KEY                  a result has been received and will be judged later
 *  wN returns KEY                   gives the lease back
 *  wN fails KEY TEXT                could not compute it
 *  wN lacks KEY TEXT                ... because of the worker's own machine
 *  wN postpones KEY TEXT            ... because of another scene in its memory
 *  wN refuses KEY TEXT              ... because of the lease's chain states; their predecessors are still known
 *  wN denies KEY TEXT               ... because of the lease's chain states; their predecessors are not known
 *  wN recalls KEY TEXT              could not use chain states that have been replaced since
 *
 * Other events:
 *
 *  submit [OPTION...]        priority= mixed owner= verify= groups= parts= rounds= seconds= target= boot=
 *  restore [asked] J boot|render N,N,... [fingerprint=F] [elapsed=T] [completed=T] [black] [OPTION of submit...]
 *                            N: the next epoch of each slot
 *  extend J [OPTION...]      with the new plan's options
 *  hold [order|files] J TEXT, release [order|files] J
 *                            by a client, because of files; otherwise because of storage
 *  priority J N, cancel J, prepared J [black|bad TEXT], error J R E, image J [disagrees], broken J TEXT
 *  quarantined [name=N]
 *  tick
 *
 * "[60] unread=40 ..." with any event: messages of the last 40 s may not have been read yet. "[0] wake -> T": the core
 * asked to be called again at T.
 */
#ifndef TESTS_SUPPORT_TRANSCRIPT_H
#define TESTS_SUPPORT_TRANSCRIPT_H

#include "coordinator/core/farm.h"

struct farm *transcript_farm_new(void);				/* default configuration */
void transcript_play(struct farm *f, const char *const *lines); /* lines ends with NULL */
/* Plays the lines on a new farm, which is freed at the end. */
void transcript_check(const char *const *lines);

/* clang-format off */
/* Two workers, and a job whose bootstrap is done: each worker has a lease of its first round. */
#define TRANSCRIPT_START_TWO                                                                      \
	"[0] submit -> j1 submitted, j1 is queued",                                    \
	"[0] w1 joins A threads=1 -> -", "[0] w2 joins A threads=1 -> -",              \
	"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",                    \
	"[0] w2 wants 1 -> w2 gets j1 g1 p0 boot",                                     \
	"[1] w1 batch j1 g0 p0 boot -> merge, merged",                                 \
	"[1] w2 batch j1 g1 p0 boot -> merge, merged, j1 prepare",                     \
	"[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w2 gets j1 g1 p0 e0"
/* clang-format on */

#endif
