/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Runs a plan on this machine, without a farm, with the same leases, the same merging and the same bits as a farm. It
 * creates its threads for each phase (the bootstrap, and each round) and merges their results under one lock. Call it
 * from one thread.
 */
#ifndef WORKER_CLI_RENDER_LOCAL_RUN_H
#define WORKER_CLI_RENDER_LOCAL_RUN_H

#include "common/estimate/merge.h"
#include "worker/render/render.h"

/* The progress after a lease. */
struct local_progress {
	const char *state;		    /* bootstrap, running */
	uint64_t leases_done, leases_total; /* leases of the whole job; total UINT64_MAX: not known */
	double seconds;			    /* wall-clock time since the first bootstrap sample */
	double rounds, round_seconds; /* rounds done, with a fraction, and the time for them; 0: still the bootstrap */
	double rounds_remaining; /* rounds up to the plan's bound on them, with a fraction; INFINITY: it has none */
};

/* The state after a complete round. */
struct local_round {
	uint64_t rounds;	     /* number of complete rounds */
	double cpu_seconds, seconds; /* CPU time of leases and wall-clock time, of the rounds without the bootstrap */
	double bootstrap_seconds;    /* wall-clock time of the bootstrap */
	const struct canvas *canvas; /* for making a canvas_image */
	const struct canvas_image *image; /* if the error is due to be estimated, otherwise NULL */
};

struct local_run {
	/* Set by the caller. */
	const struct world *world;
	const struct plan *plan;
	unsigned threads;
	const atomic_bool *stop; /* may become true at any time; complete rounds are kept */
	/* Under the lock, from any thread; may be NULL. */
	void (*on_progress)(void *user, const struct local_progress *p);
	/* Called after each complete round, from the calling thread while no lease runs. May set *stop: then the rounds
	 * end, and `end` stays MERGE_CONTINUES. Its CPU time is not counted. May be NULL. */
	void (*on_round)(void *user, const struct local_round *r);
	/* load_bootstrap is called before the bootstrap, to add leases that an earlier run kept; save_bootstrap after a
	 * stop before the first round was complete, to keep the finished leases. From the calling thread; may be NULL.
	 */
	int (*load_bootstrap)(void *user, struct bootstrap *b, struct error *e);
	void (*save_bootstrap)(void *user, const struct bootstrap *b);
	void *user;
	/* Set by the run. */
	struct canvas *canvas; /* freed with canvas_free; NULL: stopped before the bootstrap was complete, or failed */
	struct bootstrap_result bootstrap_result;
	enum merge_end end; /* MERGE_CONTINUES: stopped */
	double seconds;	    /* wall-clock time from the first bootstrap sample to the last merge */
	double cpu_seconds; /* CPU time of all leases */
	double bootstrap_cpu_seconds, bootstrap_seconds; /* the part of the bootstrap in both */
};

/* Runs the plan until one of its bounds, or *stop, ends it. */
int local_run(struct local_run *r, struct error *e);

/*
 * The same in steps, for jobs that alternate: local_start runs the bootstrap, local_step one round. The plan's bounds
 * and the callback `on_round` are ignored; the caller decides when to end. canvas_complete_rounds tells whether a round
 * was completed or stopped. The run must outlive the job.
 */
struct local_job;
int local_start(struct local_run *r, struct local_job **out, struct error *e);
int local_step(struct local_job *j, struct error *e); /* does nothing if the scene is black or *stop is set */
void local_end(struct local_job *j);		      /* frees the job; run->canvas remains the caller's */

#endif
