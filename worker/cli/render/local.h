/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A plan on this machine, without a farm: the same leases, the same merge, the same bits. Threads are made for each
 * phase; results are merged under one lock.
 */
#ifndef WORKER_CLI_RENDER_LOCAL_H
#define WORKER_CLI_RENDER_LOCAL_H

#include "common/estimate/merge.h"
#include "worker/render/render.h"

struct local_progress {	      /* between leases, from the calling thread's point of view */
	const char *state;    /* bootstrap, running */
	uint64_t done, total; /* leases of this phase's job; total UINT64_MAX: unknown */
	double seconds;
};

struct local_round {		     /* what is known after a complete round */
	uint64_t rounds, mutations;  /* complete; mutations or samples, as plan_round_mutations counts */
	double cpu_seconds, seconds; /* of the rounds, all leases and the wall clock; the bootstrap apart */
	double bootstrap_cpu_seconds, bootstrap_seconds;
	const struct canvas *canvas;	  /* for a canvas_image of one's own */
	const struct canvas_image *image; /* where the plan has the error looked at, else NULL */
};

struct local_run {
	/* in */
	const struct world *world;
	const struct plan *plan;
	unsigned threads;
	const atomic_bool *stop; /* may become true at any time: what is complete stays */
	void (*progress)(void *user, const struct local_progress *p); /* under the lock, from any thread; may be NULL */
	/* After each complete round, from the calling thread while no lease runs; may set *stop: the rounds end there
	 * and `end` stays MERGE_GOES_ON. May be NULL. Its own time is in no sum but the wall clock. */
	void (*round)(void *user, const struct local_round *r);
	/* Before the bootstrap, to add leases of it that an earlier run kept; and after a stop before the first round
	 * was complete, to keep those that are there. From the calling thread; may be NULL. */
	int (*resume)(void *user, struct bootstrap *b, struct error *e);
	void (*keep)(void *user, const struct bootstrap *b);
	void *user;
	/* out */
	struct canvas *canvas; /* NULL: stopped before the bootstrap was complete. canvas_free is the caller's */
	struct bootstrap_result lit;
	enum merge_end end; /* MERGE_GOES_ON: stopped */
	double seconds;	    /* wall clock from the first bootstrap sample to the last merge */
	double cpu_seconds; /* of all leases */
	double bootstrap_cpu_seconds, bootstrap_seconds; /* the bootstrap's share of both */
};

int local_run(struct local_run *r, struct error *e);

/*
 * The same in steps, for jobs that take turns: the bootstrap, then a round each time. The plan's bounds and the
 * callback `round` are left to the caller. The run must outlive the job; canvas_rounds tells whether a round was
 * stopped.
 */
struct local_job;
int local_start(struct local_run *r, struct local_job **j, struct error *e);
int local_step(struct local_job *j, struct error *e); /* nothing where the scene is black or stop is set */
void local_end(struct local_job *j);		      /* run->canvas stays the caller's */

#endif
