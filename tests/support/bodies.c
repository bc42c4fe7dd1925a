/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/bodies.h"

#include "common/base/mem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static void reserve_arrays(struct geom_shape *s, size_t vertices, size_t triangles)
{
	*s = (struct geom_shape){.normal_sign = 1};
	s->position = mem_alloc(vertices + 1, sizeof *s->position);
	s->index = mem_alloc(triangles, sizeof *s->index);
	assert_non_null(s->position);
	assert_non_null(s->index);
}

static uint32_t add_vertex(struct geom_shape *s, vec3 p)
{
	float *v = s->position[s->vertex_count];
	v[0] = (float)p.x;
	v[1] = (float)p.y;
	v[2] = (float)p.z;
	return s->vertex_count++;
}

static void add_triangle(struct geom_shape *s, uint32_t a, uint32_t b, uint32_t c)
{
	memcpy(s->index[s->triangle_count++], (uint32_t[3]){a, b, c}, sizeof s->index[0]);
}

static vec3 ball_point(vec3 lattice, double radius, double bump)
{
	vec3 w = vec3_normalize(lattice);
	double wave = sin(9 * w.x + 1) * sin(11 * w.y + 2) * sin(10 * w.z + 3);
	return vec3_scale(radius * (1 + bump * wave), w);
}

void body_make_ball(struct geom_shape *s, uint32_t n, double radius, double bump)
{
	uint32_t side = n + 1;
	reserve_arrays(s, 6 * (size_t)side * side, 12 * (size_t)n * n);
	uint32_t *vertex_ids = mem_alloc((size_t)side * side * side, sizeof *vertex_ids);
	assert_non_null(vertex_ids);
	for (uint32_t face = 0; face < 6; face++) {
		uint32_t axis = face / 2, face_coordinate = face % 2 ? n : 0;
		for (uint32_t i = 0; i < n; i++)
			for (uint32_t j = 0; j < n; j++) {
				uint32_t id[4];
				for (uint32_t k = 0; k < 4; k++) {
					uint32_t c[3];
					c[axis] = face_coordinate;
					c[(axis + 1) % 3] = i + (k == 1 || k == 2);
					c[(axis + 2) % 3] = j + (k == 2 || k == 3);
					uint32_t *id_slot = &vertex_ids[(c[0] * side + c[1]) * side + c[2]];
					vec3 lattice = {2.0 * c[0] / n - 1, 2.0 * c[1] / n - 1, 2.0 * c[2] / n - 1};
					if (!*id_slot)
						*id_slot = add_vertex(s, ball_point(lattice, radius, bump)) + 1;
					id[k] = *id_slot - 1;
				}
				uint32_t second = face_coordinate ? id[1] : id[3],
					 last = face_coordinate ? id[3] : id[1];
				add_triangle(s, id[0], second, id[2]);
				add_triangle(s, id[0], id[2], last);
			}
	}
	mem_free(vertex_ids);
}

void body_make_plane(struct geom_shape *s, uint32_t n, double a, double b)
{
	uint32_t side = n + 1;
	reserve_arrays(s, (size_t)side * side, 2 * (size_t)n * n);
	for (uint32_t j = 0; j <= n; j++)
		for (uint32_t i = 0; i <= n; i++) {
			double x = 2.0 * i / n - 1, y = 2.0 * j / n - 1;
			add_vertex(s, (vec3){x, y, a * x + b * y});
		}
	for (uint32_t j = 0; j < n; j++)
		for (uint32_t i = 0; i < n; i++) {
			uint32_t v = j * side + i;
			add_triangle(s, v, v + 1, v + side + 1);
			add_triangle(s, v, v + side + 1, v + side);
		}
}

void body_fini(struct geom_shape *s)
{
	mem_free(s->position);
	mem_free(s->index);
}

struct accel *body_build_accel(const struct geom_shape *shapes, uint32_t count)
{
	struct accel_shape *a = mem_alloc(count, sizeof *a);
	assert_non_null(a);
	for (uint32_t i = 0; i < count; i++) {
		const struct geom_shape *g = &shapes[i];
		a[i] = (struct accel_shape){g->is_sphere,
					    g->center,
					    g->radius,
					    g->vertex_count,
					    g->triangle_count,
					    (const float(*)[3])g->position,
					    (const uint32_t(*)[3])g->index,
					    SURFACE_OPAQUE,
					    g->placement,
					    (const double(*)[3])g->unrounded,
					    g->curves,
					    g->culls_backfaces};
	}
	struct accel *accel;
	struct error e = {""};
	if (accel_new(&accel, a, count, NULL, &e))
		fail_msg("%s", e.text);
	mem_free(a);
	return accel;
}

struct surface_point body_sample_point(const struct geom_shape *s, uint32_t shape, struct dice *d)
{
	struct surface_point x;
	if (s->is_sphere) {
		surface_on_sphere(s, (struct prim_ref){shape, 0, 0}, dice_direction(d), &x);
		return x;
	}
	double root = sqrt(dice_uniform(d));
	surface_on_triangle(s, (struct prim_ref){shape, dice_below(d, s->triangle_count), 0}, 1 - root,
			    root * dice_uniform(d), &x);
	return x;
}

struct ray_end body_ray_end(const struct surface_point *x)
{
	return (struct ray_end){x->p, x->ng, x->prim};
}

static vec3 vertex_position(const struct geom_shape *s, uint32_t i)
{
	return (vec3){(double)s->position[i][0], (double)s->position[i][1], (double)s->position[i][2]};
}

double body_hit_distance(const struct geom_shape *s, vec3 o, vec3 d, double t_min, uint32_t *prim)
{
	double best = INFINITY;
	for (uint32_t i = 0; i < s->triangle_count; i++) {
		vec3 v0 = vertex_position(s, s->index[i][0]), e1 = vec3_sub(vertex_position(s, s->index[i][1]), v0);
		vec3 e2 = vec3_sub(vertex_position(s, s->index[i][2]), v0), h = vec3_cross(d, e2);
		double det = vec3_dot(e1, h);
		if (det == 0)
			continue;
		vec3 from = vec3_sub(o, v0), q = vec3_cross(from, e1);
		double u = vec3_dot(from, h) / det, v = vec3_dot(d, q) / det, t = vec3_dot(e2, q) / det;
		if (u < 0 || v < 0 || u + v > 1 || !(t > t_min && t < best))
			continue;
		best = t;
		*prim = i;
	}
	return best;
}
