/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator on a disk that loses what was not synchronised, or whose calls fail (tests/support/faulty_disk.h), and
 * a client and a worker that remember what was acknowledged: run after run, each from what the disk kept. What must
 * not be is counted: results that were acknowledged and are not there, that a film holds twice, images of other bits
 * than those of an undisturbed run. Everything else that is wrong ends the test. One process at a time in each folder
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
	bool submitted, announced; /* acknowledged; its result was said to be there */
	bool acked[LEASES_MAX];
};

struct farm_run {
	struct faulty_disk disk;
	struct plan plan;
	struct plan_request request;
	pid_t pid;
	int code; /* of its end */
	uint16_t port;
	struct outage_job jobs[IDS_MAX];
	uint64_t accepted;
	struct scripted *client, *worker;
	uint64_t losses, acks, refused, failed;
	bool faulty; /* calls fail: what is refused with a sentence is tried again */
};

struct outage_found {
	_Atomic uint64_t images, harm[HARMS];
};

/* Of this process. */
extern struct outage {
	_Atomic uint64_t *counts;   /* of the disk; set by the test */
	struct outage_found *found; /* set by the test */
	bool loud;		    /* with the coordinator's log */
	bool accept_loss;	    /* --accept-loss */
	uint64_t journal_bytes;	    /* --journal; 0: a checkpoint after every result or two */
	uint64_t quiet_calls;	    /* of an undisturbed run, that change something */
	char running[64];	    /* the run that is under way; "": none */
	char root[80];		    /* the spool */
} outage;

void outage_begin(struct farm_run *f, uint64_t seed); /* from nothing */
bool outage_start(struct farm_run *f); /* false: power was lost before it had read its jobs, or it did not start */
bool outage_work(struct farm_run *f);  /* to the end of all jobs; false: power was lost */
void outage_hang_up(struct farm_run *f);
int outage_gone(struct farm_run *f, bool wait); /* 0: it runs; else its exit code, -1 for 0 */
void outage_swap_folders(struct farm_run *f);	/* what the disk kept becomes the spool */
void outage_stop(struct farm_run *f);
/* All is done and the coordinator idle: another job, and at its first call power is lost. */
void outage_cut_power(struct farm_run *f);
void outage_quiet_run(void); /* undisturbed: before the others */

#endif
