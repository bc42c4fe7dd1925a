/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the pilots, which examine a scene before its plan is made, have in common: their film, the effects of their
 * scene, and their random numbers, which no render draws. Pure; any thread.
 */
#ifndef WORKER_RENDER_PILOT_PLAN_H
#define WORKER_RENDER_PILOT_PLAN_H

#include "common/plan/plan.h"
#include "worker/render/render.h"

/* Steps of RNG_CHOICE, one for each use. */
enum pilot_step {
	PILOT_MAP,
	PILOT_PATH,
	PILOT_BDPT,
	PILOT_PIXEL,
	PILOT_COMPARED,
	PILOT_MERGING, /* also uses the next number */
	PILOT_UNSEEN_MAP = PILOT_MERGING + 2,
	PILOT_UNSEEN, /* also uses the next three numbers */
};

/* Samples of a pilot for a render that is not short. Fewer samples estimate the tail worse: tests/bench/choices.md,
 * "What the pilot chooses". */
enum { PILOT_SAMPLES = 1 << 14 };

/* Returns a fraction of the render's samples, rounded to the nearest power of two, so that nearly equal renders have
 * equal pilots. For a render that is limited by time, an assumed speed stands in for a measurement, so that a pilot is
 * the same everywhere. PILOT_SAMPLES if only an error is asked for. pixels: those of the film. */
uint64_t pilot_samples(const struct plan_request *r, uint64_t pixels);

/* Makes a plan with the film and the random numbers of the render, checked like the render's own; then
 * extends it to the whole film, so that a crop has the same pilot as the whole, and the same pixels. Returns
 * -EINVAL and an error message. */
int pilot_make_plan(const struct plan_request *r, struct plan *p, struct error *e);

/* Whether the scene itself has the effect, regardless of what the user forces. */
bool pilot_scene_has(const struct render_summary *s, const char *effect);

#endif
