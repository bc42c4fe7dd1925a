/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Runs a plan on this machine, without a farm: the same leases, the same merging, the same bits. Threads are created
 * for each phase; results are merged under one lock.
 */
#ifndef WORKER_CLI_RENDER_LOCAL_H
#define WORKER_CLI_RENDER_LOCAL_H

#include "common/estimate/merge.h"
#include "worker/render/render.h"

struct local_progress {	      /* between leases, from the calling thread's point of view */
	const char *state;    /* bootstrap, running */
	uint64_t done, total; /* leases of the current phase; total UINT64_MAX: not known */
	double seconds;
	double rounds, round_seconds; /* done, parts of one included, and the time they took; 0: still the bootstrap */
};

struct local_round {		     /* State after a complete round. */
	uint64_t rounds;	     /* complete ones */
	double cpu_seconds, seconds; /* of the rounds, CPU time of leases and wall-clock time; without the bootstrap */
	double bootstrap_seconds;
	const struct canvas *canvas;	  /* for making a canvas_image */
	const struct canvas_image *image; /* if the error is due to be estimated, otherwise NULL */
};

struct local_run {
	/* in */
	const struct world *world;
	const struct plan *plan;
	unsigned threads;
	const atomic_bool *stop; /* may become true at any time: complete rounds are kept */
	void (*progress)(void *user, const struct local_progress *p); /* under the lock, from any thread; may be NULL */
	/* Called after each complete round, from the calling thread while no lease runs; may set *stop: then the
	 * rounds end, and `end` stays MERGE_GOES_ON. May be NULL. Its own time counts only as wall-clock time. */
	void (*round)(void *user, const struct local_round *r);
	/* Called before the bootstrap, to add leases that an earlier run kept; and after a stop before the first
	 * round was complete, to keep the finished ones. From the calling thread; may be NULL. */
	int (*resume)(void *user, struct bootstrap *b, struct error *e);
	void (*keep)(void *user, const struct bootstrap *b);
	void *user;
	/* out */
	struct canvas *canvas; /* NULL: stopped before the bootstrap was complete. Free it with canvas_free */
	struct bootstrap_result lit;
	enum merge_end end; /* MERGE_GOES_ON: stopped */
	double seconds;	    /* wall-clock time from the first bootstrap sample to the last merge */
	double cpu_seconds; /* of all leases */
	double bootstrap_cpu_seconds, bootstrap_seconds; /* the bootstrap's share of both */
};

int local_run(struct local_run *r, struct error *e);

/*
 * The same in steps, for jobs that alternate: the bootstrap, then one round per call. The caller handles the plan's
 * bounds and the callback `round`. The run must outlive the job; canvas_rounds tells whether a round was stopped.
 */
struct local_job;
int local_start(struct local_run *r, struct local_job **j, struct error *e);
int local_step(struct local_job *j, struct error *e); /* does nothing if the scene is black or stop is set */
void local_end(struct local_job *j);		      /* run->canvas remains the caller's */

#endif
