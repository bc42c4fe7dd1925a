/* SPDX-License-Identifier: Apache-2.0 */
/* A job and its slots. A slot is one (group, part): the chain of leases of which exactly one is next. */
#ifndef COORDINATOR_CORE_JOB_H
#define COORDINATOR_CORE_JOB_H

#include "common/estimate/forecast.h"
#include "coordinator/core/doubt.h"
#include "coordinator/core/failure_quorum.h"
#include "coordinator/core/farm.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/list.h"
#include "coordinator/core/lost.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/peer.h"
#include "coordinator/core/rate.h"

enum { JOB_NAME = 128, JOB_DURATIONS = 31 };

struct slot {
	struct link link;		      /* one of the job's lists, or alone: two holders, or nothing left to do */
	struct lease *leases;		      /* overdue ones too */
	uint64_t next;			      /* the first epoch that is not merged */
	double since;			      /* when the lease that is out was sent */
	struct failure_quorum failure_quorum; /* with the next epoch */
	struct lost lost;		      /* while they held it */
	struct doubt doubt;		      /* about the states with which it begins */
	uint32_t holders, timeouts;
};

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

/* NULL with a sentence when it is refused. */
struct job *job_new(struct farm *f, const struct event_submit *e, const char **refused);
void job_free(struct job *j);

bool job_is_live(const struct job *j);
bool job_is_open(const struct job *j); /* leases may be handed out and merged */
bool job_is_held(const struct job *j);
bool job_is_proven(const struct job *j);					/* something of it was made */
void job_hold(struct job *j, enum job_hold which, const char *why, double now); /* why "": no longer */
double job_elapsed(const struct job *j,
		   double now); /* s since its first lease, the time that it was held left out; NAN: none yet */
struct slot *job_slot(const struct job *j, uint32_t group, uint32_t part);
struct slot *job_ready(const struct job *j); /* NULL: none */
/* Puts the slot into the list where it belongs after its holders or its next epoch changed. */
void job_place(struct job *j, struct slot *s);
double job_idle_timeout(const struct farm_config *c, const struct slot *s); /* see farm_config */
double job_lease_timeout(const struct farm_config *c, const struct job *j, const struct slot *s);
double job_straggles_at(const struct farm_config *c, const struct job *j, const struct slot *s);
double job_lease_mutations(const struct job *j);

/* The slot's next epoch is merged. true: its round is complete now. */
bool job_merge(struct job *j, struct slot *s, double now, double duration);
/* The batch of the slot's last epoch is none: that epoch is next again. The rounds that it was in are open again, and
 * nobody works on what lies more than one round behind them. */
void job_take_back(struct farm *f, struct job *j, struct slot *s);
/* Of a job without merged leases: these are. next: see struct event_restore. */
void job_restore(struct job *j, enum lease_kind kind, const uint64_t *next, double now);
void job_raise_limit(struct job *j);		 /* to the plan's rounds */
void job_open_rounds(struct job *j, double now); /* render leases after the bootstrap */
/* Belongs to this class from now on; free again when nothing is merged and no lease is out. */
void job_pin(struct job *j, struct peer_class *c);
void job_unpin_if_untouched(struct job *j);
bool job_takes(const struct job *j, const struct peer *p);

double job_progress(const struct job *j, double now);
/* s; middle NAN: unknown. */
struct forecast_range job_eta(const struct job *j, double now);
/* The error of the prefix is known. */
void job_note_look(struct job *j, double rel_error, double rel_mse, double degrees, bool doubtful, double cpu_seconds);
void job_forecast(struct job *j); /* anew, from its looks */
/* Seconds until the error is half of what it is, at the present rate. */
struct forecast_range job_halving_seconds(const struct job *j, double now);

#endif
