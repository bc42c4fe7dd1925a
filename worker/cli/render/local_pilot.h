/* SPDX-License-Identifier: Apache-2.0 */
/* A pilot on this machine (pilot.h): a probe, then a short render whose error estimates are kept. Threads as in
 * local.h. */
#ifndef WORKER_CLI_RENDER_LOCAL_PILOT_H
#define WORKER_CLI_RENDER_LOCAL_PILOT_H

#include "common/estimate/forecast.h"
#include "worker/cli/render/local.h"

struct local_pilot {
	/* in */
	const struct world *world;
	const struct plan_request *request; /* of the render, complete */
	double seconds;
	unsigned threads;
	atomic_bool *stop; /* may become true at any time; the pilot sets it when it has seen enough */
	void (*progress)(void *user, const struct local_progress *p); /* may be NULL */
	void *user;
	/* out */
	struct plan render, plan; /* of the render being predicted; of the pilot */
	struct forecast_history looks;
	bool timed, over; /* set by the callbacks: the pilot itself has started; it has seen enough */
	double cpu_seconds, wall_seconds, bootstrap_cpu, bootstrap_seconds;
};

/* -EINTR: stopped before there was an estimate. */
int local_pilot(struct local_pilot *p, struct error *e);

#endif
