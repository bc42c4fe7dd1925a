/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All jobs: those that run, those that are being read, the last that ended; where they are stored; and what the
 * rooms that work on them share. Connections are reached by a table of functions alone (peer_calls.h). The loop's
 * thread, but for what a job's own header gives to the pool.
 */
#ifndef COORDINATOR_JOB_JOBS_H
#define COORDINATOR_JOB_JOBS_H

#include "common/blob/blob.h"
#include "coordinator/core/farm.h"
#include "coordinator/job/config.h"
#include "coordinator/job/live_job.h"
#include "coordinator/job/peer_calls.h"
#include "coordinator/job/replay.h"
#include "coordinator/store/ledger.h"
#include "coordinator/store/seen.h"
#include "coordinator/store/spool.h"

#include <uv.h>

struct follow_up;
struct incoming;
struct clearing;
struct durable_ack;
struct ending;
struct extension_request;
struct recovery;

/* An event for the core that came up while its last update was carried out. */
struct deferred {
	struct deferred *next;
	struct event event;
	char text[256];
};

enum { TICK_MS = 200, ENDED_MAX = 200 /* ended jobs in the lists; older ones can still be fetched */ };

/* A job of the last run that is being read (coordinator/jobs/recovery.c). */
struct found {
	struct found *next;
	struct live_job *job;	  /* all but its id is the pool's while it is read */
	struct job_record record; /* as it is shown meanwhile */
	uint64_t bytes;
	struct replay_progress progress;
	bool anew; /* what was merged of it is damaged, and it begins anew */
};

struct jobs {
	struct server_config config;
	struct peer_calls peers;
	const struct follow_up *follow_up; /* coordinator/jobs/step.h */
	void (*stop)(void *user);	   /* the loop is to end: `fault` says why */
	void *stop_user;
	uv_loop_t *loop;
	uv_timer_t wake, drain; /* drain: results that waited for a canvas */
	double read;		/* s: what came before this has been read from all sockets */
	struct farm *farm;
	struct spool *spool;
	struct blob_store *blobs;
	struct ledger *ledger;
	struct live_job *live;	  /* all that run */
	struct job_record *ended; /* ENDED_MAX, oldest first */
	size_t ended_count;
	struct deferred *deferred, **deferred_last;
	char refusal[256];	   /* of the last event that the core refused */
	struct found *found;	   /* ascending by id */
	struct recovery *recovery; /* the jobs of an earlier run are being read; NULL: no more */
	int fault;		   /* why it stops by itself; 0: it does not */
	struct error fault_error;
	uint64_t *restored; /* ids of the jobs that went on when this run began */
	size_t restored_count;
	struct durable_ack *acks, **acks_last; /* that wait for a flush */
	struct durable_ack *parked;	       /* ... for a journal that failed to be a good one again */
	struct ending *endings;		       /* jobs that ended and whose records could not be written yet */
	double endings_again;
	struct seen seen;	   /* when this run began */
	double folders_next;	   /* when jobs' folders are looked for */
	double clear_next;	   /* when finished jobs are looked at again */
	struct clearing *clearing; /* they are being looked at */
	bool flushing;
	bool stepping, stopping;
	bool feeding;			     /* late results */
	bool checkpointing;		     /* of some job, by the pool */
	struct extension_request *extending; /* that wait, in the order in which they came */
	const struct live_job *reading;	     /* of an ended job: the pool reads its films, and all else of it but id and
						plan is the pool's */
	uint64_t reading_for;		     /* the peer that asked for that; 0: none is read */
	uint64_t changes;		     /* grows with whatever the status shows */
};

double jobs_now(const struct jobs *jobs);			  /* s on the loop's clock */
struct live_job *jobs_find(const struct jobs *jobs, uint64_t id); /* NULL: it does not run */
/* Where the films of a job of this plan go: NULL: into memory, which is never kept waiting by the disk. */
const char *jobs_film_folder(const struct jobs *jobs, const struct plan *p);
/* It is being read from the spool, to go on. */
bool jobs_is_read(const struct jobs *jobs, uint64_t id);
/* -EDQUOT: the owner has too much already. id: 0, or one that is there already; uploading: bytes of scenes that are on
 * their way. */
int jobs_within_quota(const struct jobs *jobs, const char *owner, uint64_t id, uint64_t uploading,
		      const struct plan *plan, const Farm__Submit *m, struct error *e);

#endif
