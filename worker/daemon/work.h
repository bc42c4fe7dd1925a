/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the render threads are working on, in memory that outlives their process: after a signal the next process knows
 * which leases the old one had, and which of them the signal hit. Allocated by the supervisor (supervise.h) before it
 * starts the rendering process; a worker without supervisor has none. Each thread writes its own entry; the loop's
 * thread reads those of the previous process.
 */
#ifndef WORKER_DAEMON_WORK_H
#define WORKER_DAEMON_WORK_H

#include "common/film/batch.h"

#include <stdbool.h>

enum { WORK_THREADS = 1024, WORK_SCENE = 128, WORK_TEXT = 512 };

/* A lease of a process that has ended. own: nothing says that this lease was the cause (SIGKILL: lack of memory, or
 * a person). */
struct lost_lease {
	struct lease_key key;
	char text[WORK_TEXT];
	bool own, reported;
};

/* Shared with processes forked from now on. -ENOMEM. */
int work_share(unsigned threads, struct error *e);
/* In the rendering process: a signal that ends it is recorded. */
void work_catch(void);

/* This thread renders the lease, or builds the scene that the lease waits for, until work_end. */
void work_begin(const struct lease_key *k, const char *scene);
void work_end(void);

/* In the supervisor: the rendering process has ended, by this signal according to the kernel (0: none). Its leases are
 * lost from now on. Returns their number, which is 0 if it ended without a signal. now: here and below, that of
 * clock_seconds. */
unsigned work_lose(int number, double now);

/* Memory has run short: SIGKILL has ended a rendering process, or an allocation has failed in one that held several
 * scenes. */
void work_memory_short(double now);
/* Whether that was in the last ten minutes. If it recurs after these ten minutes, but within twenty, the next period is
 * of twenty minutes, then of forty, and so on up to 320: what runs short again so soon needs the limit. */
bool work_memory_was_short(double now);

/* The index-th lease that was lost with an earlier process; NULL: no more. */
struct lost_lease *work_lost(unsigned index);

#endif
