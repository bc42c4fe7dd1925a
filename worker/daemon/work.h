/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the render threads are at work on, in memory that outlives their process: when a signal ends that the next one
 * knows which leases it had, and which of them the signal hit. Made by the supervisor (supervise.h) before it starts
 * the process that renders; a worker without a supervisor keeps none. Threads write their own entry; the loop's thread
 * reads what the process before left.
 */
#ifndef WORKER_DAEMON_WORK_H
#define WORKER_DAEMON_WORK_H

#include "common/film/batch.h"

#include <stdbool.h>

enum { WORK_THREADS = 1024, WORK_SCENE = 128, WORK_TEXT = 512 };

/* Of a process that has ended. own: nothing says that it was this lease (SIGKILL: the machine's memory, or somebody).
 */
struct lost_lease {
	struct lease_key key;
	char text[WORK_TEXT];
	bool own, reported;
};

/* Shared with processes that are forked from now on. -ENOMEM. */
int work_share(unsigned threads, struct error *e);
/* In the process that renders: a signal that ends it leaves its name. */
void work_catch(void);

/* This thread renders the lease, or builds the scene that the lease waits for, until work_end. */
void work_begin(const struct lease_key *k, const char *scene);
void work_end(void);

/* The supervisor: the process that rendered has ended, by this signal as far as the kernel says (0: none). What it had
 * is lost from now on. Returns how many leases that is; 0, too, where it ended without a signal. */
unsigned work_lose(int number);

/* Of the processes before: the index-th lost lease; NULL: no more. */
struct lost_lease *work_lost(unsigned index);

#endif
