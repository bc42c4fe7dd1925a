/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/geom/triangle.h"

float triangle_extent(const float (*position)[3], const uint32_t i[3])
{
	float max = 0;
	for (int k = 0; k < 3; k++) {
		float a = position[i[0]][k], b = position[i[1]][k], c = position[i[2]][k];
		max = fmaxf(max, fmaxf(a, fmaxf(b, c)) - fminf(a, fminf(b, c)));
	}
	return max;
}

static bool comes_first(vec3 a, vec3 b)
{
	return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

/* Returns a number whose sign tells on which side of the line through a and b the ray passes: the volume spanned by d,
 * a - o, b - o. Exchanging a and b gives exactly the opposite number. */
static double edge_side(vec3 o, vec3 d, vec3 a, vec3 b)
{
	bool is_swapped = comes_first(b, a);
	vec3 p = vec3_sub(is_swapped ? b : a, o), q = vec3_sub(is_swapped ? a : b, o);
	double volume = vec3_dot(d, vec3_cross(p, q));
	return is_swapped ? -volume : volume;
}

bool triangle_intersect(const struct triangle *k, vec3 o, vec3 d, double *t)
{
	double u = edge_side(o, d, k->v[1], k->v[2]), v = edge_side(o, d, k->v[2], k->v[0]),
	       w = edge_side(o, d, k->v[0], k->v[1]);
	if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0))
		return false;
	double slope = vec3_dot(k->n, d);
	*t = vec3_dot(k->n, vec3_sub(k->v[0], o)) / slope;
	return slope != 0;
}
