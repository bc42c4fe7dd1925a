/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The weighted mean of several phase functions. The weights add up to 1: fixed ones, or for two parts those of a grid.
 * The density of a sampled direction is that of the mean, whichever part it was drawn from. Immutable after creation;
 * any thread.
 */
#ifndef WORKER_RENDER_MEDIUM_PHASE_PARTS_H
#define WORKER_RENDER_MEDIUM_PHASE_PARTS_H

#include "worker/render/medium/phase.h"

enum { PHASE_PARTS_MAX = 16 };

struct phase_parts {
	uint32_t count;
	struct phase part[PHASE_PARTS_MAX];
	double weight[PHASE_PARTS_MAX];
	const struct grid *second_weight; /* for two parts, the weight of the second; NULL: `weight` holds everywhere */
};

/* Creates the parts from the phase functions nested in n, without weights, and sets p->data to them. Returns 0, or
 * -EINVAL if there are none, -ERANGE if there are more than PHASE_PARTS_MAX, -ENOTSUP if one of them absorbs or is that
 * of microflakes, or another negative error code. */
int phase_parts_create(struct phase *p, struct phase_parts **parts, const struct scene_node *n,
		       const struct volume_build *build, struct error *e);

double phase_parts_eval(const struct phase *p, vec3 position, double cosine);
double phase_parts_sample(const struct phase *p, vec3 position, double u);

#endif
