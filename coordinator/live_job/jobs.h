/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All jobs: running ones, those being read after a restart, and the last that ended; where they are stored; and what
 * the folders that work on them share. Connections are reached only through a table of functions (peer_calls.h). The
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

struct follow_up;
struct incoming;
struct clearing;
struct file_check;
struct durable_ack;
struct ending;
struct extension_request;
struct recovery;

/* An event for the core that arose while an update was being carried out. */
struct deferred {
	STAILQ_ENTRY(deferred) next;
	struct event event;
	char text[256];
};

enum { TICK_MS = 200, ENDED_MAX = 200 /* ended jobs in the lists; older ones can still be fetched */ };

/* A job of the last run that is being read (coordinator/jobs/recovery.c). */
struct recovering_job {
	struct recovering_job *next;
	struct live_job *job;	  /* while it is read, everything but its id belongs to the pool */
	struct job_record record; /* how it is displayed meanwhile */
	uint64_t bytes;
	struct replay_progress progress;
	bool anew; /* its merged results are damaged, and it starts over */
};

struct jobs {
	struct server_config config;
	struct peer_calls peers;
	const struct follow_up *follow_up; /* coordinator/jobs/step.h */
	void (*stop)(void *user);	   /* the loop is to end, for the reason `fault` */
	void *stop_user;
	uv_loop_t *loop;
	uv_timer_t wake;
	uv_idle_t drain; /* while results are left that waited for a canvas */
	uv_idle_t trim;	 /* while more files of scenes are stored than may be */
	double read;	 /* s: all messages that arrived before have been read from all sockets */
	struct farm *farm;
	struct spool *spool;
	struct blob_store *blobs;
	struct ledger *ledger;
	STAILQ_HEAD(, file_check) checks; /* files that are being read (coordinator/jobs/files.c) */
	struct live_job *live;		  /* running jobs */
	struct job_record *ended;	  /* at most ENDED_MAX, oldest first */
	size_t ended_count;
	STAILQ_HEAD(, deferred) deferred;
	struct recovering_job *found; /* sorted by id */
	struct recovery *recovery;    /* jobs of an earlier run that are being read; NULL: none left */
	int fault;		      /* why it stops by itself; 0: it does not */
	struct error fault_error;
	uint64_t *restored; /* ids of the jobs that continued when this run started */
	size_t restored_count;
	STAILQ_HEAD(ack_list, durable_ack) acks; /* waiting for a flush */
	struct ack_list parked;			 /* ... for a new journal to replace one that failed */
	struct ending *endings;			 /* jobs that ended and whose records could not be written yet */
	double endings_again, ledger_again;	 /* next attempts */
	struct age_clock seen;			 /* when this run started */
	double folders_next;			 /* next check of jobs' folders */
	double clear_next;			 /* next check of finished jobs */
	struct clearing *clearing;		 /* that check is running */
	bool flushing;
	bool stepping, stopping;
	bool feeding;			     /* results stored ahead of their predecessors */
	bool checkpointing;		     /* some job is being written by the pool */
	struct extension_request *extending; /* waiting requests, in order of arrival */
	const struct live_job
		*reading;     /* of an ended job: the pool reads its films, and owns all of it but id and plan */
	uint64_t reading_for; /* the peer that requested it; 0: none is being read */
	uint64_t changes;     /* incremented whenever the status changes */
};

/* A thread of the pool calls `work`, then the loop's thread `done`; each finds its data in ->data. Cannot fail: libuv
 * refuses only work without a function. */
void jobs_in_pool(struct jobs *jobs, uv_work_t *w, void *data, uv_work_cb work, uv_after_work_cb done);
double jobs_now(const struct jobs *jobs);			  /* s of the loop's clock */
struct live_job *jobs_find(const struct jobs *jobs, uint64_t id); /* NULL: it is not running */
/* Where the films of a job with this plan go. NULL: into memory, which never waits for the disk. */
const char *jobs_film_folder(const struct jobs *jobs, const struct plan *p);
/* Whether it is being read from the spool. */
bool jobs_is_read(const struct jobs *jobs, uint64_t id);
/* -EDQUOT: the owner's quota is used up. id: 0, or that of an existing job; uploading: bytes of scenes in transit. */
int jobs_within_quota(const struct jobs *jobs, const char *owner, uint64_t id, uint64_t uploading,
		      const struct plan *plan, const Farm__Submit *m, struct error *e);

#endif
