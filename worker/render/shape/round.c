/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/round.h"

vec3 round_direction(uint32_t i)
{
	/* Corners on the axes are exact, and the last corner equals the first to the bit. */
	uint32_t quarter = ROUND_SEGMENTS / 4, k = i % quarter;
	double angle = 0.5 * M_PI * k / quarter, c = k ? cos(angle) : 1, s = k ? sin(angle) : 0;
	switch (i / quarter % 4) {
	case 0:
		return (vec3){c, s, 0};
	case 1:
		return (vec3){-s, c, 0};
	case 2:
		return (vec3){-c, -s, 0};
	default:
		return (vec3){s, -c, 0};
	}
}

double round_radius(void)
{
	double angle = 2 * M_PI / ROUND_SEGMENTS;
	return sqrt(angle / sin(angle));
}
