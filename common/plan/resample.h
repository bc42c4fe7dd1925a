/* SPDX-License-Identifier: Apache-2.0 */
/* Draws the bootstrap samples from which chains start, in proportion to their weights. Pure; any thread. */
#ifndef COMMON_PLAN_RESAMPLE_H
#define COMMON_PLAN_RESAMPLE_H

#include "common/plan/plan.h"

/* Draws `count` bootstrap indices of a group by systematic resampling over its weights in index order (docs/design.md,
 * rules 2). weight: of the group's bootstrap samples, finite and >= 0; u: a random number in [0,1). Returns false if
 * all weights are 0. */
bool plan_resample(const struct plan *p, uint32_t group, const float *weight, uint64_t weight_count, double u,
		   uint32_t count, uint64_t *index);
/* Returns u for plan_resample, a function of the plan's seed and the group. */
double plan_resample_offset(const struct plan *p, uint32_t group);

#endif
