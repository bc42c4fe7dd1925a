/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/geom/placement.h"

#define UNEVEN 0x1p16
#define TINY 0x1p-80

static vec3 matrix_row(const mat4 *m, int k)
{
	return (vec3){m->m[k][0], m->m[k][1], m->m[k][2]};
}

/* Returns the Frobenius norm of the linear part; at most sqrt(3) times the largest stretch. */
static double norm(const mat4 *m)
{
	double a = vec3_length(matrix_row(m, 0)), b = vec3_length(matrix_row(m, 1)), c = vec3_length(matrix_row(m, 2));
	return vec3_length((vec3){a, b, c});
}

bool placement_is_even(const mat4 *m)
{
	mat4 inverse;
	return mat4_invert(*m, &inverse) && norm(m) * norm(&inverse) <= 3 * UNEVEN;
}

static vec3 absolute(vec3 v)
{
	return (vec3){fabs(v.x), fabs(v.y), fabs(v.z)};
}

static void fill(struct placement *p, const mat4 *m, const mat4 *back, vec3 low, vec3 high)
{
	const mat4 inverse = *back;
	*p = (struct placement){.x = mat4_column(m, 0),
				.y = mat4_column(m, 1),
				.z = mat4_column(m, 2),
				.at = mat4_column(m, 3),
				.back = {matrix_row(&inverse, 0), matrix_row(&inverse, 1), matrix_row(&inverse, 2)},
				.mirrored = mat4_det3(*m) < 0};
	vec3 half = vec3_scale(0.5, vec3_sub(high, low));
	p->center = placement_point(p, vec3_add(low, half));
	p->half = vec3_madd(vec3_madd(vec3_scale(half.x, absolute(p->x)), half.y, absolute(p->y)), half.z,
			    absolute(p->z));
	p->rounding = 0x1p-50 * norm(&inverse) * triangle_norm_max(vec3_add(absolute(p->center), p->half));
	vec3 off = {0x1p-24 * triangle_norm_max((vec3){low.x, high.x, 0}),
		    0x1p-24 * triangle_norm_max((vec3){low.y, high.y, 0}),
		    0x1p-24 * triangle_norm_max((vec3){low.z, high.z, 0})};
	p->vertex_is_off = vec3_length(p->x) * off.x + vec3_length(p->y) * off.y + vec3_length(p->z) * off.z;
}

bool placement_make(struct placement *p, const mat4 *m, vec3 low, vec3 high)
{
	mat4 inverse;
	if (!placement_is_even(m) || !mat4_invert(*m, &inverse) || !(norm(m) >= TINY))
		return false;
	fill(p, m, &inverse, low, high);
	return true;
}

/* Checks the keyframes only: between keyframes the columns are no longer than at one of them, so what holds at the
 * keyframes holds everywhere. */
bool placement_make_moving(struct placement *p, const struct movement *m)
{
	double off = 0;
	for (uint32_t i = 0; i < m->motion.count; i++) {
		mat4 at = motion_at(&m->motion, m->motion.key[i].time);
		if (!placement_make(p, &at, m->low, m->high))
			return false;
		off = fmax(off, p->vertex_is_off);
	}
	mat4 open = motion_at(&m->motion, 0);
	if (!placement_make(p, &open, m->low, m->high))
		return false;
	vec3 low, high;
	motion_bounds(&m->motion, m->low, m->high, &low, &high);
	p->half = vec3_scale(0.5, vec3_sub(high, low));
	p->center = vec3_add(low, p->half);
	p->vertex_is_off = off;
	p->moves = m;
	return true;
}

void placement_move(const struct placement *p, double time, struct placement *out)
{
	const struct movement *m = p->moves;
	mat4 at = motion_at(&m->motion, time), inverse;
	/* The inverse exists: S is definite at the keyframes, and so between them. */
	if (!mat4_invert(at, &inverse))
		inverse = at;
	fill(out, &at, &inverse, m->low, m->high);
	out->first = p->first;
}
