/* SPDX-License-Identifier: Apache-2.0 */
/* Numerically difficult scenes, on which tests/numerics/test_agree.c compares integrators. */
#ifndef TESTS_SUPPORT_AGREEMENT_SCENES_H
#define TESTS_SUPPORT_AGREEMENT_SCENES_H

#include "worker/render/world/world.h"

struct agreement_case {
	const char *topic, *name;
	struct world *(*build)(const struct agreement_case *k); /* the caller frees it */
	double a, b;						/* arguments of build */
	uint32_t max_depth;
	uint64_t path_spp, spp; /* samples per pixel: of `path`, of the other integrators */
	const char *integrators[4];
	double detectable_bias; /* smallest bias of the mean that the table must find */
};

/* Ends with a NULL topic. */
extern const struct agreement_case agreement_cases[];

#endif
