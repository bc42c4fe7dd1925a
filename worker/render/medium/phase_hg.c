/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Henyey and Greenstein 1941: p(c) = (1 - g^2) / (4 pi (1 + g^2 - 2 g c)^(3/2)), whose mean cosine is g. Its
 * distribution function is inverted by c = (1 + g^2 - ((1 - g^2) / (1 + g s))^2) / 2g with s = 2u - 1; written as a
 * quotient of polynomials, the factor g of the numerator cancels, and no digits are lost if g is small.
 */
#include "worker/render/medium/phase.h"

#include <math.h>

static int create(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	(void)build, (void)e;
	p->g = node_float(n, "g", 0.8);
	return 0;
}

static double eval(const struct phase *p, vec3 position, double cosine)
{
	(void)position;
	double g = p->g, square = (1 - g) * (1 - g) + 2 * g * (1 - cosine); /* 1 + g^2 - 2 g c */
	return (1 - g) * (1 + g) / (4 * M_PI * square * sqrt(square));
}

static double sample(const struct phase *p, vec3 position, double u)
{
	(void)position;
	double g = p->g, s = 2 * u - 1, d = 1 + g * s;
	return (2 * s + g * (s * s + 3) + 2 * g * g * s + g * g * g * (s * s - 1)) / (2 * d * d);
}

const struct phase_ops phase_ops_hg = {
	/* At g = 0.999, half of the light is scattered by less than 0.1 degrees. */
	.decl = PLUGIN(PHASE, "hg", {.name = "g", .types = VALUE_FLOAT | VALUE_INT, .min = -0.999, .max = 0.999}),
	.create = create,
	.eval = eval,
	.sample = sample,
};
