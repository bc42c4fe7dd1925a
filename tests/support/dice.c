/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/dice.h"

#include "tests/support/test_length.h"
#include "tests/support/stats.h"
#include "worker/render/math/rng.h"

#include <stdlib.h>

struct dice dice_for_test(const char *test)
{
	return (struct dice){.seed = stats_seed(test)};
}

double dice_uniform(struct dice *d)
{
	if (d->remaining == 0) {
		rng_uniform4(d->seed, RNG_TEST, d->index++, 0, 0, d->value);
		d->remaining = 4;
	}
	return d->value[--d->remaining];
}

double dice_between(struct dice *d, double low, double high)
{
	return low + (high - low) * dice_uniform(d);
}

uint32_t dice_below(struct dice *d, uint32_t n)
{
	return (uint32_t)(dice_uniform(d) * n);
}

vec3 dice_direction(struct dice *d)
{
	double z = dice_between(d, -1, 1), phi = dice_between(d, 0, 2 * M_PI), r = sqrt(1 - z * z);
	return (vec3){r * cos(phi), r * sin(phi), z};
}

double dice_normal(struct dice *d)
{
	double radius = sqrt(-2 * log(1 - dice_uniform(d)));
	return radius * cos(2 * M_PI * dice_uniform(d));
}

double dice_poisson(struct dice *d, double mean)
{
	double n = 0, p = dice_uniform(d);
	for (double end = exp(-mean); p > end; n++)
		p *= dice_uniform(d);
	return n;
}

size_t dice_scaled_count(size_t samples)
{
	samples = samples * (test_is_full() ? 8 : 1) / test_scale();
	return samples ? samples : 1;
}
