/* SPDX-License-Identifier: Apache-2.0 */
/* Runs a pilot on this machine (pilot_request.h): a probe, then a short render whose estimates of the error are kept.
 * Threads as in local_run.h. */
#ifndef WORKER_CLI_RENDER_LOCAL_PILOT_H
#define WORKER_CLI_RENDER_LOCAL_PILOT_H

#include "common/estimate/forecast.h"
#include "worker/cli/render/local_run.h"

struct local_pilot {
	/* Set by the caller. */
	const struct world *world;
	const struct plan_request *request; /* the render to be predicted; complete */
	double seconds;			    /* length of the pilot */
	unsigned threads;
	atomic_bool *stop; /* may become true at any time; the pilot sets it when it has enough estimates */
	void (*on_progress)(void *user, const struct local_progress *p); /* may be NULL */
	void *user;
	/* Set by local_pilot. */
	struct plan render, plan;			 /* the plans of the render being predicted, and of the pilot */
	struct forecast_history looks;			 /* estimates of the pilot's error */
	bool is_timed;					 /* the probe is over, and the pilot itself has started */
	bool has_ended;					 /* the pilot has ended itself by *stop */
	double cpu_seconds, wall_seconds;		 /* of the pilot, its bootstrap included */
	double bootstrap_cpu_seconds, bootstrap_seconds; /* CPU and wall-clock time of its bootstrap */
};

/* Runs probe and pilot. Returns -EINTR if *stop was set before the bootstrap of either was complete. */
int local_pilot(struct local_pilot *p, struct error *e);

#endif
