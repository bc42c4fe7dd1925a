/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/known_radiance.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>

void known_round(struct agree_image *image, double expected, double tolerance)
{
	for (uint32_t g = 0; g < image->groups; g++)
		for (int c = 0; c <= AGREE_CELLS; c++)
			if (fabs(image->mean[g][c] / expected - 1) < tolerance)
				image->mean[g][c] = expected;
}

void known_depths(const char *name, struct world *w, uint32_t least, double radiance, struct known_effort e)
{
	static struct agree_image image;
	const struct {
		const char *integrator;
		uint64_t spp;
	} runs[] = {{"path", e.path}, {"bdpt", e.bdpt}, {"pssmlt", e.pssmlt}};
	const double expected = radiance * (w->grey_xyz[0] + w->grey_xyz[1] + w->grey_xyz[2]);
	assert_false(w->effects.colour);
	for (size_t i = 0; i < 3; i++) {
		if (!runs[i].spp)
			continue;
		char test[64];
		snprintf(test, sizeof test, "%s, %s", name, runs[i].integrator);
		struct agree_side side = {runs[i].integrator, runs[i].spp, 32, least, 0};
		agree_render(w, test, runs[i].integrator, &side, &image);
		known_round(&image, expected, 1e-5);
		agree_expect(test, &image, expected);
	}
	world_free(w);
}

void known_constant(const char *name, struct world *w, double radiance, struct known_effort e)
{
	known_depths(name, w, 0, radiance, e);
}
