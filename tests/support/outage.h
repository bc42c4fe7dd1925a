/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator on a disk that loses what was not flushed, or whose calls fail (tests/support/faulty_disk.h), with a
 * client and a worker that remember what was acknowledged: run after run, each starting from what the disk kept.
 * Violations are counted: acknowledged results that are missing, results that a film contains twice, and images whose
 * bits differ from those of an undisturbed run. Any other fault ends the test. One process at a time in each folder
 * (tests/support/folder.h).
 */
#ifndef TESTS_SUPPORT_OUTAGE_H
#define TESTS_SUPPORT_OUTAGE_H

#include "tests/support/faulty_disk.h"
#include "tests/support/scripted.h"

#include <stdatomic.h>
#include <sys/types.h>

enum harm { LOST, DOUBLED, UNEQUAL, HARMS };
enum { IDS_MAX = 64, LEASES_MAX = 256 };

struct outage_job {
	bool submitted, announced; /* submitted: acknowledged; announced: its result was reported to exist */
	bool acked[LEASES_MAX];
};

struct farm_run {
	struct faulty_disk disk;
	struct plan plan;
	struct plan_request request;
	pid_t pid;
	int code; /* exit code */
	uint16_t port;
	struct outage_job jobs[IDS_MAX];
	uint64_t accepted;
	struct scripted *client, *worker;
	uint64_t losses, acks, refused, failed;
	bool faulty; /* calls fail: a request refused with a message is repeated */
};

struct outage_found {
	_Atomic uint64_t images, harm[HARMS];
};

/* The state of this process. */
extern struct outage {
	_Atomic uint64_t *counts;   /* the disk's counters; set by the test */
	struct outage_found *found; /* set by the test */
	bool loud;		    /* prints the coordinator's log */
	bool accept_loss;	    /* --accept-loss */
	uint64_t journal_bytes;	    /* --journal; 0: a checkpoint after every result or two */
	uint64_t quiet_calls;	    /* number of modifying calls in an undisturbed run */
	char running[64];	    /* the name of the current run, or "" */
	char root[80];		    /* the spool's path */
} outage;

void outage_begin(struct farm_run *f, uint64_t seed); /* begins with an empty spool */
bool outage_start(struct farm_run *f); /* false: power was lost while it read its jobs, or it did not start */
bool outage_work(struct farm_run *f);  /* works until all jobs have ended; false: power was lost */
void outage_hang_up(struct farm_run *f);
int outage_gone(struct farm_run *f, bool wait); /* returns 0 while it runs, otherwise its exit code, or -1 for 0 */
void outage_swap_folders(struct farm_run *f);	/* makes what the disk kept the spool */
void outage_stop(struct farm_run *f);
/* Submits another job when everything is done and the coordinator is idle; power is lost at its first call. */
void outage_cut_power(struct farm_run *f);
void outage_quiet_run(void); /* an undisturbed run, before the others */

#endif
