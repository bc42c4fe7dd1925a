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
	struct peer_class *class; /* the class it is pinned to; NULL: none yet, or ended */
	char fingerprint[FINGERPRINT_SIZE];
	double submitted, started, ended;

	uint32_t slot_count;
	struct slot *slots;   /* [groups][parts]; NULL when ended */
	struct proof *proofs; /* [groups][parts]; NULL: nothing is verified, or ended */
	uint32_t noted;	      /* slots with an answer that waits for another one */
	enum lease_kind kind; /* of the leases that are open */
	uint64_t rounds;      /* complete rounds of this kind */
	uint64_t limit;	      /* rounds of this kind */
	uint32_t done, ahead; /* slots that have merged round `rounds`; also the one after it */
	bool spread;	      /* some slot has merged even more, because an epoch of another was taken back */
	struct link ready[2],
		out[2];	       /* by round: the first incomplete one and the next; slots in `out` have one holder */
	struct link second[2]; /* the same, for slots that are verified and wait for another worker */
	struct link blocked;   /* slots blocked behind these rounds */
	uint32_t leases_out;

	bool preparing, evaluating;
	bool disagrees;	     /* see EVENT_IMAGE_KNOWN */
	enum job_end ending; /* the bound that is met while the error is estimated once more */

	double durations[JOB_DURATIONS]; /* of merged leases of this kind */
	uint32_t duration_count;
	double median; /* NAN: none yet */
	struct rate rate;
	double progress_floor, rel_error;
	double opened;	  /* start of the first round; NAN: not yet */
	double looked_at; /* when the error was last estimated */
	struct forecast_history looks;
	struct forecast_cost stop, halving;
	uint64_t rel_error_rounds, bootstrap_merged, leases_merged;
	struct job_counts counts;
	struct failure_quorum failure_quorum; /* workers that failed with any of its leases */
	uint32_t tries;			      /* failures; several leases of one worker at once count as one */
	char text[256];
	char held[JOB_HOLDS][256]; /* why none of its leases go out; "" each if they do */
	double held_since;	   /* when it was held; NAN: it is not */
	double files_changed; /* when a file of its scene was found missing or damaged, or was repaired; 0: never */
};

enum { PEER_NAME = IDENTITY_NAME };

/* A worker as the core sees it. Waiting workers queue by fingerprint, longest waiting first. */
struct peer {
	uint64_t id;
	char name[PEER_NAME];
	struct identity *who;
	char home[IDENTITY_HOME];
	uint64_t restarts;
	struct peer_class *class;
	uint32_t threads, want;
	uint32_t held; /* leases held that are neither overdue nor delivered */
	uint32_t delivered;
	enum peer_state state;
	struct link waiting;
	uint64_t queued; /* its place in the order of waiting */
	double joined, last_seen;
	bool returns; /* it has reconnected, and this connection is closing */
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
	struct job **live;		 /* sorted by priority, then id */
	uint32_t live_count, live_limit; /* may exceed config.max_jobs after a restart */
	struct peer **peers;		 /* sorted by id */
	uint32_t peer_count;
	struct identity **known; /* workers that are or were connected */
	uint32_t known_count, known_limit;
	struct identity_index index; /* of them */
	uint64_t identities;	     /* last id given */
	struct link classes, owners;
	uint32_t waiting;   /* workers that want a lease */
	uint64_t queued;    /* last place in the order of waiting */
	double check_at;    /* nothing can time out before this time */
	double idle_at;	    /* the next scan of copies */
	double schedule_at; /* handing out may become possible then without another event */
	struct action *actions;
	size_t action_count, action_limit;
	size_t lease_limit; /* over all workers */
	char text[256];	    /* text of the answer to this event */
};

/* The key of a slot's next lease. */
static inline struct lease_key slot_key(const struct job *j, const struct slot *s)
{
	uint32_t index = (uint32_t)(s - j->slots);
	return (struct lease_key){.job = j->id,
				  .kind = j->kind,
				  .group = index / j->plan.parts,
				  .part = index % j->plan.parts,
				  .epoch = s->next};
}

/* NULL: there is none. */
struct job *farm_find_job(const struct farm *f, uint64_t id);
struct peer *farm_find_peer(const struct farm *f, uint64_t id);
uint32_t farm_peer_place(const struct farm *f, uint64_t id); /* index of the first one whose id is not below this */

/* Room for the actions of an update is reserved when workers join and jobs are submitted, so adding one cannot fail. */
int update_reserve(struct farm *f, size_t more_leases); /* -ENOMEM */
struct action *update_add(struct farm *f, enum action_kind kind);

#endif
