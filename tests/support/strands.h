/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chains of round cones for tests, and their distance found by searching along their axes: the union of all spheres
 * between neighbours, without any formula for cones.
 */
#ifndef TESTS_SUPPORT_STRANDS_H
#define TESTS_SUPPORT_STRANDS_H

#include "tests/support/dice.h"
#include "worker/render/geom/curves.h"

enum { STRAND_MAX = 64 };

/* One chain, with the arrays that its curves point to. Not to be copied. */
struct strand {
	struct curves c;
	float point[STRAND_MAX][4], start[STRAND_MAX], v[STRAND_MAX], tangent[STRAND_MAX][3];
	uint32_t cone[STRAND_MAX];
};

void strand_begin(struct strand *s);
void strand_add(struct strand *s, vec3 p, double radius);
/* The last ends there; another begins. */
void strand_end(struct strand *s);
/* Tangents, in the mean of the axes around each point and off by up to `turn`. */
void strand_smooth(struct strand *s, double turn, struct dice *d);
/* A chain that turns at random by at most `turn`, around the origin; lengths of pieces and radii in these ranges. */
void strand_random(struct strand *s, uint32_t count, double turn, const double length[2], const double radius[2],
		   struct dice *d);

/* The distance of p from the sphere that is the nearest of all between both centers, in double. */
double strand_cone_distance(const float a[4], const float b[4], vec3 p);
double strand_distance(const struct strand *s, vec3 p); /* the least of all cones' */

#endif
