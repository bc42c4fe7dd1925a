/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Samples points on a sphere, or on triangles chosen by their areas, at the current position of the surface. Most
 * lights do not move: the code for moving ones is in functions that are not inlined, so as not to slow down the others.
 *
 * Creation fails if the shape has no area. A triangle without area is never sampled.
 */
#include "worker/render/emitter/surface_light.h"

#include "worker/render/emitter/uniform.h"
#include "worker/render/math/search.h"
#include "worker/render/math/sphere.h"

static vec3 vertex_position(const struct surface_light *l, uint32_t i)
{
	const float *p = l->surface.position[i];
	return (vec3){(double)p[0], (double)p[1], (double)p[2]};
}

vec3 surface_light_corner(const struct surface_light *l, uint32_t triangle, int k)
{
	uint32_t i = l->surface.index[triangle][k];
	const double(*u)[3] = l->surface.unrounded;
	if (u)
		return (vec3){u[i][0], u[i][1], u[i][2]};
	return l->is_moving_mesh ? mat4_point(&l->to_world, vertex_position(l, i)) : vertex_position(l, i);
}

/* A triangle's first corner, and its edges from there. */
struct triangle_edges {
	vec3 v0, e1, e2;
};

/* Not inlined: most lights do not move, and are neither very large nor very small. */
__attribute__((noinline)) static void compute_edges(const struct surface_light *l, uint32_t i, struct triangle_edges *t)
{
	t->v0 = surface_light_corner(l, i, 0);
	t->e1 = vec3_sub(surface_light_corner(l, i, 1), t->v0);
	t->e2 = vec3_sub(surface_light_corner(l, i, 2), t->v0);
}

static inline struct triangle_edges triangle_edges_of(const struct surface_light *l, uint32_t i)
{
	struct triangle_edges t;
	if (l->has_computed_corners) {
		compute_edges(l, i, &t);
		return t;
	}
	const uint32_t *k = l->surface.index[i];
	t.v0 = vertex_position(l, k[0]);
	t.e1 = vec3_sub(vertex_position(l, k[1]), t.v0);
	t.e2 = vec3_sub(vertex_position(l, k[2]), t.v0);
	return t;
}

vec3 surface_light_normal(const struct surface_light *l, uint32_t triangle)
{
	const struct triangle_edges t = triangle_edges_of(l, triangle);
	return vec3_cross(t.e1, t.e2);
}

void surface_light_barycentrics(const struct surface_light *l, uint32_t triangle, vec3 p, double b[2])
{
	const struct triangle_edges t = triangle_edges_of(l, triangle);
	vec3 r = vec3_sub(p, t.v0), n = vec3_cross(t.e1, t.e2);
	double n2 = vec3_dot(n, n);
	b[0] = vec3_dot(vec3_cross(r, t.e2), n) / n2;
	b[1] = vec3_dot(vec3_cross(t.e1, r), n) / n2;
}

static double triangle_area(const struct surface_light *l, uint32_t triangle)
{
	return 0.5 * vec3_length(surface_light_normal(l, triangle));
}

static double sphere_area(const struct surface_light *l)
{
	return 4 * M_PI * l->surface.radius * l->surface.radius;
}

static int build_cdf(struct surface_light *l, struct arena *arena)
{
	uint32_t n = l->surface.triangle_count;
	l->cdf = arena_alloc(arena, (size_t)n + 1, sizeof *l->cdf);
	if (!l->cdf)
		return -ENOMEM;
	for (uint32_t i = 0; i < n; i++)
		l->cdf[i + 1] = l->cdf[i] + triangle_area(l, i);
	l->area = l->cdf[n];
	for (uint32_t i = 1; i <= n; i++)
		l->cdf[i] /= l->area;
	return 0;
}

static void transform_surface(struct surface_light *l, const mat4 *to_world)
{
	struct emitter_surface *s = &l->surface;
	if (!s->is_sphere) {
		l->to_world = *to_world;
		return;
	}
	s->center = mat4_point(to_world, s->center);
	s->radius *= vec3_length(mat4_vector(to_world, (vec3){1, 0, 0}));
	s->sphere_axes = (struct frame){vec3_normalize(mat4_vector(to_world, s->sphere_axes.s)),
					vec3_normalize(mat4_vector(to_world, s->sphere_axes.t)),
					vec3_normalize(mat4_vector(to_world, s->sphere_axes.n))};
	l->area = sphere_area(l);
}

void surface_light_set_transform(struct emitter *em, const mat4 *to_world)
{
	transform_surface(em->data, to_world);
}

/* Returns the mean area of a moving surface over time, which is used to choose among emitters. */
static double mean_area(const struct surface_light *l)
{
	enum { TIMES = 8 };
	double sum = 0;
	for (int k = 0; k < TIMES; k++) {
		struct surface_light moved = *l;
		mat4 to_world = motion_transform_at(l->surface.motion, (k + 0.5) / TIMES);
		transform_surface(&moved, &to_world);
		sum += l->surface.is_sphere ? moved.area : 0;
		for (uint32_t i = 0; i < l->surface.triangle_count; i++)
			sum += triangle_area(&moved, i);
	}
	return sum / TIMES;
}

int surface_light_create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build,
			 struct error *e)
{
	struct surface_light *l = em->data;
	l->surface = *build->surface;
	int rc = emitter_read_texture(&l->radiance, n, "radiance", COLOR_ILLUMINANT, build, e);
	if (rc)
		return rc;
	em->motion = l->surface.motion;
	l->is_moving_mesh = em->motion && !l->surface.is_sphere;
	l->has_computed_corners = l->is_moving_mesh || l->surface.unrounded;
	if (l->is_moving_mesh)
		l->to_world = motion_transform_at(em->motion, 0);
	if (l->surface.is_sphere)
		l->area = sphere_area(l);
	else if (build_cdf(l, build->arena))
		return error_set(e, ENOMEM, "out of memory");
	if (em->motion)
		l->area = mean_area(l);
	if (!(l->area > 0))
		return node_error(n, e, EINVAL, "an area emitter needs a shape whose area is above 0");
	em->is_textured = !texture_is_constant(&l->radiance);
	em->color_kind = texture_color_kind(&l->radiance);
	em->brightness_bound = texture_max(&l->radiance);
	return 0;
}

void surface_light_set_sphere_point(const struct surface_light *l, vec3 w, struct emitter_point *x)
{
	x->p = vec3_madd(l->surface.center, l->surface.radius, w);
	x->n = vec3_scale(l->surface.normal_sign, w);
	x->texture_point = (struct texture_point){.p = x->p};
	sphere_uv(&l->surface.sphere_axes, w, &x->texture_point.u, &x->texture_point.v);
}

void surface_light_set_triangle_point(const struct surface_light *l, uint32_t triangle, double b1, double b2,
				      struct emitter_point *x)
{
	const struct emitter_surface *s = &l->surface;
	const struct triangle_edges t = triangle_edges_of(l, triangle);
	x->p = vec3_madd(vec3_madd(t.v0, b1, t.e1), b2, t.e2);
	x->n = vec3_normalize(vec3_cross(t.e1, t.e2));
	x->texture_point = (struct texture_point){b1, b2, b1, b2, triangle, .p = x->p};
	if (s->uv) {
		const float *t0 = s->uv[s->index[triangle][0]], *t1 = s->uv[s->index[triangle][1]],
			    *t2 = s->uv[s->index[triangle][2]];
		double b0 = 1 - b1 - b2;
		x->texture_point.u = b0 * (double)t0[0] + b1 * (double)t1[0] + b2 * (double)t2[0];
		x->texture_point.v = b0 * (double)t0[1] + b1 * (double)t1[1] + b2 * (double)t2[1];
	}
}

static uint32_t find_triangle(const struct surface_light *l, double u, double *rest)
{
	uint32_t i = search_find_cell(l->cdf, l->surface.triangle_count, u);
	double width = l->cdf[i + 1] - l->cdf[i];
	*rest = width > 0 ? fmin(fmax((u - l->cdf[i]) / width, 0), 1 - 0x1p-53) : 0.5;
	return i;
}

__attribute__((noinline)) static double moving_mesh_pdf(const struct surface_light *l, uint32_t i)
{
	return (l->cdf[i + 1] - l->cdf[i]) / triangle_area(l, i);
}

static inline double triangle_pdf(const struct surface_light *l, uint32_t i)
{
	return l->is_moving_mesh ? moving_mesh_pdf(l, i) : 1 / l->area;
}

bool surface_light_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf)
{
	const struct surface_light *l = em->data;
	x->is_infinite = false;
	if (l->surface.is_sphere) {
		*pdf = 1 / l->area;
		surface_light_set_sphere_point(l, sphere_from_square(u), x);
		return true;
	}
	double v;
	uint32_t i = find_triangle(l, u[0], &v);
	double root = sqrt(v);
	*pdf = triangle_pdf(l, i);
	surface_light_set_triangle_point(l, i, 1 - root, root * u[1], x);
	return true;
}

double surface_light_pdf_point(const struct emitter *em, const struct emitter_point *x)
{
	return triangle_pdf(em->data, x->texture_point.prim);
}

static double clamp_below_1(double x)
{
	return fmin(fmax(x, 0), 1 - 0x1p-53);
}

static void triangle_inverse(const struct surface_light *l, const struct emitter_point *x, double u[2])
{
	double b[2];
	surface_light_barycentrics(l, x->texture_point.prim, x->p, b);
	double root = fmin(fmax(1 - b[0], 0), 1), low = l->cdf[x->texture_point.prim],
	       high = l->cdf[x->texture_point.prim + 1];
	/* Rounding must not select another triangle. */
	u[0] = fmax(fmin(low + root * root * (high - low), nextafter(high, 0)), low);
	u[1] = root > 0 ? clamp_below_1(b[1] / root) : 0;
}

void surface_light_point_inverse(const struct emitter *em, const struct emitter_point *x, double u[2])
{
	const struct surface_light *l = em->data;
	if (l->surface.is_sphere)
		square_from_sphere(vec3_scale(1 / l->surface.radius, vec3_sub(x->p, l->surface.center)), u);
	else
		triangle_inverse(l, x, u);
}
