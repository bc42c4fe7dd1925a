/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/dice.h"

#include "tests/support/length.h"
#include "tests/support/stats.h"
#include "worker/render/math/rng.h"

#include <stdlib.h>

struct dice dice_of(const char *test)
{
	return (struct dice){.seed = stats_seed(test)};
}

double dice_throw(struct dice *d)
{
	if (d->left == 0) {
		rng_uniform4(d->seed, RNG_TEST, d->index++, 0, 0, d->value);
		d->left = 4;
	}
	return d->value[--d->left];
}

double dice_between(struct dice *d, double low, double high)
{
	return low + (high - low) * dice_throw(d);
}

uint32_t dice_below(struct dice *d, uint32_t n)
{
	return (uint32_t)(dice_throw(d) * n);
}

vec3 dice_direction(struct dice *d)
{
	double z = dice_between(d, -1, 1), phi = dice_between(d, 0, 2 * M_PI), r = sqrt(1 - z * z);
	return (vec3){r * cos(phi), r * sin(phi), z};
}

double dice_normal(struct dice *d)
{
	double radius = sqrt(-2 * log(1 - dice_throw(d)));
	return radius * cos(2 * M_PI * dice_throw(d));
}

double dice_poisson(struct dice *d, double mean)
{
	double n = 0, p = dice_throw(d);
	for (double end = exp(-mean); p > end; n++)
		p *= dice_throw(d);
	return n;
}

size_t dice_count(size_t samples)
{
	samples = samples * (test_full() ? 8 : 1) / test_scale();
	return samples ? samples : 1;
}
