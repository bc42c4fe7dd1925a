/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Writes --stats FILE, as JSON: the plan, the reasons for its integrator, times, counters, strategies, effects, the
 * shares of samples and chains, and the bound that ended the render. One thread.
 */
#ifndef WORKER_CLI_RENDER_STATS_H
#define WORKER_CLI_RENDER_STATS_H

#include "common/estimate/convergence.h"
#include "common/estimate/forecast.h"
#include "common/plan/plan_text.h"
#include "worker/cli/render/choice.h"
#include "worker/cli/render/local_run.h"

struct stats {
	const char *scene; /* name of its file */
	const struct plan_scene *inputs;
	const struct render_summary *summary;
	const struct local_run *run; /* has ended */
	const struct canvas_image *image;
	const struct convergence *convergence; /* of the image */
	double build_seconds;		       /* of the world */
	const struct forecast_history *looks;  /* estimates of the error during the render */
	const struct choice *choice;	       /* of the integrator */
};

/* Returns the share of all rays that was taken by chains, which spread light that is too bright for samples. */
double stats_chains_rays(const struct canvas_image *i);

int stats_write(const char *path, const struct stats *s, struct error *e);

#endif
