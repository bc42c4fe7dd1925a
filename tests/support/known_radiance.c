/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/known_radiance.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>

void known_radiance_round(struct agreement_image *image, double expected, double tolerance)
{
	for (uint32_t g = 0; g < image->groups; g++)
		for (int c = 0; c <= AGREEMENT_CELLS; c++)
			if (fabs(image->mean[g][c] / expected - 1) < tolerance)
				image->mean[g][c] = expected;
}

void known_radiance_check_edges(const char *name, struct world *w, uint32_t min_edges, double radiance,
				struct known_radiance_spp samples)
{
	static struct agreement_image image;
	const struct {
		const char *integrator;
		uint64_t spp;
	} runs[] = {{"path", samples.path}, {"bdpt", samples.bdpt}, {"pssmlt", samples.pssmlt}};
	const double expected = radiance * (w->grey_xyz[0] + w->grey_xyz[1] + w->grey_xyz[2]);
	assert_false(w->effects.colour);
	for (size_t i = 0; i < 3; i++) {
		if (!runs[i].spp)
			continue;
		char test[64];
		snprintf(test, sizeof test, "%s, %s", name, runs[i].integrator);
		struct agreement_options side = {runs[i].integrator, runs[i].spp, 32, min_edges, 0};
		agreement_render(w, test, runs[i].integrator, &side, &image);
		known_radiance_round(&image, expected, 1e-5);
		agreement_check_constant(test, &image, expected);
	}
	world_free(w);
}

void known_radiance_check(const char *name, struct world *w, double radiance, struct known_radiance_spp samples)
{
	known_radiance_check_edges(name, w, 0, radiance, samples);
}
