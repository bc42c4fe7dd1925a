/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A running job with its data, apart from the few numbers that the core (coordinator/core) keeps of it: scene files,
 * bootstrap, canvas, seeds, the chain states after the last merged epoch of each (group, part), its log. The loop's
 * thread; while `is_busy`, a thread of the pool reads the canvas and nobody adds to it.
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

/* Tasks that read whole films (coordinator/jobs/publish.h). */
enum publish_kind {
	PUBLISH_ERROR_ONLY, /* estimates the error; answered by EVENT_ERROR_ESTIMATED */
	PUBLISH_PREVIEW,    /* writes preview.exr */
	PUBLISH_RESULT,	    /* writes result.exr */
};

struct publish_task { /* a task; at most one at a time per live job */
	uv_work_t work;
	struct jobs *jobs;
	struct live_job *job;
	enum publish_kind kind;
	uint64_t rounds;
	double wall_seconds;
	enum job_end end;
	struct canvas_image image;
	struct convergence convergence;
	int rc;
	struct error error;
};

/* A result that arrived while the canvas was busy, or a failure that arrived while the job's files were being read. */
struct waiting_message {
	STAILQ_ENTRY(waiting_message) next;
	uint64_t peer;
	struct lease_key key;
	struct envelope envelope;
	struct buf payload;
	bool has_files_checked; /* of a failure: the job's files have been read since it arrived */
};

/* Seconds after the job's first lease, including earlier runs: at the last merged batch, at the start of the first
 * round, and at the end of the last complete round. NAN: not reached yet. */
struct live_job_times {
	double elapsed, first_round_at, last_round_end;
};

/* How many results of a worker were merged without having been verified. */
struct live_job_unverified_count {
	uint64_t worker_id; /* the core's id of the worker */
	uint64_t lease_count;
};

/* A stored result that cannot be merged yet (late_results.h). */
struct late_result {
	struct lease_key key;
	uint64_t offset;
	uint64_t peer; /* worker to which the core has given the lease; 0: none */
};

/* Where in the journal the batch of an epoch is (rollback.h). */
struct merged_record {
	uint32_t slot;
	uint64_t epoch, offset;
};

/* The worker that made a batch; name "": not known. */
struct live_job_maker {
	char name[128], certificate[72], home[40];
	uint64_t restarts;
};

struct live_job {
	struct live_job *next;
	uint64_t id;
	struct envelope submission; /* owned */
	struct plan plan;
	struct job_record record; /* its counters are those last written; the core has the current ones */
	/* Record of the end before the job was extended, whose image still exists; NULL: none. */
	struct job_record *earlier_record;
	struct bootstrap *bootstrap; /* NULL once the canvas exists */
	struct canvas *canvas;	     /* NULL before the bootstrap is complete */
	/* Folder for the films while the job is being read from the spool; NULL: they are in memory. */
	const char *film_folder;
	struct bootstrap_result bootstrap_result;
	uint64_t *seeds;	       /* [groups][chains / groups]; NULL if the plan has no chains */
	struct chain_state **states;   /* [groups x parts]; NULL entries: no epoch is merged yet */
	uint64_t state_bytes;	       /* memory that `states` takes */
	struct live_job_maker *makers; /* [groups x parts]: workers that made `states` */
	bool *is_replacement;	       /* [groups x parts]: the next batch replaces one that was taken back */
	/* journal records of batches that can be taken back, in order of merging */
	struct merged_record *merged_records;
	size_t merged_record_count;
	/* Bytes of JOURNAL_MERGED_BATCH records in the journal; their batches are also in the checkpoint. */
	uint64_t merged_record_bytes;
	uint32_t chains_per_lease;
	int log_fd;
	uint64_t log_bytes;
	struct journal *journal;
	bool is_fingerprint_journaled; /* the journal has a record of the fingerprint */
	struct live_job_times times;
	char fingerprint[256];	    /* numeric fingerprint that the job was pinned to when it was read from the spool */
	uint64_t checkpoint_bytes;  /* size of the last checkpoint; 0: none */
	double min_checkpoint_time; /* s of the loop's clock: no checkpoint before this time */
	double last_stored_look_work; /* work of the last estimate stored in the journal */
	bool has_missing_file;	      /* files of its scene are missing or damaged, so it is held */
	bool has_suspect_files;	      /* a file could not be read, or was wrong, when the files were last read */
	bool is_held_for_storage;     /* held because its results cannot be stored */
	size_t blocked_result_bytes;  /* size of the result for which there was no space */
	/* Bytes of chain states for which there was no room when the job was held; 0: states were not the reason. */
	uint64_t blocked_state_bytes;
	double retry_at; /* s of the loop's clock: when to try again what the disk refused */
	/* It is unknown whether the rename of the last checkpoint is durable, so nothing is stored before the next
	 * checkpoint. */
	bool is_checkpoint_uncertain;
	uint64_t min_generation; /* the next checkpoint has at least this generation */
	bool is_prepare_pending; /* its bootstrap is complete, but the disk has no room for its films yet */
	bool is_publish_pending; /* it has ended, but its image could not be written yet */
	uint64_t pending_publish_rounds;
	bool is_record_pending; /* it has ended, but its record could not be written yet */
	bool has_overflowed;	/* a sum left the range of the films, which are kept as they are */
	bool is_busy, has_ended;
	struct publish_task publish_task; /* valid while busy */
	bool is_black;			  /* whether the published image or, without one, the bootstrap is black */
	double preview_made_at;		  /* when preview.exr was last made, s of the loop's clock; 0: never */
	uint32_t worker_count;		  /* number of workers that had leases of the job */
	uint64_t last_workers[64];
	struct live_job_unverified_count *unverified_counts;
	size_t unverified_worker_count;
	char quarantine_notes[512]; /* notes on results of workers that have been quarantined since; "": none */
	struct late_result *late_results;
	size_t late_result_count;
	STAILQ_HEAD(waiting_list, waiting_message) waiting_messages;
	size_t waiting_bytes;
};

/* Makes a live job and takes over the submission. The job's folder must exist. owner: name in the certificate, or "".
 * submitted: s since 1970 for a job of an earlier run; 0: now. After an error the submission still belongs to the
 * caller. */
int live_job_new(struct live_job **out, uint64_t id, struct envelope *submit, const struct plan *plan,
		 const char *owner, double submitted, struct spool *s, struct error *e);
/* Frees the memory of a job that is not busy; scene files and the job's folder stay. */
void live_job_free(struct live_job *job);

const Farm__Submit *live_job_submission(const struct live_job *job);
__attribute__((format(printf, 3, 4))) void live_job_log(struct live_job *job, enum log_event event, const char *fields,
							...);

/* Merges a batch that the core has accepted, and takes over its states. Returns -ENOMEM or -ERANGE half way, see
 * live_job.c. */
int live_job_merge(struct live_job *job, struct batch *b, struct error *e);
/* Takes over the chain states of a group and part. */
void live_job_set_states(struct live_job *job, uint32_t slot, struct chain_state *states);
/* Call after a batch was merged. elapsed: seconds after the first lease; rounds: complete rounds before the merge. */
void live_job_note_times(struct live_job *job, double elapsed, uint64_t rounds);
uint64_t live_job_complete_rounds(const struct live_job *job);
/* Computes b, seeds and canvas when the bootstrap is complete. */
int live_job_prepare(struct live_job *job, const char *canvas_folder, struct error *e);
/* Whether a lease starts from chain states (those after the previous epoch) and they have this digest. */
bool live_job_states_match(const struct live_job *job, const struct lease_key *k, const struct blob_hash *digest);
/* Packs a lease as a frame for a worker. from_seeds: with seeds instead of states, whatever its epoch. */
int live_job_pack_lease(const struct live_job *job, const struct lease_key *k, bool from_seeds, unsigned char **frame,
			size_t *size, struct error *e);
/* Counts the worker in worker_count, unless it is among the last 64 different ones. */
void live_job_count_worker(struct live_job *job, uint64_t peer);

/* Keeps a message until the canvas is free or the files have been read; takes over envelope and payload.
 * has_files_checked: as in struct waiting_message. Returns false if out of memory. */
bool live_job_enqueue_message(struct live_job *job, uint64_t peer, const struct lease_key *k, struct envelope *env,
			      struct buf *payload, bool files_checked);
/* Returns a waiting message about this lease; NULL: none. */
const struct waiting_message *live_job_find_waiting(const struct live_job *job, const struct lease_key *k);
/* The first one, which then belongs to the caller; NULL: none. */
struct waiting_message *live_job_pop_waiting(struct live_job *job);
/* Removes and returns the first waiting failure of this worker, not counting refusals of chain states; NULL: none. */
struct waiting_message *live_job_pop_failure(struct live_job *job, uint64_t peer);
/* Drops all waiting messages of a worker that is gone. */
void live_jobs_drop_waiting(struct live_job *first, uint64_t peer);
void waiting_message_free(struct waiting_message *w);

/* Releases the blobs of the submission's scene files. */
void live_job_release_blobs(const Farm__Submit *m, struct blob_store *s);
/* Total size of its scene files as submitted; UINT64_MAX: too large to count. */
uint64_t live_job_asset_bytes(const Farm__Submit *m);

#endif
