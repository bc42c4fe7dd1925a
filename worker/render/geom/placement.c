/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/geom/placement.h"

#define UNEVENNESS_MAX 0x1p16
#define PLACEMENT_SCALE_MIN 0x1p-80

static vec3 matrix_row(const mat4 *m, int k)
{
	return (vec3){m->m[k][0], m->m[k][1], m->m[k][2]};
}

/* Returns the Frobenius norm of the linear part; at most sqrt(3) times the largest stretch. */
static double frobenius_norm(const mat4 *m)
{
	double a = vec3_length(matrix_row(m, 0)), b = vec3_length(matrix_row(m, 1)), c = vec3_length(matrix_row(m, 2));
	return vec3_length((vec3){a, b, c});
}

bool placement_is_even(const mat4 *m)
{
	mat4 inverse;
	return mat4_invert(*m, &inverse) && frobenius_norm(m) * frobenius_norm(&inverse) <= 3 * UNEVENNESS_MAX;
}

static vec3 absolute(vec3 v)
{
	return (vec3){fabs(v.x), fabs(v.y), fabs(v.z)};
}

static void fill_placement(struct placement *p, const mat4 *m, const mat4 *to_mesh, vec3 low, vec3 high)
{
	const mat4 inverse = *to_mesh;
	*p = (struct placement){
		.x = mat4_column(m, 0),
		.y = mat4_column(m, 1),
		.z = mat4_column(m, 2),
		.origin = mat4_column(m, 3),
		.inverse_rows = {matrix_row(&inverse, 0), matrix_row(&inverse, 1), matrix_row(&inverse, 2)},
		.is_mirrored = mat4_det3(*m) < 0};
	vec3 half = vec3_scale(0.5, vec3_sub(high, low));
	p->center = placement_point(p, vec3_add(low, half));
	p->half = vec3_madd(vec3_madd(vec3_scale(half.x, absolute(p->x)), half.y, absolute(p->y)), half.z,
			    absolute(p->z));
	p->rounding = 0x1p-50 * frobenius_norm(&inverse) * triangle_norm_max(vec3_add(absolute(p->center), p->half));
	vec3 rounding = {0x1p-24 * triangle_norm_max((vec3){low.x, high.x, 0}),
			 0x1p-24 * triangle_norm_max((vec3){low.y, high.y, 0}),
			 0x1p-24 * triangle_norm_max((vec3){low.z, high.z, 0})};
	p->vertex_error =
		vec3_length(p->x) * rounding.x + vec3_length(p->y) * rounding.y + vec3_length(p->z) * rounding.z;
}

bool placement_make(struct placement *p, const mat4 *m, vec3 low, vec3 high)
{
	mat4 inverse;
	if (!placement_is_even(m) || !mat4_invert(*m, &inverse) || !(frobenius_norm(m) >= PLACEMENT_SCALE_MIN))
		return false;
	fill_placement(p, m, &inverse, low, high);
	return true;
}

/* Checks the keyframes only: between keyframes the columns are no longer than at one of them, so what holds at the
 * keyframes holds everywhere. */
bool placement_make_moving(struct placement *p, const struct swept_motion *m)
{
	double max_vertex_error = 0;
	for (uint32_t i = 0; i < m->motion.count; i++) {
		mat4 matrix = motion_transform_at(&m->motion, m->motion.key[i].time);
		if (!placement_make(p, &matrix, m->box_min, m->box_max))
			return false;
		max_vertex_error = fmax(max_vertex_error, p->vertex_error);
	}
	mat4 at_open = motion_transform_at(&m->motion, 0);
	if (!placement_make(p, &at_open, m->box_min, m->box_max))
		return false;
	vec3 low, high;
	motion_bounds(&m->motion, m->box_min, m->box_max, &low, &high);
	p->half = vec3_scale(0.5, vec3_sub(high, low));
	p->center = vec3_add(low, p->half);
	p->vertex_error = max_vertex_error;
	p->movement = m;
	return true;
}

void placement_compute_at(const struct placement *p, double time, struct placement *out)
{
	const struct swept_motion *m = p->movement;
	mat4 matrix = motion_transform_at(&m->motion, time), inverse;
	/* The inverse exists: S is definite at the keyframes, and so between them. */
	if (!mat4_invert(matrix, &inverse))
		inverse = matrix;
	fill_placement(out, &matrix, &inverse, m->box_min, m->box_max);
	out->first_shape = p->first_shape;
}
