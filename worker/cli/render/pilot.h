/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The plan of a pilot: a short render like the one to come, except for the length of an epoch, so that its error is
 * estimated often enough. The cost of an epoch is measured by a probe, one short round. Pure; any thread.
 */
#ifndef WORKER_CLI_RENDER_PILOT_H
#define WORKER_CLI_RENDER_PILOT_H

#include "common/plan/plan.h"

enum {
	PILOT_SECONDS = 60,
	PILOT_ROUNDS = 16,	/* the goal: a dozen estimates */
	PILOT_LOOKS = 4,	/* worth up to four times the time */
	PILOT_LOOKS_LEAST = 2,	/* worth any time, up to ... */
	PILOT_ROUNDS_MOST = 64, /* ... so many rounds */
};

struct render_arguments;
struct render_summary;

/* render_plan_from_scene without the scene's sampleCount: predictions are about errors. */
int pilot_plan_from_scene(struct render_arguments *a, const struct render_summary *summary, struct error *e);

/* request: of the render, complete; if it has no target error, the plan gets one, so that it ends. */
int pilot_render_plan(const struct plan_request *request, struct plan *render, struct error *e);

struct pilot_cost { /* wall seconds of a probe */
	double bootstrap, rounds;
};

/* false: not needed, because an epoch cannot be shorter than one sample and that is as long as a pilot's. */
bool pilot_probe(const struct plan_request *request, const struct plan *render, struct plan_request *probe);
/* cost: measured by the probe, NULL: there was none. */
void pilot_request(const struct plan_request *request, const struct plan *render, const struct plan_request *probe,
		   const struct pilot_cost *cost, double seconds, struct plan_request *pilot);

#endif
