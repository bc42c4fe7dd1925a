/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The contents of --stats FILE, as JSON: plan, reasons for its integrator, times, counters, strategies, effects, parts
 * that samples and chains have, the bound that ended the render. One thread.
 */
#ifndef WORKER_CLI_RENDER_STATS_H
#define WORKER_CLI_RENDER_STATS_H

#include "common/estimate/convergence.h"
#include "common/estimate/forecast.h"
#include "common/plan/plan_text.h"
#include "worker/cli/render/choice.h"
#include "worker/cli/render/local.h"

struct stats {
	const char *scene; /* file name */
	const struct plan_scene *inputs;
	const struct render_summary *summary;
	const struct local_run *run; /* has ended */
	const struct canvas_image *image;
	const struct convergence *convergence; /* of the image */
	double build_seconds;		       /* of the world */
	const struct forecast_history *looks;
	const struct choice *choice; /* of the integrator */
};

/* The share of all rays that chains took which spread the light of samples. */
double stats_chains_rays(const struct canvas_image *i);

int stats_write(const char *path, const struct stats *s, struct error *e);

#endif
