/* SPDX-License-Identifier: Apache-2.0 */
/* Checks integrators on scenes whose whole film has one known radiance. Statistics as in agreement.h. */
#ifndef TESTS_SUPPORT_KNOWN_RADIANCE_H
#define TESTS_SUPPORT_KNOWN_RADIANCE_H

#include "tests/support/agreement.h"

/* Samples per pixel, the least that resolve half a percent of the mean; 0: the integrator is not run on this scene. */
struct known_radiance_spp {
	uint64_t path, bdpt, pssmlt;
};

/* Sets values within the tolerance to `expected`. If every sample is the same, the groups differ only by the
 * rounding of tiles to float and the little light that a tiny roughness loses, on which statistics make no sense. */
void known_radiance_round(struct agreement_image *image, double expected, double tolerance);

/* Each checks that every cell of the image of a grey scene has that radiance, by paths of `min_edges` edges or more, or
 * by all paths. Each takes over the world, and fails the test otherwise. */
void known_radiance_check_edges(const char *name, struct world *w, uint32_t min_edges, double radiance,
				struct known_radiance_spp samples);
void known_radiance_check(const char *name, struct world *w, double radiance, struct known_radiance_spp samples);

#endif
