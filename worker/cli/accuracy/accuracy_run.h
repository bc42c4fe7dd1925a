/* SPDX-License-Identifier: Apache-2.0 */
/* Renders all settings alternately, so that times can be compared. One thread, besides those that run leases. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_RUN_H
#define WORKER_CLI_ACCURACY_ACCURACY_RUN_H

#include "worker/cli/accuracy/accuracy_design.h"
#include "worker/cli/render/local_run.h"

enum { ACCURACY_COSTS_MAX = 4096 }; /* rounds of a setting whose cost is kept, at most */

/* One setting's rendering. */
struct accuracy_job {
	struct plan plan;
	struct world *world; /* one of accuracy_run.worlds, which settings share if possible */
	struct local_run run;
	struct local_job *job;
	size_t cost_count;
	double costs[ACCURACY_COSTS_MAX]; /* CPU seconds per mutation, of each round */
	double cpu_seconds;		  /* of all rounds */
};

struct accuracy_run {
	/* Set by the caller. */
	const struct accuracy_design *design;
	struct plan_request request; /* the values that all settings have in common */
	const struct scene *scene;
	const struct asset_source *assets;
	const struct render_options *options;
	unsigned threads;
	double seconds;		 /* total wall-clock time */
	double setting_seconds;	 /* CPU seconds per setting; 0: by wall-clock time */
	uint64_t setting_rounds; /* rounds per setting, so that everything but times is reproducible; 0: by time */
	const atomic_bool *stop;
	void (*on_progress)(void *user, double fraction, const char *state);
	void *user;
	/* Set by accuracy_render. */
	struct accuracy_job *jobs; /* [design->count] */
	size_t world_count;
	struct world *worlds[ACCURACY_SETTINGS_MAX];
	double wall_seconds;
	bool was_interrupted; /* *stop was set */
};

/* Renders all settings. An interruption is a failure (-EINTR) only if some setting has no complete round; otherwise
 * what was rendered can be judged. Call accuracy_run_fini after a failure, too. */
int accuracy_render(struct accuracy_run *r, struct error *e);
void accuracy_run_fini(struct accuracy_run *r);

#endif
