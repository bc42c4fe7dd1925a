/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The mean of several phase functions, by weights that add up to 1: fixed ones, or of two parts those of a grid. Which
 * part a direction is drawn from is not kept: its density is the mean's. Immutable after creation; any thread.
 */
#ifndef WORKER_RENDER_MEDIUM_PHASE_PARTS_H
#define WORKER_RENDER_MEDIUM_PHASE_PARTS_H

#include "worker/render/medium/phase.h"

enum { PHASE_PARTS_MAX = 16 };

struct phase_parts {
	uint32_t count;
	struct phase part[PHASE_PARTS_MAX];
	double weight[PHASE_PARTS_MAX];
	const struct grid *second; /* of two parts, the weight of the second; NULL: they are fixed */
};

/* Of the phase functions inside n, without weights; p->data. -EINVAL: none. -ERANGE: more than PHASE_PARTS_MAX.
 * -ENOTSUP: one of them absorbs. */
int phase_parts_create(struct phase *p, struct phase_parts **parts, const struct scene_node *n,
		       const struct volume_build *build, struct error *e);

double phase_parts_eval(const struct phase *p, vec3 at, double cosine);
double phase_parts_sample(const struct phase *p, vec3 at, double u);

#endif
