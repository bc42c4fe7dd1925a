/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The parts among which emitter_choice.h chooses: emitters, and parts of the environment, of which different places see
 * different ones (through a window, above a floor). The unit square from which points of the environment are drawn is
 * divided evenly, so its parts are equally bright, or equally large for a constant environment. Parts 0 to
 * emitter_count - 1 are whole emitters; those of a divided environment follow. Pure.
 */
#ifndef WORKER_RENDER_WORLD_EMITTER_PART_H
#define WORKER_RENDER_WORLD_EMITTER_PART_H

#include "worker/render/world/world.h"

enum { ENVIRONMENT_SIDE = 8, ENVIRONMENT_PARTS = ENVIRONMENT_SIDE * ENVIRONMENT_SIDE };

/* Whether an emitter is divided into parts. For that, the point in the unit square must follow from the emitter's
 * point, which requires that points are drawn in the same way wherever they are seen from. */
static inline bool emitter_is_divided(const struct world *w, int32_t emitter)
{
	return emitter == w->environment && !w->emitters[emitter].ops->sample_toward &&
	       w->emitters[emitter].ops->point_inverse && w->emitters[emitter].power > 0;
}

static inline uint32_t emitter_part_count(const struct world *w)
{
	bool divided = w->environment >= 0 && emitter_is_divided(w, w->environment);
	return w->emitter_count + (divided ? ENVIRONMENT_PARTS : 0);
}

static inline int32_t emitter_of_part(const struct world *w, uint32_t part)
{
	return part < w->emitter_count ? (int32_t)part : w->environment;
}

/* Whether a part emits. A divided emitter is not a part itself. An emitter that was switched off
 * (effects_apply.h) has power 0. */
static inline bool emitter_part_emits(const struct world *w, uint32_t part)
{
	return w->emitters[emitter_of_part(w, part)].power > 0 &&
	       (part >= w->emitter_count || !emitter_is_divided(w, (int32_t)part));
}

/* Returns the density of points of a part, given that it was chosen, divided by their density on the whole emitter. */
static inline double emitter_part_density_ratio(const struct world *w, uint32_t part)
{
	return part < w->emitter_count ? 1 : ENVIRONMENT_PARTS;
}

/* Converts two numbers in [0,1) to those from which the emitter draws a point of the part. */
static inline void emitter_part_remap(const struct world *w, uint32_t part, const double u[2], double out[2])
{
	uint32_t k = part - w->emitter_count;
	bool is_whole_emitter = part < w->emitter_count;
	out[0] = is_whole_emitter ? u[0] : (k % ENVIRONMENT_SIDE + u[0]) / ENVIRONMENT_SIDE;
	out[1] = is_whole_emitter ? u[1] : (k / ENVIRONMENT_SIDE + u[1]) / ENVIRONMENT_SIDE;
}

/* Returns the part that contains a point of em, which is that emitter at some time. */
static inline uint32_t emitter_part_of(const struct world *w, int32_t emitter, const struct emitter *em,
				       const struct emitter_point *y)
{
	double u[2];
	if (!emitter_is_divided(w, emitter))
		return (uint32_t)emitter;
	em->ops->point_inverse(em, y, u);
	return w->emitter_count + (uint32_t)(u[1] * ENVIRONMENT_SIDE) * ENVIRONMENT_SIDE +
	       (uint32_t)(u[0] * ENVIRONMENT_SIDE);
}

#endif
