/* SPDX-License-Identifier: Apache-2.0 */
/* The seeds of chains: bootstrap samples, drawn in proportion to their weights. Pure; any thread. */
#ifndef COMMON_PLAN_RESAMPLE_H
#define COMMON_PLAN_RESAMPLE_H

#include "common/plan/plan.h"

/* Systematic resampling of a group's seeds over its bootstrap weights, in index order (docs/design.md, rules 2).
 * weight[i] >= 0 and finite, i in the group's range; writes `count` bootstrap indices. false: all weights are 0. */
bool plan_resample(const struct plan *p, uint32_t group, const float *weight, uint64_t weight_count, double u,
		   uint32_t count, uint64_t *index);
/* The u above: a function of seed and group. */
double plan_resample_u(const struct plan *p, uint32_t group);

#endif
