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

enum { JOB_NAME_SIZE = 128, JOB_DURATION_WINDOW = 31 };

struct job {
	uint64_t id;
	struct owner *owner;
	char name[JOB_NAME_SIZE];
	int priority;
	bool is_mixed;
	double verify_fraction;
	uint64_t verify_seed;
	struct plan plan;
	enum job_state state;
	enum job_end end;
	struct peer_class *class; /* class of workers that the job is pinned to; NULL: not pinned, or ended */
	char fingerprint[FINGERPRINT_SIZE];
	double submitted_at, started_at, ended_at;

	uint32_t slot_count;
	struct slot *slots;	   /* [groups][parts]; NULL once the job has ended */
	struct proof *proofs;	   /* [groups][parts]; NULL: not verified, or ended */
	uint32_t noted_slot_count; /* slots with an answer that waits for an equal one */
	enum lease_kind kind;	   /* kind of the open leases */
	uint64_t rounds;	   /* number of complete rounds of this kind */
	uint64_t round_limit;	   /* number of rounds of this kind in the plan */
	/* done_slot_count: slots that have merged round `rounds`; ahead_slot_count: slots that have also merged the
	 * round after it */
	uint32_t done_slot_count, ahead_slot_count;
	bool has_far_ahead_slot; /* a slot has merged even more, because an epoch of another slot was taken back */
	/* Lists of slots: [0] of the first incomplete round, [1] of the next round. Nobody holds slots in
	 * `ready_slots`, one worker holds those in `leased_slots`. */
	struct link ready_slots[2], leased_slots[2];
	struct link awaiting_second_answer[2]; /* like `ready_slots`, for slots that wait for another worker's answer */
	struct link blocked_slots;	       /* slots whose next epoch is beyond both open rounds */
	uint32_t outstanding_lease_count;

	bool is_preparing, is_estimating_error;
	bool chains_disagree;	  /* see EVENT_IMAGE_PUBLISHED */
	enum job_end pending_end; /* bound that ends the job after one last estimate of the error; END_NONE: none */

	double durations[JOB_DURATION_WINDOW]; /* durations in s of the last merged leases of this kind */
	uint32_t duration_count;
	double median_duration; /* of `durations`; NAN: nothing merged yet */
	struct rate rate;
	double progress_floor, rel_error;
	double first_round_at;	      /* start of the first round; NAN: not yet */
	double estimate_requested_at; /* when the last estimate of the error was asked for */
	struct forecast_history looks;
	struct forecast_cost target_cost, halving_cost;
	uint64_t rel_error_rounds, bootstrap_merged, leases_merged;
	struct job_counts counts;
	struct failure_quorum failure_quorum; /* workers that failed with any of the job's leases */
	uint32_t failed_attempts; /* failures; several leases of one worker that fail at once count as one */
	char explanation[256];
	char hold_reasons[JOB_HOLD_COUNT][256]; /* why the job is held, by enum job_hold; "": no such reason */
	double held_since;			/* since when the job is held; NAN: it is not held */
	/* When a file of the job's scene was found missing or damaged, or was repaired; 0: never. */
	double files_changed_at;
};

enum { PEER_NAME_SIZE = IDENTITY_NAME_SIZE };

/* A connected worker. Workers that want a lease queue by fingerprint, those waiting longest first. */
struct peer {
	uint64_t id;
	char name[PEER_NAME_SIZE];
	struct identity *identity;
	char home[IDENTITY_HOME_SIZE];
	uint64_t restarts;
	struct peer_class *class;
	uint32_t threads, wanted_lease_count;
	uint32_t held_lease_count; /* leases that are neither overdue nor delivered */
	uint32_t delivered_lease_count;
	enum peer_state state;
	struct link waiting_link;
	uint64_t queue_position; /* place in the order of waiting, see farm.next_queue_position */
	double joined_at, last_seen;
	bool is_superseded; /* the worker has reconnected, and this connection is closing */
	uint64_t merged, repeats, refused, faults, failures;
	char last_fault[256];
	uint32_t lease_capacity;
	struct lease leases[];
};

struct farm {
	struct farm_config config;
	double now;
	uint64_t next_job_id;
	struct job **jobs; /* sorted by id, including ended ones */
	uint32_t job_count;
	struct job **live_jobs; /* sorted by priority, then id */
	/* live_job_capacity: room in `live_jobs`; exceeds config.max_jobs if many jobs were restored */
	uint32_t live_job_count, live_job_capacity;
	struct peer **peers; /* sorted by id */
	uint32_t peer_count;
	struct identity **registry; /* identities of workers that are or were connected */
	uint32_t registry_count, registry_capacity;
	struct identity_index identity_index; /* finds the entries of `registry` */
	uint64_t last_identity_id;	      /* id of the newest identity */
	struct link classes, owners;
	uint32_t waiting_count;	      /* workers that want a lease */
	uint64_t next_queue_position; /* next place in the order of waiting */
	double next_expiry_check_at;  /* nothing can time out before this time */
	double next_copy_check_at;    /* when give_up_copies is due again */
	double next_schedule_at;      /* when a lease may go out even without another event */
	struct action *actions;
	size_t action_count, action_capacity;
	size_t lease_capacity; /* limits of leases of all workers together */
	char answer_text[256]; /* text of the answer to the current event */
};

/* Returns the key of the slot's next lease. */
static inline struct lease_key slot_lease_key(const struct job *j, const struct slot *s)
{
	uint32_t index = (uint32_t)(s - j->slots);
	return (struct lease_key){.job = j->id,
				  .kind = j->kind,
				  .group = index / j->plan.parts,
				  .part = index % j->plan.parts,
				  .epoch = s->next_epoch};
}

/* Each returns NULL if there is none of this id. */
struct job *farm_find_job(const struct farm *f, uint64_t id);
struct peer *farm_find_peer(const struct farm *f, uint64_t id);
/* Returns the index of the first peer whose id is not below `id`. */
uint32_t farm_peer_lower_bound(const struct farm *f, uint64_t id);

/* Reserves room for the actions of an update; called when workers join and jobs are submitted, so that update_add
 * cannot fail. more_leases: lease limit of the worker that joins. Returns -ENOMEM if out of memory. */
int update_reserve(struct farm *f, size_t more_leases);
struct action *update_add(struct farm *f, enum action_kind kind);

#endif
