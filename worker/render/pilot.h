/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the pilots have in common that look at a scene before its plan is made: their film, what its scene has, and
 * their random numbers, which no render draws. Pure; any thread.
 */
#ifndef WORKER_RENDER_PILOT_H
#define WORKER_RENDER_PILOT_H

#include "common/plan/plan.h"
#include "worker/render/render.h"

/* Steps of RNG_CHOICE, one for each use of it. */
enum pilot_step {
	PILOT_MAP,
	PILOT_PATH,
	PILOT_BDPT,
	PILOT_PIXEL,
	PILOT_BESIDE,
	PILOT_MERGED, /* uses the next number, too */
	PILOT_UNSEEN_MAP = PILOT_MERGED + 2,
	PILOT_UNSEEN, /* uses the next three, too */
};

/* Samples for a render that is not short. Fewer estimate the tail worse: tests/bench/choices.md, "What the pilot
 * chooses". */
enum { PILOT_SAMPLES = 1 << 14 };

/* A share of the render's samples, rounded to the nearest power of two, so that nearly equal renders have equal pilots.
 * Of a render that is given in time, what that would make on a usual machine, never a measurement: a pilot is the same
 * everywhere. PILOT_SAMPLES where only an error is asked for. pixels: of the film. */
uint64_t pilot_samples(const struct plan_request *r, uint64_t pixels);

/* The film and the random numbers of the render, checked as it will be; then all of the film, so that a crop has the
 * pilots of the whole, and its pixels. -EINVAL with a sentence */
int pilot_film(const struct plan_request *r, struct plan *p, struct error *e);

/* Whether it has the effect, whatever the user forces. */
bool pilot_scene_has(const struct render_summary *s, const char *effect);

#endif
