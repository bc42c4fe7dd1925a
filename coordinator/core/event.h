/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The input of the coordinator's core (farm.h). The caller owns everything in an event; the core copies what it
 * keeps. Times are seconds of a monotonic clock; an event with an earlier time than the last one is treated as
 * simultaneous with it.
 *
 * The comment on each kind of event names the members of struct event that the caller sets.
 */
#ifndef COORDINATOR_CORE_EVENT_H
#define COORDINATOR_CORE_EVENT_H

#include "common/film/batch.h"
#include "common/estimate/forecast.h"
#include "common/plan/plan.h"
#include "coordinator/core/job_fields.h"

enum event_kind {
	EVENT_TICK,	     /* none: time has passed; due at update.wake_time at the latest */
	EVENT_JOINED,	     /* join */
	EVENT_LEFT,	     /* peer: its connection is closed */
	EVENT_HEARTBEAT,     /* peer: every other event of a peer counts as a heartbeat, too */
	EVENT_LEASE_REQUEST, /* peer, wanted_leases */
	EVENT_BATCH,	     /* peer, key, is_valid, text: the result of a lease */
	EVENT_STORED_BATCH,  /* key, digest: a result stored by an earlier run, which may count now */
	/* peer, key: a result has arrived and will be judged later (EVENT_BATCH); meanwhile the worker may get
	 * another lease */
	EVENT_BATCH_DELIVERED,
	EVENT_LEASE_FAILED, /* peer, key, text: the worker failed to compute the lease */
	/* peer, key: the worker is stopping and returns the lease unfinished, which is no failure */
	EVENT_LEASE_RETURNED,
	EVENT_SUBMIT,	       /* tag, submit */
	EVENT_CANCEL,	       /* tag, job */
	EVENT_PREPARED,	       /* prepared: the answer to ACTION_BOOTSTRAP_DONE */
	EVENT_ERROR_ESTIMATED, /* error_estimated: the answer to ACTION_ESTIMATE_ERROR */
	/* image_published: statistics of the final image after ACTION_PUBLISH; the job has ended */
	EVENT_IMAGE_PUBLISHED,
	/* tag, restore: continues a job of an earlier run, or a job that has ended. With tag 0 max_jobs does not
	 * apply, and only lack of memory can prevent it. */
	EVENT_RESTORE,
	/* tag, job, hold, text: hands out no more leases of the job; an empty text ends this hold. */
	EVENT_HOLD,
	EVENT_SET_PRIORITY, /* tag, job, priority: applies from the next lease on */
	EVENT_EXTEND,	    /* tag, job, plan: the job's own plan with other bounds; not fewer rounds */
	EVENT_QUARANTINED, /* join (without peer, fingerprint, threads), text: a worker quarantined in an earlier run */
	EVENT_JOB_FAILED,  /* job, text: the job fails (a sum left the grid, the disk is full) */
};

/* Reasons to hold a job. Several may apply at once; leases go out when none applies. */
enum job_hold {
	HOLD_STORAGE, /* its results cannot be stored */
	HOLD_FILES,   /* a file of its scene is missing or damaged */
	HOLD_USER,    /* a user asked for it */
	JOB_HOLD_COUNT,
};

/* SHA-256 over everything in a batch that affects bits. */
struct batch_digest {
	uint8_t bytes[32];
};

enum {
	JOIN_HOME_SIZE = 40,
	JOIN_NAME_SIZE = 128 /* sizes of the names of a home and of a worker, including the final 0 */
};

struct event_join {
	uint64_t peer;		 /* chosen by the caller, not 0, never reused */
	const char *name;	 /* not empty */
	const char *fingerprint; /* compared for equality only */
	uint32_t threads;
	const char *certificate; /* name in the worker's certificate; NULL: it has none */
	const char *home;	 /* name of the folder that counts the worker's starts; NULL: none */
	uint64_t restarts;	 /* number of starts counted in the home */
};

struct event_submit {
	const struct plan *plan; /* must have passed plan_check */
	const char *name;
	int priority; /* -100..100 */
	/* Name in the owner's certificate. "": no certificate, and all these jobs have the same owner. */
	const char *owner;
	bool is_mixed; /* accepts workers of any numeric fingerprint */
	/* Fraction of the job's leases that two workers compute; ignored for mixed jobs, whose results cannot be
	 * compared. */
	double verify_fraction;
};

/* The state of a job that continues, described by which leases are merged. */
struct event_restore {
	uint64_t job; /* the job's id */
	struct event_submit submit;
	const char *fingerprint;     /* "": the job is not pinned */
	enum lease_kind kind;	     /* kind of the open leases; LEASE_RENDER: b and seeds exist */
	const uint64_t *next_epochs; /* [groups][parts]: first epoch of this kind that is not merged */
	/* [groups][parts]: the worker that made the last merged batch (peer, fingerprint and threads are not set);
	 * its name is NULL if unknown. The array is NULL if no maker is known. */
	const struct event_join *makers;
	bool is_black; /* as in EVENT_PREPARED */
	/* Seconds after the job's first lease: now, at the start of the first round, and at the end of the last
	 * complete round. NAN: not reached yet. The time between two runs of the coordinator is not included. */
	double elapsed, first_round_at, last_round_end;
	const struct forecast_history *looks;
	struct job_counts counts; /* counted so far */
};

struct event {
	enum event_kind kind;
	double time;
	/* In seconds. Messages that arrived during the last `unread_seconds` seconds may not have been read yet, so no
	 * worker is blamed for silence in that time. */
	double unread_seconds;
	uint64_t peer;
	uint64_t job;
	/* Returned in the answer. For events other than SUBMIT and CANCEL there is an answer only if they are
	 * refused. */
	uint64_t tag;
	const char *text;
	union {
		struct event_join join;
		/* How many leases the worker wants to hold in total: its number of threads plus one to hide the
		 * network's latency, or 0 when it is stopping. The core keeps the number until the next request, so
		 * requests and leases may cross on the wire in any order. */
		uint32_t wanted_leases;
		struct {
			struct lease_key key;
			/* BATCH: the result passed batch_check and the checks of the frame; otherwise text says what
			 * is wrong. */
			bool is_valid;
			/* BATCH, STORED_BATCH: set for leases for which farm_lease_is_verified returns true. */
			struct batch_digest digest;
			bool is_worker_at_fault; /* LEASE_FAILED: a fault of the worker's own machine, not of the job */
			bool is_memory_full; /* with is_worker_at_fault: temporary, because the worker's memory is in
						use */
			bool has_bad_states; /* LEASE_FAILED: the worker refuses the chain states of the grant */
			/* With has_bad_states: the refused states are not the lease's current states but those of an
			 * earlier grant. */
			bool has_outdated_states;
			/* With has_bad_states: the batch that produced the states can be taken out of the films, and
			 * the earlier states are available. */
			bool can_roll_back;
		} lease;
		enum job_hold hold;
		int priority;
		const struct plan *plan;
		struct event_submit submit;
		struct event_restore restore;
		struct {
			uint64_t job;
			bool ok; /* otherwise text says why the job fails */
			bool black;
		} prepared;
		struct {
			uint64_t job, rounds;
			double rel_error; /* square root of the upper end of the interval of the relMSE; NAN: unknown */
			bool doubtful;	  /* the interval is not known, so the error does not end the job */
			double rel_mse, degrees; /* estimated relMSE and its degrees of freedom; 0: unknown */
			double cpu_seconds;	 /* CPU time of all merged render leases */
			bool black;		 /* the image is black and therefore has no relative error */
		} error_estimated;
		struct {
			uint64_t job;
			bool chains_disagree; /* the job's chains disagree (common/estimate/convergence.h) */
		} image_published;
	};
};

#endif
