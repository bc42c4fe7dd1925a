/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All jobs: live ones, those being read after a restart, and the last that ended; where they are stored; and what the
 * folders that work on them share. Connections are reached only through a table of functions (peer_calls.h). The
 * loop's thread, except for what a job's own header gives to the thread pool.
 */
#ifndef COORDINATOR_LIVE_JOB_JOBS_H
#define COORDINATOR_LIVE_JOB_JOBS_H

#include "common/blob/blob.h"
#include "coordinator/core/farm.h"
#include "coordinator/live_job/config.h"
#include "coordinator/live_job/live_job.h"
#include "coordinator/live_job/peer_calls.h"
#include "coordinator/live_job/replay.h"
#include "coordinator/store/ledger.h"
#include "coordinator/store/age_clock.h"
#include "coordinator/store/spool.h"

#include <sys/queue.h>
#include <uv.h>

struct step_handlers;
struct incoming;
struct clearing;
struct file_check;
struct durable_ack;
struct unrecorded_end;
struct extension_request;
struct recovery;

/* An event for the core that arose while an update was being carried out. */
struct deferred_event {
	STAILQ_ENTRY(deferred_event) next;
	struct event event;
	char text[256];
};

enum { TICK_MS = 200, ENDED_JOBS_MAX = 200 /* ended jobs in the lists; older ones can still be fetched */ };

/* A job of the last run that is being read (coordinator/jobs/recovery.c). */
struct recovering_job {
	struct recovering_job *next;
	struct live_job *job;	  /* while it is being read, all of it but its id belongs to the pool */
	struct job_record record; /* what is shown of it meanwhile */
	uint64_t bytes;
	struct replay_progress progress;
	bool is_starting_over; /* its merged results are damaged, so it starts over */
};

struct jobs {
	struct server_config config;
	struct peer_calls peers;
	const struct step_handlers *step_handlers; /* coordinator/jobs/step.h */
	void (*stop)(void *user);		   /* ends the loop, for the reason in `fatal_code` */
	void *stop_user;
	uv_loop_t *loop;
	uv_timer_t wake_timer;
	uv_idle_t drain_idle;	    /* runs while results are left that had to wait for a canvas */
	uv_idle_t trim_idle;	    /* runs while the spool has more scene files than allowed */
	double messages_read_until; /* s: every message that arrived before this time has been read from its socket */
	struct farm *farm;
	struct spool *spool;
	struct blob_store *blobs;
	struct ledger *ledger;
	STAILQ_HEAD(, file_check) file_checks; /* files being read (coordinator/jobs/files.c) */
	struct live_job *live_jobs;	       /* live jobs */
	/* the jobs that ended last, at most ENDED_JOBS_MAX, in the order of their ends */
	struct job_record *ended_jobs;
	size_t ended_job_count;
	STAILQ_HEAD(, deferred_event) deferred_events;
	struct recovering_job *recovering_jobs; /* sorted by id */
	struct recovery *recovery; /* state of reading the jobs of an earlier run; NULL: all have been read */
	int fatal_code;		   /* why the coordinator stops by itself; 0: it does not */
	struct error fatal_error;
	uint64_t *restored_ids; /* ids of the jobs that continued when this run started */
	size_t restored_count;
	STAILQ_HEAD(ack_list, durable_ack) acks; /* acknowledgements that wait for a flush */
	struct ack_list parked_acks; /* acknowledgements that wait for a new journal in place of a failed one */
	struct unrecorded_end *unrecorded_ends; /* jobs that have ended and whose records could not be written yet */
	/* Next attempts to write records, and the copy of the ledger. */
	double unrecorded_ends_retry_at, ledger_retry_at;
	struct age_clock observed_clock; /* observed time when this run started */
	double next_folder_check_at;	 /* next check of the jobs' folders */
	double next_clearing_at;	 /* next round of clearing finished jobs */
	struct clearing *clearing;	 /* the running round; NULL: none */
	bool is_flushing;
	bool is_stepping, is_stopping;
	bool is_feeding_late_results;		      /* late_results_feed is running */
	bool is_checkpointing;			      /* a job's checkpoint is being written by the pool */
	struct extension_request *extension_requests; /* requests that wait, in order of arrival */
	/* An ended job that is being extended: the pool reads its films, and owns all of it but id and plan. NULL:
	 * none. */
	const struct live_job *extended_job;
	uint64_t extending_peer; /* peer that requested the extension; 0: no job is being read */
	uint64_t change_count;	 /* incremented whenever the status may have changed */
};

/* Calls `work` in a thread of the pool, then `done` in the loop's thread; both find `data` in w->data. Cannot fail:
 * libuv refuses only work without a function. */
void jobs_queue_work(struct jobs *jobs, uv_work_t *w, void *data, uv_work_cb work, uv_after_work_cb done);
double jobs_now(const struct jobs *jobs);			       /* s of the loop's clock */
struct live_job *jobs_find_live(const struct jobs *jobs, uint64_t id); /* NULL: no such live job */
/* Returns the folder for the films of a new job with this plan; NULL: they go into memory, which never waits for the
 * disk. */
const char *jobs_film_folder(const struct jobs *jobs, const struct plan *p);
/* Whether the job is being read from the spool, after a restart or for an extension. */
bool jobs_is_reading(const struct jobs *jobs, uint64_t job);
/* Returns -EDQUOT if the job would exceed its owner's quota. id: 0 for a new job, or the id of an existing one;
 * uploading: bytes of scene files that the owner is sending. */
int jobs_check_quota(const struct jobs *jobs, const char *owner, uint64_t id, uint64_t uploading,
		     const struct plan *plan, const Farm__Submit *m, struct error *e);

#endif
