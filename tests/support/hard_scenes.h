/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numerically difficult scenes: each topic is a function of one parameter. In a room of side 4 or on a plate under a
 * lamp, with 32 x 32 pixels. The caller frees the world.
 */
#ifndef TESTS_SUPPORT_HARD_SCENES_H
#define TESTS_SUPPORT_HARD_SCENES_H

#include "worker/render/world/world.h"

struct hard_case {
	const char *topic, *name;
	struct world *(*build)(double parameter);
	double parameter;
	unsigned min_edges, max_edges;
	const char *mutation; /* the mutation to test alone */
};

/* Ends with a NULL topic. */
extern const struct hard_case hard_cases[];

#endif
