/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator on a disk that loses what was not flushed, or whose calls fail (tests/support/faulty_disk.h),
 * with a client and a worker that remember what was acknowledged: run after run, each starting from what the disk kept.
 * Violations are counted: acknowledged results that are missing, results that a film contains twice, and images whose
 * bits differ from those of an undisturbed run. Any other fault ends the test. One process at a time in each folder
 * (tests/support/temporary_folder.h).
 */
#ifndef TESTS_SUPPORT_OUTAGE_H
#define TESTS_SUPPORT_OUTAGE_H

#include "tests/support/faulty_disk.h"
#include "tests/support/scripted_peer.h"

#include <stdatomic.h>
#include <sys/types.h>

enum outage_violation { OUTAGE_LOST, OUTAGE_DUPLICATED, OUTAGE_DIFFERENT, OUTAGE_VIOLATIONS };
enum { OUTAGE_JOBS_MAX = 64, OUTAGE_LEASES_MAX = 256 };

struct outage_job {
	bool submitted, announced; /* submitted: acknowledged; announced: its result was reported to exist */
	bool acked[OUTAGE_LEASES_MAX];
};

struct outage_run {
	struct faulty_disk_options disk;
	struct plan plan;
	struct plan_request request;
	pid_t pid;
	int exit_code;
	uint16_t port;
	struct outage_job jobs[OUTAGE_JOBS_MAX];
	uint64_t accepted_jobs;
	struct scripted_peer *client, *worker;
	uint64_t power_losses, acks, refusals, failed_jobs;
	bool has_failing_calls; /* a request refused with a message is repeated */
};

struct outage_findings {
	_Atomic uint64_t images_compared, violations[OUTAGE_VIOLATIONS];
};

/* The state of this process. */
extern struct outage {
	_Atomic uint64_t *disk_counts;	  /* the disk's counters; set by the test */
	struct outage_findings *findings; /* set by the test */
	bool prints_log;		  /* prints the coordinator's log */
	bool accept_loss;		  /* --accept-loss */
	uint64_t journal_bytes;		  /* --journal; 0: a checkpoint after every result or two */
	uint64_t undisturbed_calls;	  /* number of modifying calls in an undisturbed run */
	char run_name[64];		  /* of the current run, or "" */
	char spool[80];			  /* its path */
} outage;

void outage_begin(struct outage_run *f, uint64_t seed); /* begins with an empty spool */
bool outage_start(struct outage_run *f);    /* false: power was lost while it read its jobs, or it did not start */
bool outage_run_jobs(struct outage_run *f); /* works until all jobs have ended; false: power was lost */
void outage_disconnect(struct outage_run *f);
int outage_exit_code(struct outage_run *f,
		     bool wait);		/* returns 0 while it runs, otherwise its exit code, or -1 for 0 */
void outage_swap_folders(struct outage_run *f); /* makes what the disk kept the spool */
void outage_stop(struct outage_run *f);
/* Submits another job when everything is done and the coordinator is idle; power is lost at its first call. */
void outage_cut_power(struct outage_run *f);
void outage_run_undisturbed(void); /* an undisturbed run, before the others */

#endif
