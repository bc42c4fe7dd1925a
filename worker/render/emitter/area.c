/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Light from a surface, equal in all directions on the side of its normal. Meshes: uniform per area. Spheres: uniform
 * per area for light sub-paths; seen from outside, uniform over the cone that the sphere subtends (Shirley, Wang,
 * Zimmerman 1996, sec. 4.1.1), with its angle computed from the sine so that distant spheres keep their precision.
 */
#include "worker/render/emitter/emitter.h"
#include "worker/render/emitter/uniform.h"
#include "worker/render/math/sphere.h"

struct area {
	struct texture radiance;
	struct emitter_surface surface;
	double area;
	double *cdf; /* of triangles; cdf[triangle_count] = 1 */
};

static const struct param params[] = {
	{"radiance", VALUE_TEXTURE, PARAM_UNDERSTOOD, 0, PARAM_LIGHT_MAX, NULL},
	{"sampling_weight", VALUE_FLOAT, PARAM_IGNORED, 0, 0, NULL},
	{NULL, 0, PARAM_UNDERSTOOD, 0, 0, NULL},
};

static vec3 corner(const struct emitter_surface *s, uint32_t triangle, int k)
{
	uint32_t i = s->index[triangle][k];
	if (s->unrounded)
		return (vec3){s->unrounded[i][0], s->unrounded[i][1], s->unrounded[i][2]};
	const float *p = s->position[i];
	return (vec3){(double)p[0], (double)p[1], (double)p[2]};
}

static int build_cdf(struct area *a, struct arena *arena)
{
	uint32_t n = a->surface.triangle_count;
	a->cdf = arena_alloc(arena, (size_t)n + 1, sizeof *a->cdf);
	if (!a->cdf)
		return -ENOMEM;
	for (uint32_t i = 0; i < n; i++) {
		vec3 v0 = corner(&a->surface, i, 0);
		vec3 c = vec3_cross(vec3_sub(corner(&a->surface, i, 1), v0), vec3_sub(corner(&a->surface, i, 2), v0));
		a->cdf[i + 1] = a->cdf[i] + 0.5 * vec3_length(c);
	}
	a->area = a->cdf[n];
	for (uint32_t i = 1; i <= n; i++)
		a->cdf[i] /= a->area;
	return 0;
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	if (!build->surface)
		return node_error(n, e, EINVAL,
				  "an area emitter must stand in a shape, or have an id by which shapes refer to it");
	struct area *a = arena_alloc(build->arena, 1, sizeof *a);
	if (!a)
		return error_set(e, ENOMEM, "out of memory");
	a->surface = *build->surface;
	int rc = emitter_texture(&a->radiance, n, "radiance", COLOR_ILLUMINANT, build, e);
	if (rc)
		return rc;
	if (a->surface.is_sphere)
		a->area = 4 * M_PI * a->surface.radius * a->surface.radius;
	else if (build_cdf(a, build->arena))
		return error_set(e, ENOMEM, "out of memory");
	if (!(a->area > 0))
		return node_error(n, e, EINVAL, "an area emitter needs a shape of area above 0");
	em->data = a;
	em->textured = !texture_is_constant(&a->radiance);
	em->shape = texture_shape(&a->radiance);
	em->brightest = texture_max(&a->radiance);
	em->power = a->area * M_PI * em->brightest;
	return 0;
}

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	const struct area *a = em->data;
	if (!(vec3_dot(x->n, w) > 0))
		return spectrum_of(0);
	return texture_eval(&a->radiance, &x->where, wl);
}

static void sphere_point(const struct area *a, vec3 w, struct emitter_point *x)
{
	x->p = vec3_madd(a->surface.center, a->surface.radius, w);
	x->n = vec3_scale(a->surface.normal_sign, w);
	x->where = (struct texture_point){0};
	sphere_uv(&a->surface.sphere_axes, w, &x->where.u, &x->where.v);
}

static void triangle_point(const struct area *a, uint32_t i, double b1, double b2, struct emitter_point *x)
{
	const struct emitter_surface *s = &a->surface;
	vec3 v0 = corner(s, i, 0), e1 = vec3_sub(corner(s, i, 1), v0), e2 = vec3_sub(corner(s, i, 2), v0);
	x->p = vec3_madd(vec3_madd(v0, b1, e1), b2, e2);
	x->n = vec3_normalize(vec3_cross(e1, e2));
	x->where = (struct texture_point){b1, b2, b1, b2, i};
	if (s->uv) {
		const float *t0 = s->uv[s->index[i][0]], *t1 = s->uv[s->index[i][1]], *t2 = s->uv[s->index[i][2]];
		double b0 = 1 - b1 - b2;
		x->where.u = b0 * (double)t0[0] + b1 * (double)t1[0] + b2 * (double)t2[0];
		x->where.v = b0 * (double)t0[1] + b1 * (double)t1[1] + b2 * (double)t2[1];
	}
}

static uint32_t find_triangle(const struct area *a, double u, double *rest)
{
	uint32_t lo = 0, hi = a->surface.triangle_count;
	while (hi - lo > 1) {
		uint32_t mid = lo + (hi - lo) / 2;
		if (a->cdf[mid] <= u)
			lo = mid;
		else
			hi = mid;
	}
	double width = a->cdf[lo + 1] - a->cdf[lo];
	*rest = width > 0 ? fmin(fmax((u - a->cdf[lo]) / width, 0), 1 - 0x1p-53) : 0.5;
	return lo;
}

static bool sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf)
{
	const struct area *a = em->data;
	x->infinite = false;
	*pdf = 1 / a->area;
	if (a->surface.is_sphere) {
		sphere_point(a, direction_of_square(u), x);
		return true;
	}
	double v;
	uint32_t i = find_triangle(a, u[0], &v);
	double root = sqrt(v);
	triangle_point(a, i, 1 - root, root * u[1], x);
	return true;
}

static double below_1(double x)
{
	return fmin(fmax(x, 0), 1 - 0x1p-53);
}

static void triangle_inverse(const struct area *a, const struct emitter_point *x, double u[2])
{
	const struct emitter_surface *s = &a->surface;
	vec3 v0 = corner(s, x->where.prim, 0), e1 = vec3_sub(corner(s, x->where.prim, 1), v0),
	     e2 = vec3_sub(corner(s, x->where.prim, 2), v0);
	vec3 r = vec3_sub(x->p, v0), n = vec3_cross(e1, e2);
	double n2 = vec3_dot(n, n), b1 = vec3_dot(vec3_cross(r, e2), n) / n2, b2 = vec3_dot(vec3_cross(e1, r), n) / n2;
	double root = fmin(fmax(1 - b1, 0), 1), low = a->cdf[x->where.prim], high = a->cdf[x->where.prim + 1];
	/* Rounding must not change the triangle. */
	u[0] = fmax(fmin(low + root * root * (high - low), nextafter(high, 0)), low);
	u[1] = root > 0 ? below_1(b2 / root) : 0;
}

static void point_inverse(const struct emitter *em, const struct emitter_point *x, double u[2])
{
	const struct area *a = em->data;
	if (a->surface.is_sphere)
		square_of_direction(vec3_scale(1 / a->surface.radius, vec3_sub(x->p, a->surface.center)), u);
	else
		triangle_inverse(a, x, u);
}

static double pdf_point(const struct emitter *em, const struct emitter_point *x)
{
	(void)x;
	return 1 / ((const struct area *)em->data)->area;
}

static bool sample_direction(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
			     double *pdf)
{
	(void)em;
	struct frame f = frame_around(x->n);
	double r = sqrt(u[0]), phi = 2 * M_PI * u[1], z = sqrt(1 - u[0]);
	*w = frame_to_world(&f, (vec3){r * cos(phi), r * sin(phi), z});
	*pdf = z / M_PI;
	return z > 0;
}

static double pdf_direction(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	(void)em;
	return fmax(vec3_dot(x->n, w), 0) / M_PI;
}

/* The sphere as seen from outside: distance and squared sine of its half angle. false: seen from inside, or it emits
 * inwards. */
static bool sphere_cone(const struct area *a, vec3 ref, vec3 *axis, double *distance, double *sin2)
{
	vec3 to = vec3_sub(a->surface.center, ref);
	double d = vec3_length(to), r = a->surface.radius;
	if (!a->surface.is_sphere || a->surface.normal_sign < 0 || !(d > r * (1 + 0x1p-40)))
		return false;
	*axis = vec3_scale(1 / d, to);
	*distance = d;
	*sin2 = (r / d) * (r / d);
	return true;
}

static double cone_solid_angle(double sin2)
{
	return 2 * M_PI * sin2 / (1 + sqrt(1 - sin2)); /* 2 pi (1 - cos) without cancellation */
}

static double sphere_pdf_area(vec3 ref, double sin2, const struct emitter_point *x)
{
	vec3 d = vec3_sub(x->p, ref);
	double l2 = vec3_dot(d, d);
	if (!(l2 > 0))
		return 0;
	double cosine = -vec3_dot(d, x->n) / sqrt(l2);
	return cosine > 0 ? cosine / (l2 * cone_solid_angle(sin2)) : 0;
}

static bool sample_toward(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x, double *pdf)
{
	const struct area *a = em->data;
	vec3 axis;
	double distance, sin2;
	if (!sphere_cone(a, ref, &axis, &distance, &sin2))
		return sample_point(em, u, x, pdf);
	/* q = 1 - cos(theta) of the direction within the cone; then the near crossing, as an angle at the centre. */
	double q = u[0] * sin2 / (1 + sqrt(1 - sin2)), s2 = q * (2 - q), c = 1 - q, r = a->surface.radius;
	double t = distance * c - sqrt(fmax(r * r - distance * distance * s2, 0));
	double phi = 2 * M_PI * u[1], s = sqrt(s2);
	struct frame f = frame_around(axis);
	vec3 w = frame_to_world(&f, (vec3){s * cos(phi), s * sin(phi), c});
	vec3 p = vec3_madd(ref, t, w);
	x->infinite = false;
	vec3 out = vec3_sub(p, a->surface.center);
	/* So distant that it rounds to a point: the nearest one is used. */
	sphere_point(a, vec3_length(out) > 0 ? vec3_normalize(out) : vec3_neg(axis), x);
	*pdf = sphere_pdf_area(ref, sin2, x);
	return *pdf > 0;
}

static double pdf_toward(const struct emitter *em, vec3 ref, const struct emitter_point *x)
{
	const struct area *a = em->data;
	vec3 axis;
	double distance, sin2;
	if (!sphere_cone(a, ref, &axis, &distance, &sin2))
		return 1 / a->area;
	return sphere_pdf_area(ref, sin2, x);
}

const struct emitter_ops emitter_ops_area = {
	.type = "area",
	.params = params,
	.needs_surface = true,
	.create = create,
	.radiance = radiance,
	.sample_point = sample_point,
	.pdf_point = pdf_point,
	.point_inverse = point_inverse,
	.sample_direction = sample_direction,
	.pdf_direction = pdf_direction,
	.sample_toward = sample_toward,
	.pdf_toward = pdf_toward,
};
