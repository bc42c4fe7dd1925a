/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes the plan of a pilot: a short render like the one that it predicts, but with an epoch short enough that its
 * error is estimated often. The cost of an epoch is measured before by a probe, which is one short round. Pure; any
 * thread.
 */
#ifndef WORKER_CLI_RENDER_PILOT_REQUEST_H
#define WORKER_CLI_RENDER_PILOT_REQUEST_H

#include "common/plan/plan.h"

enum {
	PILOT_SECONDS = 60,	/* default length */
	PILOT_ROUNDS = 16,	/* the goal, which gives about a dozen estimates */
	PILOT_LOOKS_WANTED = 4, /* with fewer estimates, a pilot takes up to four times its length */
	PILOT_LOOKS_MIN = 2,	/* with fewer, it goes on, whatever the time, until it has PILOT_ROUNDS_MAX rounds */
	PILOT_ROUNDS_MAX = 64,	/* see PILOT_LOOKS_MIN */
};

struct render_arguments;
struct render_summary;

/* Like render_plan_from_scene, but ignores the scene's sampleCount, because predictions are about errors. */
int pilot_plan_from_scene(struct render_arguments *a, const struct render_summary *summary, struct error *e);

/* Makes the plan of the render to be predicted. request: complete; if it has no target error, the plan gets one, so
 * that it is bounded. */
int pilot_render_plan(const struct plan_request *request, struct plan *render, struct error *e);

/* Wall-clock seconds of a probe. */
struct pilot_cost {
	double bootstrap_seconds, round_seconds;
};

/* Makes the request of the probe. Returns false if no probe is needed, because even an epoch of one sample, the
 * shortest, is as long as a pilot's should be. */
bool pilot_probe_request(const struct plan_request *request, const struct plan *render, struct plan_request *probe);
/* Makes the request of the pilot. cost: of the probe; NULL: there was none. */
void pilot_request(const struct plan_request *request, const struct plan *render, const struct plan_request *probe,
		   const struct pilot_cost *cost, double seconds, struct plan_request *pilot);

#endif
