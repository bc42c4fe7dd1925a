/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A running job with its data, beside the few numbers that the core (coordinator/core) keeps of it: scene files,
 * bootstrap, canvas, seeds, the chain states of each (group, part)'s last merged epoch, its log. The loop's thread;
 * while `busy`, a thread of the pool reads the canvas and nobody adds to it.
 */
#ifndef COORDINATOR_LIVE_JOB_LIVE_JOB_H
#define COORDINATOR_LIVE_JOB_LIVE_JOB_H

#include "common/base/log.h"
#include "common/blob/blob.h"
#include "common/estimate/canvas_image.h"
#include "common/estimate/convergence.h"
#include "common/estimate/merge.h"
#include "common/wire/batch_wire.h"
#include "coordinator/live_job/view.h"
#include "coordinator/store/journal.h"
#include "coordinator/store/spool.h"

#include <sys/queue.h>
#include <uv.h>

struct jobs;
struct live_job;

/* Work on whole films (coordinator/jobs/publish.h). */
enum publish_what {
	PUBLISH_ERROR_ONLY, /* answered by EVENT_ERROR_KNOWN */
	PUBLISH_PREVIEW,    /* preview.exr */
	PUBLISH_RESULT,	    /* result.exr */
};

struct publishing { /* at most one at a time per live job */
	uv_work_t work;
	struct jobs *jobs;
	struct live_job *job;
	enum publish_what what;
	uint64_t rounds;
	double wall_seconds;
	enum job_end end;
	struct canvas_image image;
	struct convergence convergence;
	int rc;
	struct error error;
};

/* A result that arrived while the canvas was busy, or a failure while the job's files are read. */
struct waiting_batch {
	STAILQ_ENTRY(waiting_batch) next;
	uint64_t peer;
	struct lease_key key;
	struct envelope envelope;
	struct buf payload;
	bool checked; /* a failure: the job's files have been read since it came */
};

/* Seconds after the job's first lease, including earlier runs: at the last merged batch, at the start of the first
 * round, at the end of the last complete round. NAN: not yet. */
struct live_job_times {
	double elapsed, opened, completed;
};

/* Results of a worker that count without having been verified. */
struct live_job_credit {
	uint64_t who; /* the core's number of the worker */
	uint64_t leases;
};

/* A stored result that cannot count yet (late.h). */
struct late_result {
	struct lease_key key;
	uint64_t at;
	uint64_t peer; /* the worker that the core has given the lease to; 0: none */
};

/* Where a merged batch is in the journal (rollback.h). */
struct merged_record {
	uint32_t slot;
	uint64_t epoch, at;
};

/* Who made the last batch; name "": not known. */
struct live_job_maker {
	char name[128], certificate[72], home[40];
	uint64_t restarts;
};

struct live_job {
	struct live_job *next;
	uint64_t id;
	struct envelope submit; /* owned */
	struct plan plan;
	struct job_record record;    /* its counters as last written; the core has the current ones */
	struct job_record *earlier;  /* of its end before it was extended, whose image exists; NULL: none */
	struct bootstrap *bootstrap; /* until the canvas exists */
	struct canvas *canvas;	     /* from then on */
	const char *film_folder;     /* folder for the films when it is read from the spool; NULL: memory */
	struct bootstrap_result lit;
	uint64_t *seeds;	       /* [groups][chains / groups]; NULL for samples */
	struct chain_state **states;   /* [groups x parts]; NULL entries: no epoch merged yet */
	uint64_t state_bytes;	       /* memory of those */
	struct live_job_maker *makers; /* [groups x parts]: of those */
	bool *again;		       /* [groups x parts]: the next batch replaces one that was taken back */
	struct merged_record *merged;  /* in order of merging */
	size_t merged_count;
	uint64_t kept_bytes; /* of the journal; earlier batches are in its checkpoint */
	uint32_t chains_per_lease;
	int log; /* file descriptor of the log */
	uint64_t log_bytes;
	struct journal *journal;
	bool pinned; /* the journal has the record of its fingerprint */
	struct live_job_times times;
	char fingerprint[256];	   /* an image of an earlier run */
	uint64_t checkpoint_bytes; /* of the last attempt */
	double checkpoint_after;   /* s of the loop's clock: next attempt */
	double look_written;	   /* work of the last estimate stored in the journal */
	bool lacks_file;	   /* files of its scene, for which it is held */
	bool unread;		   /* one of them could not be read, or was wrong, when they were last read */
	bool held;		   /* its results cannot be stored */
	size_t held_bytes;	   /* of the result that there was no room for */
	uint64_t held_states;	   /* its chain states had none; bytes that they would have; 0: they had */
	double try_again;	   /* s of the loop's clock: what the disk refused */
	bool unsure; /* whether the last checkpoint was renamed is unknown: nothing is stored before the next one */
	uint64_t generation_least; /* of that one */
	bool unprepared;	   /* the disk has no room for its films yet */
	bool unpublished;	   /* it has ended, but its image could not be written yet */
	uint64_t unpublished_rounds;
	bool unrecorded; /* ... but its record could not be written */
	bool overflowed; /* a sum of its batches left the films' range: the films are kept as they are */
	bool busy, ended;
	struct publishing publishing; /* valid while busy */
	bool black;		      /* as the published image, or the bootstrap */
	double preview_made;	      /* s of the loop's clock; 0: never */
	uint32_t worker_count;	      /* workers that had leases of it */
	uint64_t last_workers[64];
	struct live_job_credit *credits;
	size_t credit_count;
	char doubts[512]; /* about results of workers that are quarantined now; "": none */
	struct late_result *late;
	size_t late_count;
	STAILQ_HEAD(waiting_list, waiting_batch) waiting;
	size_t waiting_bytes;
};

/* Takes the submission; writes a record if it is new. The job's folder exists; owner as in the record; submitted: s
 * since 1970 for a job of an earlier run; 0: now. */
int live_job_new(struct live_job **job, uint64_t id, struct envelope *submit, const struct plan *plan,
		 const char *owner, double submitted, struct spool *s, struct error *e);
/* Frees memory; blobs and files stay. Not while busy. */
void live_job_free(struct live_job *job);

const Farm__Submit *live_job_submit(const struct live_job *job);
__attribute__((format(printf, 3, 4))) void live_job_log(struct live_job *job, enum log_event event, const char *fields,
							...);

/* Merges a batch that the core accepted. Takes its states. */
int live_job_merge(struct live_job *job, struct batch *b, struct error *e);
/* Takes the chain states of a group and part. */
void live_job_set_states(struct live_job *job, uint32_t slot, struct chain_state *states);
/* Call after a batch was merged, this many seconds after the first lease. rounds: complete before. */
void live_job_note_times(struct live_job *job, double elapsed, uint64_t rounds);
uint64_t live_job_rounds(const struct live_job *job); /* complete */
/* The bootstrap is complete: makes b, seeds and canvas. */
int live_job_prepare(struct live_job *job, const char *canvas_folder, struct error *e);
/* Whether a lease starts from chain states, those of the epoch before, with this digest. */
bool live_job_gives_states(const struct live_job *job, const struct lease_key *k, const struct blob_hash *digest);
/* A lease as a frame for a worker. anew: with seeds, whatever its epoch. */
int live_job_pack_lease(const struct live_job *job, const struct lease_key *k, bool anew, unsigned char **frame,
			size_t *size, struct error *e);
void live_job_count_worker(struct live_job *job, uint64_t peer);

/* Takes both. checked: as in struct waiting_batch. false: out of memory. */
bool live_job_put_off(struct live_job *job, uint64_t peer, const struct lease_key *k, struct envelope *env,
		      struct buf *payload, bool checked);
const struct waiting_batch *
live_job_waits_for(const struct live_job *job,
		   const struct lease_key *k);			   /* NULL: no result of that lease is waiting */
struct waiting_batch *live_job_take_waiting(struct live_job *job); /* NULL: none */
/* The first waiting failure of a worker that is no refusal of chain states; NULL: none. */
struct waiting_batch *live_job_take_failure(struct live_job *job, uint64_t peer);
/* Drops the waiting results of a worker that is gone. */
void live_jobs_drop_waiting(struct live_job *first, uint64_t peer);
void waiting_batch_free(struct waiting_batch *w);

/* Releases the blobs of its scene files. */
void live_job_release_blobs(const Farm__Submit *m, struct blob_store *s);
uint64_t live_job_asset_bytes(const Farm__Submit *m); /* total size of its files, as submitted */

#endif
