/* SPDX-License-Identifier: Apache-2.0 */
/* Scenes of which all of the film has one known radiance, by the integrators. Statistics as in agree.h. */
#ifndef TESTS_SUPPORT_KNOWN_RADIANCE_H
#define TESTS_SUPPORT_KNOWN_RADIANCE_H

#include "tests/support/agree.h"

/* Samples per pixel, the least that tell half a percent of the mean; 0: not run on this scene. */
struct known_effort {
	uint64_t path, bdpt, pssmlt;
};

/* Where every sample is the same the groups are, too, but for the rounding of tiles to float and what a hair of
 * roughness loses: no statistics of that. */
void known_round(struct agree_image *image, double expected, double tolerance);

/* Each cell of the image has that radiance in a grey scene, by paths of `least` edges or more, or by all. Both take the
 * world, and fail the test otherwise. */
void known_depths(const char *name, struct world *w, uint32_t least, double radiance, struct known_effort e);
void known_constant(const char *name, struct world *w, double radiance, struct known_effort e);

#endif
