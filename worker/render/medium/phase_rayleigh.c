/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Rayleigh's phase function, p(c) = 3 (1 + c^2) / 16 pi. Its distribution function (c^3 + 3 c + 4) / 8 = u is a cubic
 * equation with one real root, c = 2 sinh(asinh(4u - 2) / 3).
 */
#include "worker/render/medium/phase.h"

#include <math.h>

static double eval(const struct phase *p, vec3 position, double cosine)
{
	(void)p, (void)position;
	return 3 / (16 * M_PI) * (1 + cosine * cosine);
}

static double sample(const struct phase *p, vec3 position, double u)
{
	(void)p, (void)position;
	return 2 * sinh(asinh(4 * u - 2) / 3);
}

const struct phase_ops phase_ops_rayleigh = {
	.decl = {PLUGIN_PHASE, "rayleigh", NULL, 0, PARAM_UNDERSTOOD},
	.eval = eval,
	.sample = sample,
};
