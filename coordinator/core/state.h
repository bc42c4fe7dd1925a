/* SPDX-License-Identifier: Apache-2.0 */
/* What a farm holds; for the files of this folder alone. */
#ifndef COORDINATOR_CORE_STATE_H
#define COORDINATOR_CORE_STATE_H

#include "common/estimate/forecast.h"
#include "coordinator/core/config.h"
#include "coordinator/core/counts.h"
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
	struct peer_class *class; /* whose it is; NULL: nobody's yet, or ended */
	char fingerprint[FINGERPRINT_SIZE];
	double submitted, started, ended;

	uint32_t slot_count;
	struct slot *slots;	      /* [groups][parts]; NULL when ended */
	struct proof *proofs;	      /* as many; NULL: nothing is verified, or ended */
	uint32_t noted;		      /* slots that have an answer which waits for another */
	enum lease_kind kind;	      /* of the leases that are open */
	uint64_t rounds;	      /* complete, of this kind */
	uint64_t limit;		      /* rounds of this kind */
	uint32_t done, ahead;	      /* slots that have merged round `rounds`; the one after it too */
	bool spread;		      /* some slot has merged even more: epochs of another were taken back */
	struct link ready[2], out[2]; /* by round: the first incomplete one and the next; `out` has one holder */
	struct link second[2];	      /* the same: verified, and waits for a worker that has not had it */
	struct link blocked;	      /* the round after those */
	uint32_t leases_out;

	bool preparing, evaluating;
	bool disagrees;	     /* see EVENT_IMAGE_KNOWN */
	enum job_end ending; /* the bound that is met, while the error is evaluated once more */

	double durations[JOB_DURATIONS]; /* of merged leases of this kind */
	uint32_t duration_count;
	double median; /* NAN: none yet */
	struct rate rate;
	double progress_floor, rel_error;
	double opened;	  /* the first round; NAN: not yet */
	double looked_at; /* when the error was asked for last */
	struct forecast_history looks;
	struct forecast_range error_now; /* these, when there are looks */
	struct forecast_cost stop, halving;
	uint64_t rel_error_rounds, bootstrap_merged, leases_merged;
	struct job_counts counts;
	struct failure_quorum failure_quorum; /* with any of its leases */
	uint32_t anew;			      /* leases whose chains began anew, their states lost */
	uint32_t tries;			      /* that failed; several leases of one worker at once are one */
	char text[256];
	char held[JOB_HOLDS][256]; /* why no lease of it goes out; "" each when they do */
	double held_since;	   /* NAN: it is not */
	double files_changed; /* when a file of its scene was found gone or damaged, or was right again; 0: never */
};

enum { PEER_NAME = IDENTITY_NAME };

/* A worker as the core sees it. Waiting workers queue by fingerprint, the one that has waited longest first. */
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
	uint64_t queued; /* when it began to wait, as a number */
	double joined, last_seen;
	bool returns; /* it has called again, and this connection goes */
	uint64_t merged, repeats, refused, faults, failures, timeouts;
	char text[256];
	uint32_t lease_limit;
	struct lease leases[];
};

struct farm {
	struct farm_config config;
	double now;
	uint64_t next_job;
	struct job **jobs; /* by id; ended ones too */
	uint32_t job_count;
	struct job **live;		 /* by priority, then id */
	uint32_t live_count, live_limit; /* more than config.max_jobs when an earlier run left more */
	struct peer **peers;		 /* by id */
	uint32_t peer_count;
	struct identity **known; /* workers that are or were here */
	uint32_t known_count, known_limit;
	uint64_t identities; /* ids so far */
	struct link classes, owners;
	uint32_t waiting;   /* workers with a wish */
	uint64_t queued;    /* counts who began to wait */
	double check_at;    /* something may be silent or overdue then, not before */
	double idle_at;	    /* copies that are out are looked at then, not before */
	double schedule_at; /* handing out may be possible then though nothing else happens */
	struct action *actions;
	size_t action_count, action_limit;
	size_t lease_limit; /* of all workers */
	char text[256];	    /* of the answer to this event */
};

/* The lease of a slot that is next. */
static inline struct lease_key slot_key(const struct job *j, const struct slot *s)
{
	uint32_t index = (uint32_t)(s - j->slots);
	return (struct lease_key){.job = j->id,
				  .kind = j->kind,
				  .group = index / j->plan.parts,
				  .part = index % j->plan.parts,
				  .epoch = s->next};
}

#endif
