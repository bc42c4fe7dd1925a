/* SPDX-License-Identifier: Apache-2.0 */
/* The state of a farm, for the files of this folder only. */
#ifndef COORDINATOR_CORE_STATE_H
#define COORDINATOR_CORE_STATE_H

#include "common/estimate/forecast.h"
#include "coordinator/core/config.h"
#include "coordinator/core/job_fields.h"
#include "coordinator/core/event.h"
#include "coordinator/core/identity.h"
#include "coordinator/core/list.h"
#include "coordinator/core/peer_class.h"
#include "coordinator/core/rate.h"
#include "coordinator/core/slot.h"
#include "coordinator/core/update.h"

struct owner;
struct proof;

enum { JOB_NAME = 128, JOB_DURATIONS = 31 };

struct job {
	uint64_t id;
	struct owner *owner;
	char name[JOB_NAME];
	int priority;
	bool mixed;
	double verify;
	uint64_t verify_seed;
	struct plan plan;
	enum job_state state;
	enum job_end end;
	struct peer_class *class; /* class of workers that the job is pinned to; NULL: not pinned, or ended */
	char fingerprint[FINGERPRINT_SIZE];
	double submitted, started, ended;

	uint32_t slot_count;
	struct slot *slots;   /* [groups][parts]; NULL once the job has ended */
	struct proof *proofs; /* [groups][parts]; NULL: not verified, or ended */
	uint32_t noted;	      /* slots with an answer that waits for an equal one */
	enum lease_kind kind; /* kind of the open leases */
	uint64_t rounds;      /* number of complete rounds of this kind */
	uint64_t limit;	      /* number of rounds of this kind in the plan */
	/* done: slots that have merged round `rounds`; ahead: slots that have also merged the round after it */
	uint32_t done, ahead;
	bool spread; /* a slot has merged even more, because an epoch of another slot was taken back */
	/* Lists of slots: [0] of the first incomplete round, [1] of the next round. Nobody holds slots in `ready`,
	 * one worker holds those in `out`. */
	struct link ready[2], out[2];
	struct link second[2]; /* like `ready`, for slots that wait for another worker's answer */
	struct link blocked;   /* slots whose next epoch is beyond both open rounds */
	uint32_t leases_out;

	bool preparing, evaluating;
	bool disagrees;	     /* see EVENT_IMAGE_KNOWN */
	enum job_end ending; /* bound that ends the job after one last estimate of the error; END_NONE: none */

	double durations[JOB_DURATIONS]; /* durations in s of the last merged leases of this kind */
	uint32_t duration_count;
	double median; /* of `durations`; NAN: nothing merged yet */
	struct rate rate;
	double progress_floor, rel_error;
	double opened;	  /* start of the first round; NAN: not yet */
	double looked_at; /* when the last estimate of the error was asked for */
	struct forecast_history looks;
	struct forecast_cost stop, halving;
	uint64_t rel_error_rounds, bootstrap_merged, leases_merged;
	struct job_counts counts;
	struct failure_quorum failure_quorum; /* workers that failed with any of the job's leases */
	uint32_t tries; /* failures; several leases of one worker that fail at once count as one */
	char text[256];
	char held[JOB_HOLDS][256]; /* why the job is held, by enum job_hold; "": no such reason */
	double held_since;	   /* since when the job is held; NAN: it is not held */
	/* When a file of the job's scene was found missing or damaged, or was repaired; 0: never. */
	double files_changed;
};

enum { PEER_NAME = IDENTITY_NAME };

/* A connected worker. Workers that want a lease queue by fingerprint, those waiting longest first. */
struct peer {
	uint64_t id;
	char name[PEER_NAME];
	struct identity *who;
	char home[IDENTITY_HOME];
	uint64_t restarts;
	struct peer_class *class;
	uint32_t threads, want;
	uint32_t held; /* leases that are neither overdue nor delivered */
	uint32_t delivered;
	enum peer_state state;
	struct link waiting;
	uint64_t queued; /* place in the order of waiting, see farm.queued */
	double joined, last_seen;
	bool returns; /* the worker has reconnected, and this connection is closing */
	uint64_t merged, repeats, refused, faults, failures;
	char text[256];
	uint32_t lease_limit;
	struct lease leases[];
};

struct farm {
	struct farm_config config;
	double now;
	uint64_t next_job;
	struct job **jobs; /* sorted by id, including ended ones */
	uint32_t job_count;
	struct job **live; /* sorted by priority, then id */
	/* live_limit: room in `live`; exceeds config.max_jobs if many jobs were restored */
	uint32_t live_count, live_limit;
	struct peer **peers; /* sorted by id */
	uint32_t peer_count;
	struct identity **known; /* identities of workers that are or were connected */
	uint32_t known_count, known_limit;
	struct identity_index index; /* finds the entries of `known` */
	uint64_t identities;	     /* id of the newest identity */
	struct link classes, owners;
	uint32_t waiting;   /* workers that want a lease */
	uint64_t queued;    /* next place in the order of waiting */
	double check_at;    /* nothing can time out before this time */
	double idle_at;	    /* when give_up_copies is due again */
	double schedule_at; /* when a lease may go out even without another event */
	struct action *actions;
	size_t action_count, action_limit;
	size_t lease_limit; /* limits of leases of all workers together */
	char text[256];	    /* text of the answer to the current event */
};

/* Returns the key of the slot's next lease. */
static inline struct lease_key slot_key(const struct job *j, const struct slot *s)
{
	uint32_t index = (uint32_t)(s - j->slots);
	return (struct lease_key){.job = j->id,
				  .kind = j->kind,
				  .group = index / j->plan.parts,
				  .part = index % j->plan.parts,
				  .epoch = s->next};
}

/* Each returns NULL if there is none of this id. */
struct job *farm_find_job(const struct farm *f, uint64_t id);
struct peer *farm_find_peer(const struct farm *f, uint64_t id);
uint32_t farm_peer_place(const struct farm *f, uint64_t id); /* index of the first peer whose id is not below `id` */

/* Reserves room for the actions of an update; called when workers join and jobs are submitted, so that update_add
 * cannot fail. more_leases: lease limit of the worker that joins. Returns -ENOMEM if out of memory. */
int update_reserve(struct farm *f, size_t more_leases);
struct action *update_add(struct farm *f, enum action_kind kind);

#endif
