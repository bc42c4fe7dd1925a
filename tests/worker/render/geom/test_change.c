/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Derivatives of surface points along the surface, against points a little further on. Central differences with a
 * step of 1e-5 lengths, extrapolated once, err by less than 1e-7, unless the neighbouring values are large.
 */
#include "tests/support/bodies.h"
#include "tests/support/strands.h"

#include <fenv.h>
#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static float position[3][3], normal[3][3], uv[3][2], tangent[1][3][3];
static uint32_t triangle_index[1][3] = {{0, 1, 2}};

static struct geom_shape random_triangle(struct dice *d, bool smooth, bool with_uv)
{
	for (int m = 0; m < 3; m++)
		for (int i = 0; i < 3; i++) {
			position[m][i] = (float)dice_between(d, -1, 1);
			normal[m][i] = (float)(dice_between(d, -0.5, 0.5));
			if (i < 2)
				uv[m][i] = (float)dice_uniform(d);
		}
	vec3 v[3];
	for (int m = 0; m < 3; m++)
		v[m] = (vec3){(double)position[m][0], (double)position[m][1], (double)position[m][2]};
	vec3 ng = vec3_normalize(vec3_cross(vec3_sub(v[1], v[0]), vec3_sub(v[2], v[0])));
	for (int m = 0; m < 3; m++) {
		normal[m][0] += (float)ng.x;
		normal[m][1] += (float)ng.y;
		normal[m][2] += (float)ng.z;
	}
	return (struct geom_shape){.vertex_count = 3,
				   .triangle_count = 1,
				   .position = position,
				   .index = triangle_index,
				   .normal = smooth ? normal : NULL,
				   .uv = with_uv ? uv : NULL};
}

/* Adds tangents that turn by up to a radian between corners. */
static struct geom_shape add_random_tangents(struct geom_shape s, struct dice *d)
{
	vec3 along = vec3_normalize((vec3){(double)(position[1][0] - position[0][0]),
					   (double)(position[1][1] - position[0][1]),
					   (double)(position[1][2] - position[0][2])});
	for (int m = 0; m < 3; m++) {
		vec3 t = vec3_normalize(vec3_madd(along, 0.5, dice_direction(d)));
		memcpy(tangent[0][m], (float[3]){(float)t.x, (float)t.y, (float)t.z}, sizeof tangent[0][m]);
	}
	s.tangent = tangent;
	return s;
}

/* Returns an instance of the shape: turned, unevenly scaled, and mirrored every other time. */
static struct geom_shape random_placement(struct geom_shape s, struct dice *d)
{
	static struct placement place;
	static uint32_t turned[1][3] = {{0, 2, 1}};
	mat4 m = mat4_mul(mat4_rotate(dice_direction(d), dice_between(d, 0, 360)),
			  mat4_scale((vec3){dice_between(d, 0.5, 2) * (dice_uniform(d) < 0.5 ? -1 : 1),
					    dice_between(d, 0.5, 2), dice_between(d, 0.5, 2)}));
	for (int i = 0; i < 3; i++)
		m.m[i][3] = dice_between(d, -1, 1);
	assert_true(placement_make(&place, &m, (vec3){-1, -1, -1}, (vec3){1, 1, 1}));
	s.placement = &place;
	if (place.is_mirrored)
		s.index = turned;
	return s;
}

/* Waves as relief: the gradient and second derivatives of a height; wave_normal() gives a normal. */
static void wave_height(const void *data, double u, double v, struct relief_sample *out)
{
	const double *a = data;
	double s = a[0] * sin(a[1] * u + a[2] * v), c = a[0] * cos(a[1] * u + a[2] * v);
	out->x = (vec3){a[1] * c, a[2] * c, 0};
	out->du = (vec3){-a[1] * a[1] * s, -a[1] * a[2] * s, 0};
	out->dv = (vec3){-a[1] * a[2] * s, -a[2] * a[2] * s, 0};
}

static void wave_normal(const void *data, double u, double v, struct relief_sample *out)
{
	const double *a = data;
	double x = a[1] * u + a[2] * v;
	out->x = (vec3){a[0] * sin(x), a[0] * cos(2 * x), 1 + a[0] * sin(3 * x)};
	vec3 d = {a[0] * cos(x), -2 * a[0] * sin(2 * x), 3 * a[0] * cos(3 * x)};
	out->du = vec3_scale(a[1], d);
	out->dv = vec3_scale(a[2], d);
}

static double wave_parameters[3];
enum { RELIEFS = 7 };
static const struct relief reliefs[RELIEFS] = {
	{.kind = RELIEF_HEIGHT, .eval = wave_height, .data = wave_parameters},
	{.kind = RELIEF_NORMAL, .eval = wave_normal, .data = wave_parameters},
	{.kind = RELIEF_NORMAL, .eval = wave_normal, .data = wave_parameters, .uses_handedness = true},
	{.kind = RELIEF_HEIGHT, .eval = wave_height, .data = wave_parameters, .base = &reliefs[1]},
	{.kind = RELIEF_NORMAL, .eval = wave_normal, .data = wave_parameters, .base = &reliefs[0]},
	{.kind = RELIEF_HEIGHT, .eval = wave_height, .data = wave_parameters, .base = &reliefs[0]},
	{.kind = RELIEF_NORMAL, .eval = wave_normal, .data = wave_parameters, .base = &reliefs[3]},
};

static struct geom_shape shape_with_relief(struct geom_shape s, struct dice *d, int kind)
{
	wave_parameters[0] = dice_between(d, 0.02, 0.2);
	wave_parameters[1] = dice_between(d, -3, 3);
	wave_parameters[2] = dice_between(d, -3, 3);
	s.relief = &reliefs[kind];
	s.unit = dice_between(d, 0.5, 1);
	return s;
}

static struct geom_shape random_sphere(struct dice *d)
{
	struct geom_shape s = {.is_sphere = true,
			       .center = dice_direction(d),
			       .radius = dice_between(d, 0.1, 2),
			       .normal_sign = dice_uniform(d) < 0.5 ? -1 : 1};
	s.sphere_axes = frame_around(dice_direction(d));
	return s;
}

/* A cone with its end spheres; if smooth, with tangents that deviate from smooth ones by up to half a radian. */
static struct geom_shape random_curve(struct dice *d, bool smooth)
{
	static struct strand strand;
	strand_make_random(&strand, 2, 0, (const double[]){0.5, 1}, (const double[]){0.1, 0.6}, d);
	strand.v[1] = (float)dice_between(d, 0.1, 1);
	if (smooth)
		strand_set_tangents(&strand, 0.5, d);
	return (struct geom_shape){.curves = &strand.curves, .normal_sign = dice_uniform(d) < 0.5 ? -1 : 1};
}

/* Finds a random point of the curve, but not so near the poles that the meridians turn within the steps of the
 * differences, nor where these steps would cross from one part to another. */
static bool find_curve_point(const struct geom_shape *s, struct dice *d, struct surface_point *x)
{
	double along = dice_between(d, -1.5, 2.5), around = dice_between(d, -M_PI, M_PI);
	if (fabs(along) < 0.01 || fabs(along - 1) < 0.01)
		return false;
	return surface_on_curve(s, (struct prim_ref){0, 0, 0}, along, around, x) &&
	       vec3_length(vec3_cross(x->ng, curves_cone(s->curves, 0).axis)) > 0.1;
}

/* Returns the point at the distance h along t, as the surface itself computes it. */
static struct surface_point point_moved_along(const struct geom_shape *s, const struct surface_point *x, vec3 t,
					      double h)
{
	struct surface_point y;
	vec3 p = vec3_madd(x->p, h, t);
	if (s->is_sphere) {
		surface_on_sphere(s, x->prim, vec3_normalize(vec3_sub(p, s->center)), &y);
		return y;
	}
	if (s->curves) {
		enum cone_part part = x->b1 < 0 ? CONE_START : x->b1 > 1 ? CONE_END : CONE_SIDE;
		struct cone c = curves_cone(s->curves, 0);
		struct curve_coordinates coordinates = curves_coordinates(&c, part, p);
		assert_true(surface_on_curve(s, x->prim, coordinates.along, coordinates.around, &y));
		return y;
	}
	vec3 o = vec3_add(p, x->ng);
	struct ray_hit hit = {.prim = x->prim, .t = 1};
	surface_from_hit(s, o, vec3_neg(x->ng), &hit, &y);
	return y;
}

static double relative_distance(vec3 a, vec3 b, double scale)
{
	return vec3_length(vec3_sub(a, b)) / fmax(scale, 1);
}

static double compare_with_differences(const struct geom_shape *s, const struct surface_point *x)
{
	struct surface_derivatives c;
	surface_compute_derivatives(s, x, &c);
	assert_true(fabs(vec3_length(c.du) - 1) < 4 * DBL_EPSILON && fabs(vec3_length(c.dv) - 1) < 4 * DBL_EPSILON);
	assert_true(fabs(vec3_dot(c.du, c.dv)) < 16 * DBL_EPSILON && fabs(vec3_dot(c.du, x->ng)) < 16 * DBL_EPSILON);
	vec3 level = vec3_madd(x->axis, -vec3_dot(x->axis, x->ng), x->ng);
	assert_true(vec3_dot(c.du, level) > 0.999999 * vec3_length(level));
	assert_true(relative_distance(c.axis, vec3_normalize(x->axis), 1) < 1e-7);
	assert_true(vec3_dot(vec3_cross(c.du, c.dv), x->ng) > 0.999999);
	double worst = 0, scale = fmax(fmax(vec3_length(c.dn[0]), vec3_length(c.dn[1])), vec3_length(c.daxis[0]));
	for (int i = 0; i < 2; i++) {
		vec3 t = i ? c.dv : c.du, dn[2], daxis[2];
		/* The normal stays a unit vector. */
		assert_true(fabs(vec3_dot(c.dn[i], x->sh.n)) < 1e-12 * fmax(scale, 1));
		for (int half = 0; half < 2; half++) {
			double h = (half ? 1e-5 : 2e-5) / fmax(scale, 1);
			struct surface_point up = point_moved_along(s, x, t, h), down = point_moved_along(s, x, t, -h);
			dn[half] = vec3_scale(0.5 / h, vec3_sub(up.sh.n, down.sh.n));
			daxis[half] = vec3_scale(0.5 / h, vec3_sub(vec3_normalize(up.axis), vec3_normalize(down.axis)));
		}
		vec3 n = vec3_madd(vec3_scale(4.0 / 3, dn[1]), -1.0 / 3, dn[0]),
		     a = vec3_madd(vec3_scale(4.0 / 3, daxis[1]), -1.0 / 3, daxis[0]);
		worst = fmax(worst,
			     fmax(relative_distance(n, c.dn[i], scale), relative_distance(a, c.daxis[i], scale)));
	}
	return worst;
}

static void derivatives_agree_with_differences(void **state)
{
	(void)state;
	struct dice d = dice_for_test("changes of surface points");
	/* The first kinds are triangles: flat, without and with uv; smooth, without and with uv, and with tangents.
	 * Then a sphere, and curves with the normals of their cones and with smooth ones. */
	enum { TANGENTS = 4, SPHERE, CURVE, SMOOTH_CURVE, KINDS };
	double worst[1 + RELIEFS][KINDS] = {{0}};
	uint32_t counts[KINDS] = {0};
	for (size_t i = 0; i < dice_scaled_count(32000); i++) {
		int kind = (int)(i % KINDS), relief = (int)(i / KINDS % (1 + RELIEFS));
		bool curved = kind >= CURVE;
		struct geom_shape s = kind == SPHERE ? random_sphere(&d)
				      : curved	     ? random_curve(&d, kind == SMOOTH_CURVE)
						     : random_triangle(&d, kind >= 2, kind % 2 || kind == TANGENTS);
		if (kind == TANGENTS)
			s = add_random_tangents(s, &d);
		if (kind < SPHERE && i / (KINDS * (1 + RELIEFS)) % 2)
			s = random_placement(s, &d);
		if (relief)
			s = shape_with_relief(s, &d, relief - 1);
		struct surface_point x;
		if (curved && !find_curve_point(&s, &d, &x))
			continue;
		if (s.is_sphere)
			surface_on_sphere(&s, (struct prim_ref){0, 0, 0}, dice_direction(&d), &x);
		else if (!curved)
			surface_on_triangle(&s, (struct prim_ref){0, 0, 0}, dice_between(&d, 0.2, 0.4),
					    dice_between(&d, 0.2, 0.4), &x);
		if (!s.is_sphere && vec3_dot(x.sh.n, x.ng) < 0.1)
			continue;
		counts[kind] += curved;
		/* In slivers, the points further on would lie outside. */
		vec3 e1 = {(double)(position[1][0] - position[0][0]), (double)(position[1][1] - position[0][1]),
			   (double)(position[1][2] - position[0][2])};
		vec3 e2 = {(double)(position[2][0] - position[0][0]), (double)(position[2][1] - position[0][1]),
			   (double)(position[2][2] - position[0][2])};
		if (kind < SPHERE && vec3_length(vec3_cross(e1, e2)) < 0.05)
			continue;
		worst[relief][kind] = fmax(worst[relief][kind], compare_with_differences(&s, &x));
	}
	static const char *const name[] = {"plain",
					   "bump",
					   "normals",
					   "normals with handedness",
					   "a bump on normals",
					   "normals on a bump",
					   "a bump on a bump",
					   "normals on a bump on normals"};
	for (int relief = 0; relief <= RELIEFS; relief++) {
		const double *at = worst[relief];
		print_message("%s: flat %.1e %.1e, smooth %.1e %.1e, tangents %.1e, sphere %.1e, curve %.1e %.1e\n",
			      name[relief], at[0], at[1], at[2], at[3], at[TANGENTS], at[SPHERE], at[CURVE],
			      at[SMOOTH_CURVE]);
		/* Differences are less exact the more maps there are. */
		for (int kind = 0; kind < KINDS; kind++)
			assert_true(at[kind] < (relief < RELIEFS ? 1e-7 : 1e-6));
	}
	assert_true(counts[CURVE] > dice_scaled_count(32000) / 40 &&
		    counts[SMOOTH_CURVE] > dice_scaled_count(32000) / 40);
}

/* The bent normal is that of the displaced surface p + h n, computed by differences of its points: to first order in
 * the height on a sphere, where n turns, and exactly on a flat triangle. */
static void test_bent_normal_is_that_of_the_surface(void **state)
{
	(void)state;
	struct dice d = dice_for_test("normals of bumps");
	double worst[2] = {0};
	for (size_t i = 0; i < dice_scaled_count(2000); i++) {
		bool round = i & 1;
		struct geom_shape s =
			shape_with_relief(round ? random_sphere(&d) : random_triangle(&d, false, true), &d, 0);
		struct surface_point x;
		if (round) {
			wave_parameters[0] *= 1e-5;
			surface_on_sphere(&s, (struct prim_ref){0, 0, 0}, dice_direction(&d), &x);
		} else {
			surface_on_triangle(&s, (struct prim_ref){0, 0, 0}, dice_between(&d, 0.2, 0.4),
					    dice_between(&d, 0.2, 0.4), &x);
		}
		struct geom_shape flat = s;
		flat.relief = NULL;
		vec3 du, dv, point[2][2], t[2];
		surface_tangents(&x, &du, &dv);
		double bend = vec3_length(vec3_cross(vec3_normalize(x.axis), vec3_scale(1, du)));
		assert_true(bend < 1e-9);
		for (int k = 0; k < 2; k++) {
			for (int side = 0; side < 2; side++) {
				double h = side ? 1e-5 : -1e-5;
				struct surface_point y = point_moved_along(&flat, &x, k ? dv : du, h);
				point[k][side] =
					vec3_madd(y.p,
						  s.unit * wave_parameters[0] *
							  sin(wave_parameters[1] * y.u + wave_parameters[2] * y.v),
						  y.ng);
			}
			t[k] = vec3_sub(point[k][1], point[k][0]);
		}
		double jump = round ? vec3_length(t[0]) + vec3_length(t[1]) : 0;
		if (jump > 1e-4)
			continue; /* across the seam of u */
		vec3 n = vec3_normalize(vec3_cross(t[0], t[1]));
		double normal_shift = vec3_length(vec3_sub(x.sh.n, x.ng));
		if (vec3_dot(n, x.ng) < 0.2 || (round && vec3_length(vec3_cross(x.ng, s.sphere_axes.n)) < 0.1))
			continue;
		worst[round] =
			fmax(worst[round], vec3_length(vec3_sub(n, x.sh.n)) / (round ? fmax(normal_shift, 1e-6) : 1));
	}
	print_message("flat %.1e, sphere %.1e of the turn\n", worst[0], worst[1]);
	assert_true(worst[0] < 1e-7 && worst[1] < 1e-3);
}

static void tilted_normal(const void *data, double u, double v, struct relief_sample *out)
{
	(void)u, (void)v;
	*out = (struct relief_sample){.x = *(const vec3 *)data};
}

/* A picture on a square that faces +z, with v downwards: the normal (a, b, c) leans by a to the picture's right and
 * by b to its top. In a mirrored picture the right changes sides and the top does not. Mitsuba's frames, built from n
 * x dp/du, ignore mirroring. */
static void normal_map_leans_to_the_pictures_right_and_top(void **state)
{
	(void)state;
	static const vec3 x = {0.3, 0.4, 0.8};
	static float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, upright[3][2] = {{0, 0}, {1, 0}, {0, -1}},
		     mirrored[3][2] = {{0, 0}, {-1, 0}, {0, -1}}, turned[3][2] = {{0, 0}, {-1, 0}, {0, 1}};
	static const struct {
		float (*uv)[2];
		bool handed;
		double right, top;
	} cases[] = {{upright, false, 1, 1},  {upright, true, 1, 1},   {mirrored, false, -1, -1},
		     {mirrored, true, -1, 1}, {turned, false, -1, -1}, {turned, true, -1, -1}};
	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
		const struct relief r = {
			.kind = RELIEF_NORMAL, .eval = tilted_normal, .data = &x, .uses_handedness = cases[k].handed};
		const struct geom_shape s = {.vertex_count = 3,
					     .triangle_count = 1,
					     .position = corners,
					     .index = triangle_index,
					     .uv = cases[k].uv,
					     .relief = &r,
					     .unit = 1};
		struct surface_point p;
		surface_on_triangle(&s, (struct prim_ref){0, 0, 0}, 0.3, 0.3, &p);
		vec3 expected = vec3_normalize((vec3){cases[k].right * x.x, cases[k].top * x.y, x.z});
		assert_true(vec3_length(vec3_sub(p.sh.n, expected)) < 1e-15);
	}
}

/* Straight slopes a of one map and b of one inside it, along u: the first turns the normal by atan(a), and the other,
 * whose tangent has shrunk to cos atan(a), by atan(b / cos atan(a)) more. A normal map inside another turns its frame.
 */
static void slope(const void *data, double u, double v, struct relief_sample *out)
{
	(void)u, (void)v;
	*out = (struct relief_sample){.x = {*(const double *)data, 0, 0}};
}

static void test_one_relief_on_another(void **state)
{
	(void)state;
	static float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, texture[3][2] = {{0, 0}, {1, 0}, {0, -1}};
	static const double a = 0.4, b = -0.7;
	static const vec3 lean = {0.3, -0.2, 0.9}, lean2 = {-0.1, 0.5, 0.6};
	const struct relief low = {.kind = RELIEF_HEIGHT, .eval = slope, .data = &a};
	const struct relief low_normal = {.kind = RELIEF_NORMAL, .eval = tilted_normal, .data = &lean};
	const struct relief high = {.kind = RELIEF_HEIGHT, .eval = slope, .data = &b, .base = &low};
	const struct relief high_normal = {
		.kind = RELIEF_NORMAL, .eval = tilted_normal, .data = &lean2, .base = &low_normal};
	struct geom_shape s = {.vertex_count = 3,
			       .triangle_count = 1,
			       .position = corners,
			       .index = triangle_index,
			       .uv = texture,
			       .relief = &high,
			       .unit = 1};
	struct surface_point p;
	surface_on_triangle(&s, (struct prim_ref){0, 0, 0}, 0.3, 0.3, &p);
	double turn = atan(a) + atan(b / cos(atan(a)));
	assert_true(vec3_length(vec3_sub(p.sh.n, (vec3){-sin(turn), 0, cos(turn)})) < 1e-15);
	s.relief = &high_normal;
	surface_on_triangle(&s, (struct prim_ref){0, 0, 0}, 0.3, 0.3, &p);
	vec3 n = vec3_normalize(lean), t = vec3_normalize(vec3_madd((vec3){1, 0, 0}, -n.x, n)),
	     across = vec3_cross(n, t);
	vec3 want = vec3_normalize(vec3_madd(vec3_madd(vec3_scale(lean2.x, t), lean2.y, across), lean2.z, n));
	assert_true(vec3_length(vec3_sub(p.sh.n, want)) < 1e-15);
}

static void assert_finite(const struct geom_shape *s, const struct surface_point *x)
{
	struct surface_derivatives c;
	feclearexcept(FE_INVALID);
	surface_compute_derivatives(s, x, &c);
	assert_false(fetestexcept(FE_INVALID));
	for (int i = 0; i < 2; i++)
		assert_true(vec3_is_finite(c.dn[i]) && vec3_is_finite(c.daxis[i]));
	assert_true(fabs(vec3_length(c.du) - 1) < 1e-12 && fabs(vec3_length(c.dv) - 1) < 1e-12);
}

static void degenerate_shapes_have_finite_derivatives(void **state)
{
	(void)state;
	struct dice d = dice_for_test("changes of degenerate surfaces");
	struct surface_point x;
	struct surface_derivatives c;
	/* At the poles, and as near to them as double can represent. */
	for (int i = 0; i < 400; i++) {
		struct geom_shape s = random_sphere(&d);
		s.sphere_axes = frame_around((vec3){0, 0, i & 1 ? 1 : -1});
		if (i % 3)
			s = shape_with_relief(s, &d, i % 3 - 1);
		double off_axis = i < 4 ? 0 : exp(dice_between(&d, -740, 0));
		surface_on_sphere(&s, (struct prim_ref){0, 0, 0}, vec3_normalize((vec3){off_axis, 0, i & 2 ? 1 : -1}),
				  &x);
		assert_finite(&s, &x);
	}
	for (int i = 0; i < 400; i++) {
		struct geom_shape s = random_triangle(&d, true, true);
		/* Degenerate or huge uv, slivers down to the limit of floats, and normals that turn away or vanish. */
		for (int m = 0; m < 3; m++) {
			uv[m][0] = i % 3 ? 1e30f * uv[m][0] : 0.25f;
			position[m][1] =
				position[m][0] + (i % 5 ? 0 : position[m][1] * (float)exp(dice_between(&d, -70, 0)));
			normal[m][2] = i % 7 ? normal[m][2] : 0;
		}
		if (i % 11 == 0)
			memset(normal, 0, sizeof normal);
		if (i % 2)
			s = shape_with_relief(s, &d, i / 2 % 2);
		surface_on_triangle(&s, (struct prim_ref){0, 0, 0}, 0.3, 0.3, &x);
		if (!vec3_is_finite(x.ng))
			continue; /* no area: the reader drops such triangles */
		assert_finite(&s, &x);
	}
	/* With a flat shading normal nothing turns. */
	struct geom_shape s = random_triangle(&d, true, true);
	for (int m = 0; m < 3; m++)
		for (int i = 0; i < 3; i++)
			normal[m][i] = -normal[m][i];
	surface_on_triangle(&s, (struct prim_ref){0, 0, 0}, 0.3, 0.3, &x);
	surface_compute_derivatives(&s, &x, &c);
	assert_true(vec3_length(c.dn[0]) == 0 && vec3_length(c.dn[1]) == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(derivatives_agree_with_differences),
		cmocka_unit_test(test_bent_normal_is_that_of_the_surface),
		cmocka_unit_test(normal_map_leans_to_the_pictures_right_and_top),
		cmocka_unit_test(test_one_relief_on_another),
		cmocka_unit_test(degenerate_shapes_have_finite_derivatives),
	};
	return cmocka_run_group_tests_name("change", tests, NULL, NULL);
}
