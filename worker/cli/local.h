/*
 * A plan on this machine, without a farm: the same leases, the same merge, the same bits. Threads are made for each phase;
 * results are merged under one lock.
 */
#ifndef WORKER_CLI_LOCAL_H
#define WORKER_CLI_LOCAL_H

#include "common/film/merge.h"
#include "worker/render/render.h"

struct local_progress { /* between leases, from the calling thread's point of view */
	const char *state; /* bootstrap, running */
	uint64_t done, total; /* leases of this phase's job; total UINT64_MAX: unknown */
	double seconds;
};

struct local_run {
	/* in */
	const struct world *world;
	const struct plan *plan;
	unsigned threads;
	const atomic_bool *stop; /* may become true at any time: what is complete stays */
	void (*progress)(void *user, const struct local_progress *p); /* under the lock, from any thread; may be NULL */
	void *user;
	/* out */
	struct canvas *canvas; /* NULL: stopped before the bootstrap was complete. canvas_free is the caller's */
	struct bootstrap_result lit;
	enum merge_end end; /* MERGE_GOES_ON: stopped */
	double seconds;     /* wall clock from the first bootstrap sample to the last merge */
	double cpu_seconds; /* of all leases */
};

int local_run(struct local_run *r, struct error *e);

#endif
