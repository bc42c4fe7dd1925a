/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Records what the render threads are working on, in memory that outlives their process: after a signal the next
 * process knows which leases the old one had, and which of them the signal hit. The supervisor (supervise.h) allocates
 * the memory before it starts the rendering process; without a supervisor nothing is recorded. Each thread writes its
 * own entry; the loop's thread reads the lost leases of previous processes.
 */
#ifndef WORKER_DAEMON_CRASH_RECORD_H
#define WORKER_DAEMON_CRASH_RECORD_H

#include "common/film/batch.h"

#include <stdbool.h>

enum { CRASH_RECORD_THREADS_MAX = 1024, CRASH_RECORD_SCENE_SIZE = 128, CRASH_RECORD_TEXT_SIZE = 512 };

/* A lease of a process that a signal has ended. */
struct lost_lease {
	struct lease_key key;
	char text[CRASH_RECORD_TEXT_SIZE];
	bool is_worker_at_fault; /* this machine is to blame, since nothing shows that the lease was the cause (SIGKILL)
				  */
	bool is_reported;
};

/* Allocates the memory, which is shared with processes forked later. Returns 0 or -ENOMEM. */
int crash_record_open(unsigned threads, struct error *e);
/* Call in the rendering process: records the signal that ends it. */
void crash_record_catch_signals(void);

/* Between the two calls, the calling thread renders the lease, or builds the scene for which the lease waits. */
void crash_record_begin(const struct lease_key *k, const char *scene);
void crash_record_end(void);

/* Call in the supervisor when the rendering process has ended; number: the signal that the kernel reports, 0 for none.
 * Records its leases as lost. Returns their number, which is 0 if the process ended without a signal. now, here and
 * below: time of clock_seconds. */
unsigned crash_record_add_loss(int number, double now);

/* Call when memory has run short: SIGKILL has ended a rendering process, or an allocation has failed while several
 * scenes were in memory. */
void crash_record_note_memory_short(double now);
/* Returns whether memory has run short recently: within the last ten minutes. If it runs short again soon after such a
 * period, within as much time as the period had, the next period is twice as long, up to 320 minutes: memory that runs
 * short so soon again needs the limit. */
bool crash_record_is_memory_short(double now);

/* Returns the index-th lease lost with earlier processes; NULL after the last. */
struct lost_lease *crash_record_lost_lease_at(unsigned index);

#endif
