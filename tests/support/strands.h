/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chains of round cones for tests, and their distance, found by searching along their axes: each is the union of all
 * spheres between neighbouring points, without any formula for cones.
 */
#ifndef TESTS_SUPPORT_STRANDS_H
#define TESTS_SUPPORT_STRANDS_H

#include "tests/support/dice.h"
#include "worker/render/geom/curves.h"

enum { STRAND_POINTS_MAX = 64 };

/* One chain, with the arrays to which its curves point. Must not be copied. */
struct strand {
	struct curves curves;
	float point[STRAND_POINTS_MAX][4], start[STRAND_POINTS_MAX], v[STRAND_POINTS_MAX],
		tangent[STRAND_POINTS_MAX][3];
	uint32_t cone[STRAND_POINTS_MAX];
};

void strand_init(struct strand *s);
void strand_add(struct strand *s, vec3 p, double radius);
/* Ends the chain at its last point; the next point begins another. */
void strand_end_chain(struct strand *s);
/* Sets tangents: the mean of the axes around each point, rotated by up to `turn`. */
void strand_set_tangents(struct strand *s, double turn, struct dice *d);
/* Makes a chain around the origin that turns at random by at most `turn` at each point; lengths of pieces and radii
 * are in the given ranges. */
void strand_make_random(struct strand *s, uint32_t count, double turn, const double length[2], const double radius[2],
			struct dice *d);

/* Returns the distance of p from the nearest of all spheres between the two centres, in double. */
double strand_cone_distance(const float a[4], const float b[4], vec3 p);
double strand_distance(const struct strand *s, vec3 p); /* the least distance over all cones */

#endif
