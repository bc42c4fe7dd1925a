/* SPDX-License-Identifier: Apache-2.0 */
/* Scatters equally in all directions. */
#include "worker/render/medium/phase.h"

#include <math.h>

static double eval(const struct phase *p, vec3 position, double cosine)
{
	(void)p, (void)position, (void)cosine;
	return 1 / (4 * M_PI);
}

static double sample(const struct phase *p, vec3 position, double u)
{
	(void)p, (void)position;
	return 2 * u - 1;
}

const struct phase_ops phase_ops_isotropic = {
	.decl = {PLUGIN_PHASE, "isotropic", NULL, 0, PARAM_UNDERSTOOD},
	.eval = eval,
	.sample = sample,
};
