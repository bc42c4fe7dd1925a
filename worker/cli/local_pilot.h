/* A pilot on this machine (pilot.h): a probe, then a short render whose looks are kept. Threads as local.h. */
#ifndef WORKER_CLI_LOCAL_PILOT_H
#define WORKER_CLI_LOCAL_PILOT_H

#include "common/film/forecast.h"
#include "worker/cli/local.h"

struct local_pilot {
	/* in */
	const struct world *world;
	const struct plan_request *request; /* of the render, complete */
	double seconds;
	unsigned threads;
	const atomic_bool *stop;
	void (*progress)(void *user, const struct local_progress *p); /* may be NULL */
	void *user;
	/* out */
	struct plan render, plan; /* the one spoken of, the pilot's */
	struct forecast_history looks;
	double cpu_seconds, wall_seconds, bootstrap_cpu, bootstrap_seconds;
};

/* -EINTR: stopped before there was a look. */
int local_pilot(struct local_pilot *p, struct error *e);

#endif
