/* SPDX-License-Identifier: Apache-2.0 */
/* What the farm holds; for the files of the core alone. */
#ifndef COORDINATOR_CORE_STATE_H
#define COORDINATOR_CORE_STATE_H

#include "coordinator/core/farm.h"
#include "coordinator/core/job.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/peer.h"
#include "coordinator/core/worker_registry.h"
#include "coordinator/core/verify.h"

struct farm {
	struct farm_config config;
	double now;
	uint64_t next_job;
	struct job **jobs; /* by id; ended ones too */
	uint32_t job_count;
	struct job **live;		 /* by priority, then id */
	uint32_t live_count, live_limit; /* more than config.max_jobs when an earlier life left more */
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

/* update.c: room is made when workers join, so that saying something cannot fail. */
int update_reserve(struct farm *f, size_t more_leases);
struct action *update_add(struct farm *f, enum action_kind kind);
void update_lease(struct farm *f, enum action_kind kind, const struct lease *l);

struct job *farm_find_job(const struct farm *f, uint64_t id);
struct peer *farm_find_peer(const struct farm *f, uint64_t id);

/* rounds.c: what a job goes through. */
void rounds_submit(struct farm *f, const struct event *ev);
void rounds_cancel(struct farm *f, const struct event *ev);
void rounds_started(struct farm *f, struct job *j);		/* a lease of it is about to be sent */
void rounds_enlist(struct farm *f, struct job *j);		/* its id is new */
void rounds_forget(struct farm *f, struct job *j);		/* it has ended */
enum job_end rounds_bound(const struct job *j, double elapsed); /* that is met, the error apart */
void rounds_reject(struct farm *f, const struct event *ev, const char *text);
void rounds_opened(struct farm *f, struct job *j, bool black); /* b and seeds are there */
/* The bounds, when a round is complete: so many seconds after the first lease. */
void rounds_settle(struct farm *f, struct job *j, double elapsed);
void rounds_complete(struct farm *f, struct job *j);
void rounds_prepared(struct farm *f, const struct event *ev);
void rounds_error_known(struct farm *f, const struct event *ev);
void rounds_image_known(struct farm *f, const struct event *ev);
void rounds_end(struct farm *f, struct job *j, enum job_end end, const char *text);

/* orders.c: what people want of jobs that are there. */
enum { PRIORITY_MAX = 100 };
void orders_hold(struct farm *f, const struct event *ev);
void orders_priority(struct farm *f, const struct event *ev);
void orders_extend(struct farm *f, const struct event *ev);
void orders_enlist(struct farm *f, struct job *j); /* among the live ones: by priority, then id */
void orders_delist(struct farm *f, const struct job *j);

/* restore.c */
void restore_job(struct farm *f, const struct event *ev);

/* answer.c: what workers send back. */
void answer_batch(struct farm *f, const struct event *ev);
void answer_stored(struct farm *f, const struct event *ev);
void answer_failed(struct farm *f, const struct event *ev);
void answer_delivered(struct farm *f, const struct event *ev);
void answer_returned(struct farm *f, const struct event *ev);
bool answer_all_failed(const struct farm *f, const struct job *j); /* each worker here, since it last gave something */

/* schedule.c */
void schedule(struct farm *f);
void schedule_expire(struct farm *f, double read); /* silence and overdue leases, by what had come then */

#endif
