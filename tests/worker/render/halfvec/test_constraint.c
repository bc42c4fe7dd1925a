/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A, B, C and h against differences of the half vector with 113 bits (quad.h): the error is at most max(1e-12, 100
 * eps x condition), with the condition found by shaking every number of the problem by a rounding in extended
 * precision; and at most 1e-9 wherever the condition is below 1e4. Errors are relative to the largest entry of each
 * matrix. HSLT_TEST_ROWS=1 prints one row per case.
 *
 * The chain identity ties all of these together: prod G / |det dh/dx| = G(x_0, x_1) |det dx_1/dx_k| prod |d omega_j /
 * d h_j|.
 */
#include "tests/worker/render/halfvec/quad.h"
#include "worker/render/halfvec/constraint_system.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum inner { FLAT, SMOOTH, CURVED, SLIVER, BALL, BALL_INVERTED, POLE };
enum end { ON_TRIANGLE, ON_BALL, AT_INFINITY, ON_EMITTER, POINT_EMITTER, CAMERA };
enum { MATCHED = -1 }; /* value of eta for matched indices */

struct corner_case {
	const char *name;
	enum inner inner;
	double eta[2];		  /* n_o / n_i, drawn uniformly from this range; 0: reflection */
	double slope[2];	  /* |h|, drawn log-uniformly from this range */
	double normal_deviation;  /* approximate distance of the shading normal from the geometric one */
	double normal_derivative; /* |dn| per length */
	enum end light, camera;
	enum hand_uv uv;
	double critical_margin; /* 1 - sin(angle) / sin(critical angle) where not 0 */
};

static const struct corner_case corner_cases[] = {
	{"reflection, flat triangles", FLAT, {0}, {1e-3, 1}, 0, 0, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"reflection, interpolated normals", SMOOTH, {0}, {1e-3, 1}, 0.35, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"reflection, without uv", SMOOTH, {0}, {1e-3, 1}, 0.35, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV_NONE, 0},
	{"reflection, degenerate uv", SMOOTH, {0}, {1e-3, 1}, 0.35, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV_DEGENERATE, 0},
	{"reflection, tangents", SMOOTH, {0}, {1e-3, 1}, 0.35, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_TANGENTS, 0},
	{"into glass, tangents", SMOOTH, {1.5, 1.5}, {1e-3, 1}, 0.35, 1, AT_INFINITY, CAMERA, HAND_TANGENTS, 0},
	{"reflection, spheres", BALL, {0}, {1e-3, 1}, 0, 0, ON_BALL, ON_BALL, HAND_UV, 0},
	{"reflection, inside a sphere", BALL_INVERTED, {0}, {1e-3, 1}, 0, 0, ON_BALL, ON_TRIANGLE, HAND_UV, 0},
	{"into glass, interpolated normals",
	 SMOOTH,
	 {1.5, 1.5},
	 {1e-3, 1},
	 0.35,
	 1,
	 ON_TRIANGLE,
	 ON_TRIANGLE,
	 HAND_UV,
	 0},
	{"out of glass, interpolated normals",
	 SMOOTH,
	 {1 / 1.5, 1 / 1.5},
	 {1e-3, 1},
	 0.35,
	 1,
	 ON_TRIANGLE,
	 ON_TRIANGLE,
	 HAND_UV,
	 0},
	{"into a glass sphere", BALL, {1.5, 1.5}, {1e-3, 1}, 0, 0, ON_TRIANGLE, ON_BALL, HAND_UV, 0},
	{"out of a glass sphere", BALL_INVERTED, {1 / 1.5, 1 / 1.5}, {1e-3, 1}, 0, 0, ON_BALL, ON_TRIANGLE, HAND_UV, 0},
	{"matched, flat", FLAT, {MATCHED}, {1e-3, 1}, 0, 0, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"matched, interpolated normals", SMOOTH, {MATCHED}, {1e-3, 1}, 0.35, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"matched, sphere", BALL, {MATCHED}, {1e-3, 1}, 0, 0, ON_TRIANGLE, CAMERA, HAND_UV, 0},
	{"light at infinity, camera", SMOOTH, {0}, {1e-3, 1}, 0.35, 1, AT_INFINITY, CAMERA, HAND_UV, 0},
	{"light at infinity through glass", BALL, {1 / 1.5, 1 / 1.5}, {1e-3, 1}, 0, 0, AT_INFINITY, CAMERA, HAND_UV, 0},
	{"point on an area emitter", SMOOTH, {0}, {1e-3, 1}, 0.35, 1, ON_EMITTER, CAMERA, HAND_UV, 0},
	{"point emitter", SMOOTH, {1.5, 1.5}, {1e-3, 1}, 0.35, 1, POINT_EMITTER, CAMERA, HAND_UV, 0},
	{"grazing, |h| to 1e2", SMOOTH, {0}, {10, 1e2}, 0.2, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"grazing, |h| to 1e4", SMOOTH, {0}, {1e2, 1e4}, 0.2, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"grazing sphere, |h| to 1e4", BALL, {0}, {1e2, 1e4}, 0, 0, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"eta 1 + 1e-6", SMOOTH, {1 + 1e-6, 1 + 1e-6}, {1e-3, 1}, 0.2, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"eta 1 + 1e-6, |h| to 900",
	 SMOOTH,
	 {1 + 1e-6, 1 + 1e-6},
	 {10, 900},
	 0.2,
	 1,
	 ON_TRIANGLE,
	 ON_TRIANGLE,
	 HAND_UV,
	 0},
	{"eta 1 - 1e-6", SMOOTH, {1 - 1e-6, 1 - 1e-6}, {1e-3, 1}, 0.2, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"eta 1 +- 1e-4", SMOOTH, {1 - 1e-4, 1 + 1e-4}, {1e-3, 10}, 0.2, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"eta 1 +- 1e-2", BALL, {1 - 1e-2, 1 + 1e-2}, {1e-3, 10}, 0, 0, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"near total reflection, 1e-3",
	 SMOOTH,
	 {1 / 1.5, 1 / 1.5},
	 {1e-3, 1},
	 0.2,
	 1,
	 ON_TRIANGLE,
	 ON_TRIANGLE,
	 HAND_UV,
	 1e-3},
	{"near total reflection, 1e-8",
	 SMOOTH,
	 {1 / 1.5, 1 / 1.5},
	 {1e-3, 1},
	 0.2,
	 1,
	 ON_TRIANGLE,
	 ON_TRIANGLE,
	 HAND_UV,
	 1e-8},
	{"strongly curved, radius 1e-3 edge", CURVED, {0}, {1e-3, 1}, 0.2, 1e3, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"nearly flat, radius 1e6 edge", CURVED, {1.5, 1.5}, {1e-3, 1}, 0, 1e-6, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"pole of a sphere, 1e-3", POLE, {0}, {1e-3, 1}, 0, 1e-3, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"pole of a sphere, 1e-7", POLE, {1.5, 1.5}, {1e-3, 1}, 0, 1e-7, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"slivers", SLIVER, {0}, {1e-3, 1}, 0.2, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV, 0},
	{"slivers without uv, glass", SLIVER, {1.5, 1.5}, {1e-3, 1}, 0.2, 1, ON_TRIANGLE, ON_TRIANGLE, HAND_UV_NONE, 0},
};

static double draw_log_uniform(struct dice *d, const double range[2])
{
	return exp(dice_between(d, log(range[0]), log(range[1])));
}

/* Finds directions towards light and camera around the shading normal n with the requested |h|. Returns false if no
 * such refraction exists. */
static bool find_directions(const struct corner_case *c, double eta, vec3 n, struct dice *d, vec3 *i, vec3 *o)
{
	double slope = draw_log_uniform(d, c->slope);
	vec3 across = hand_random_tangent(d, n), half = vec3_normalize(vec3_madd(n, slope, across));
	*i = dice_direction(d);
	if (eta == MATCHED) {
		*o = vec3_normalize(vec3_madd(vec3_neg(*i), 0.3, dice_direction(d)));
		return fabs(vec3_dot(*i, n)) > 0.05;
	}
	double cosine = vec3_dot(*i, half);
	if (eta == 0) {
		*o = vec3_madd(vec3_neg(*i), 2 * cosine, half);
		return fabs(cosine) > 0.05;
	}
	if (c->critical_margin != 0) {
		double sine = eta * (1 - c->critical_margin);
		cosine = sqrt(1 - sine * sine);
		*i = vec3_madd(vec3_scale(cosine, half), sine, hand_random_tangent(d, half));
	}
	if (cosine < 0) {
		half = vec3_neg(half);
		cosine = -cosine;
	}
	double k = 1 - (1 - cosine * cosine) / (eta * eta);
	if (!(k > 0) || cosine < 0.05)
		return false;
	*o = vec3_normalize(vec3_madd(vec3_scale(-1 / eta, *i), -(sqrt(k) - cosine / eta), half));
	return true;
}

static void place_end(struct hand *h, unsigned j, enum end kind, vec3 p, vec3 direction, struct dice *d)
{
	const struct hand_triangle t = {.size = 0.2, .aspect = 1, .bend = 1, .uv = HAND_UV};
	vec3 n = dice_direction(d);
	switch (kind) {
	case ON_TRIANGLE:
		hand_triangle(h, j, p, n, n, &t, d);
		break;
	case ON_BALL:
		hand_place_sphere(h, j, p, n, dice_between(d, 0.05, 1), 1, dice_between(d, 0.3, 2.8), d);
		break;
	case AT_INFINITY:
		hand_place_infinite(h, direction);
		break;
	case ON_EMITTER:
		hand_place_emitter(h, p, n);
		break;
	case POINT_EMITTER:
		hand_place_emitter(h, p, (vec3){0, 0, 0});
		break;
	case CAMERA:
		hand_place_camera(h, j, p);
		break;
	}
}

static bool make_chain(const struct corner_case *c, struct hand *h, struct dice *d)
{
	double eta = c->eta[0] == MATCHED ? MATCHED : dice_between(d, c->eta[0], fmax(c->eta[0], c->eta[1]));
	vec3 n = dice_direction(d), i, o, p = vec3_scale(0.1, dice_direction(d));
	if (!find_directions(c, eta, n, d, &i, &o))
		return false;
	hand_begin(h, 2);
	if (c->inner >= BALL) {
		double polar = c->inner == POLE ? c->normal_derivative : dice_between(d, 0.2, 2.9);
		hand_place_sphere(h, 1, p, n, dice_between(d, 0.02, 1), c->inner == BALL_INVERTED ? -1 : 1, polar, d);
	} else {
		double edge = 0.2;
		struct hand_triangle t = {edge, c->inner == SLIVER ? 1e-4 : 1, c->inner == FLAT,
					  c->normal_derivative / edge, c->uv};
		if (c->inner == SMOOTH || c->inner == SLIVER)
			t.bend = c->normal_derivative;
		vec3 ng = vec3_normalize(vec3_madd(n, c->normal_deviation * dice_uniform(d), dice_direction(d)));
		hand_triangle(h, 1, p, c->inner == FLAT ? n : ng, n, &t, d);
	}
	p = h->x.v[1].x.p;
	place_end(h, 0, c->light, vec3_madd(p, dice_between(d, 0.1, 0.7), i), i, d);
	place_end(h, 2, c->camera, vec3_madd(p, dice_between(d, 0.1, 0.7), o), o, d);
	hand_compute_edges(h);
	hand_set_scattering(h, 1, eta == MATCHED ? 1 : eta);
	return true;
}

/* Returns the largest difference, relative to the largest expected entry. */
static double max_relative_difference(const quad *expected, const double *actual, unsigned n)
{
	quad largest = 0, error = 0;
	for (unsigned i = 0; i < n; i++) {
		largest = fmaxl((long double)largest, (long double)q_abs(expected[i]));
		error = fmaxl((long double)error, (long double)q_abs(expected[i] - (quad)actual[i]));
	}
	return (double)(error / largest);
}

static double relative_difference(const quad *a, const quad *b, unsigned n)
{
	quad largest = 0, error = 0;
	for (unsigned i = 0; i < n; i++) {
		largest = fmaxl((long double)largest, (long double)q_abs(a[i]));
		error = fmaxl((long double)error, (long double)q_abs(a[i] - b[i]));
	}
	return (double)(error / largest) / 0x1p-53;
}

struct max_errors {
	double ratio, error, bound, condition,
		well_conditioned_error; /* well_conditioned_error: the largest error where the condition is below 1e4 */
};

/* Returns a step that is small compared with all distances nearby, so that the differences are exact far beyond
 * double. */
static double difference_step(const struct hand *h)
{
	struct surface_derivatives c;
	double l = 1;
	for (unsigned j = 0; j < 3; j++) {
		if (h->x.v[j].kind == VERTEX_SURFACE) {
			surface_compute_derivatives(&h->shape[j], &h->x.v[j].x, &c);
			double bend = fmax(fmax(vec3_length(c.dn[0]), vec3_length(c.dn[1])), vec3_length(c.daxis[0]));
			l = fmin(l, 1 / fmax(bend, 1));
		}
		if (j < 2)
			l = fmin(l, sqrt(h->x.edge[j].distance2));
	}
	vec3 sum = vec3_sub(vec3_scale(full_path_eta(&h->x, 1), h->x.edge[1].w), h->x.edge[0].w);
	return 1e-8 * l * fmin(fabs(vec3_dot(sum, h->x.v[1].x.sh.n)), 1);
}

static void compare_derivatives(const struct hand *h, struct dice *d, struct max_errors *w)
{
	struct constraint k[3];
	struct quad_problem q = quad_problem_from_hand(h, 1);
	quad hv[2], m[3][4];
	double step = difference_step(h);
	constraints_compute(&h->w, &h->x, 2, 0, k);
	quad_derivatives(&q, step, hv, m);
	double condition[4] = {0};
	for (int i = 0; i < 4; i++) {
		struct quad_problem shaken = quad_problem_perturbed(&q, d);
		quad sh[2], sm[3][4];
		quad_derivatives(&shaken, step, sh, sm);
		for (int v = 0; v < 3; v++)
			condition[v] = fmax(condition[v], relative_difference(m[v], sm[v], 4));
		condition[3] = fmax(condition[3], relative_difference(hv, sh, 2));
	}
	const double *actual[4] = {&k[1].a.xx, &k[1].b.xx, &k[1].c.xx, &k[1].h.x};
	const quad *expected[4] = {m[0], m[1], m[2], hv};
	for (int v = 0; v < 4; v++) {
		double error = max_relative_difference(expected[v], actual[v], v == 3 ? 2 : 4),
		       bound = fmax(1e-12, 100 * 0x1p-53 * condition[v]);
		if (!(error / bound <= w->ratio))
			*w = (struct max_errors){error / bound, error, bound, condition[v], w->well_conditioned_error};
		if (condition[v] < 1e4 && !(error <= w->well_conditioned_error))
			w->well_conditioned_error = error;
	}
	vec2 alone = halfvec_of(&h->x, 1);
	assert_true(alone.x == k[1].h.x && alone.y == k[1].h.y);
}

static void derivatives_agree_in_corner_cases(void **state)
{
	(void)state;
	bool rows = getenv("HSLT_TEST_ROWS") != NULL, all_passed = true;
	double worst_ratio = 0;
	for (size_t i = 0; i < sizeof corner_cases / sizeof *corner_cases; i++) {
		struct dice d = dice_for_test(corner_cases[i].name);
		struct max_errors w = {0};
		static struct hand h;
		for (size_t made = 0; made < dice_scaled_count(60);) {
			if (!make_chain(&corner_cases[i], &h, &d))
				continue;
			made++;
			compare_derivatives(&h, &d, &w);
		}
		bool ok = w.ratio <= 1 && w.well_conditioned_error <= 1e-9;
		all_passed = all_passed && ok;
		worst_ratio = fmax(worst_ratio, w.ratio);
		if (rows || !ok)
			printf("constraint\t%s\t%.2e\t%.2e\t%s\n", corner_cases[i].name, w.error, w.bound,
			       ok ? "ok" : "FAILED");
	}
	print_message("largest error over its bound: %.2g, %zu cases\n", worst_ratio,
		      sizeof corner_cases / sizeof *corner_cases);
	assert_true(all_passed);
}

/* Returns |d omega_i / d h_par| |cosine at the shading normal| for the direction i from which light comes (see the
 * design of bsdf_eval_halfvec): solid angle of i per area of slopes. */
static double solid_angle_per_slope(const struct hand *h, unsigned j)
{
	vec3 i = vec3_neg(h->x.edge[j - 1].w), o = h->x.edge[j].w, n = h->x.v[j].x.sh.n;
	double eta = full_path_eta(&h->x, j);
	vec3 half = vec3_normalize(vec3_madd(i, eta, o));
	double hn = fabs(vec3_dot(half, n)), ih = vec3_dot(i, half), oh = vec3_dot(o, half);
	double per_half = h->x.v[j].mode == BSDF_REFLECT ? 4 * fabs(ih) : (ih + eta * oh) * (ih + eta * oh) / fabs(ih);
	return per_half * hn * hn * hn;
}

static double geometry_term(const struct hand *h, unsigned e)
{
	vec3 w = h->x.edge[e].w;
	return fabs(vec3_dot(h->x.v[e].x.ng, w) * vec3_dot(h->x.v[e + 1].x.ng, w)) / h->x.edge[e].distance2;
}

/* Compares the logarithms of both sides; 1e-9 bounds the rounding of double in the worst of some thousand random
 * chains. The chain is followed from the camera's end: x_start = x_k, first inner vertex x_{k-1}, far end x_0. */
static void transfer_equals_the_product_of_geometry_terms(void **state)
{
	(void)state;
	struct dice d = dice_for_test("the chain identity");
	double worst[2] = {0, 0};
	static struct hand h;
	static struct constraint k[FULL_PATH_VERTICES_MAX];
	static struct constraint_system m;
	for (unsigned bent = 0; bent < 2; bent++) {
		for (size_t made = 0; made < dice_scaled_count(600);) {
			unsigned edges = 2 + dice_below(&d, 6);
			if (!hand_make_chain(&h, edges, bent ? 0.2 : 0, &d))
				continue;
			made++;
			constraints_compute(&h.w, &h.x, edges, 0, k);
			if (constraint_double.factor(k, edges, 0, &m) != CONSTRAINT_OK)
				continue;
			double left = -m.log_det, right = log(geometry_term(&h, edges - 1)) + m.log_transfer;
			for (unsigned e = 0; e < edges; e++)
				left += log(geometry_term(&h, e));
			/* The cosines in G and in the projected solid angle are those of the geometric normal. */
			for (unsigned j = 1; j < edges; j++)
				right += log(fabs(vec3_dot(h.x.v[j].x.ng, h.x.edge[j - 1].w)) *
					     solid_angle_per_slope(&h, j));
			worst[bent] = fmax(worst[bent], fabs(left - right));
		}
	}
	print_message("chain identity: %.1e on spheres, %.1e on triangles with n != ng\n", worst[0], worst[1]);
	assert_true(worst[0] < 1e-9 && worst[1] < 1e-9);
}

/* Degenerate derivatives: the constraints contain no infinity besides h, no operation is invalid, and the system
 * reports that it is singular. */
static void degenerate_derivatives_are_singular_without_invalid_operations(void **state)
{
	(void)state;
	struct dice d = dice_for_test("degenerate constraints");
	static struct hand h;
	static struct constraint k[3];
	static struct constraint_system m;
	const struct hand_triangle t = {.size = 0.2, .aspect = 1, .bend = 1, .uv = HAND_UV};
	/* The directions of a reflection are opposite to each other, so that the half vector lies in the plane. */
	hand_begin(&h, 2);
	hand_triangle(&h, 1, (vec3){0, 0, 0}, (vec3){0, 0, 1}, (vec3){0, 0, 1}, &t, &d);
	hand_triangle(&h, 0, vec3_add(h.x.v[1].x.p, (vec3){0.5, 0, 0.25}), (vec3){0, 0, 1}, (vec3){0, 0, 1}, &t, &d);
	hand_place_camera(&h, 2, vec3_sub(vec3_scale(2, h.x.v[1].x.p), h.x.v[0].x.p));
	hand_compute_edges(&h);
	h.x.edge[1].w = h.x.edge[0].w;
	constraints_compute(&h.w, &h.x, 2, 0, k);
	assert_true(isinf(k[1].h.x) && isinf(k[1].h.y));
	assert_true(k[1].b.xx == 0 && k[1].b.xy == 0 && k[1].b.yx == 0 && k[1].b.yy == 0);
	assert_int_equal(constraint_double.factor(k, 2, 0, &m), CONSTRAINT_SINGULAR);
	mat2 dj[3];
	assert_int_equal(constraint_double.differentials(k, 2, 0, dj), CONSTRAINT_SINGULAR);
	/* At the pole itself every value is finite. */
	hand_place_sphere(&h, 1, (vec3){0, 0, 0}, (vec3){0, 0, 1}, 0.5, 1, 0, &d);
	h.shape[1].sphere_axes = frame_around((vec3){0, 0, 1});
	surface_on_sphere(&h.shape[1], (struct prim_ref){1, 0, 0}, (vec3){0, 0, 1}, &h.x.v[1].x);
	assert_true(vec3_length(h.x.v[1].x.axis) == 0);
	hand_place_camera(&h, 2, (vec3){-0.5, 0.1, 0.25});
	hand_compute_edges(&h);
	constraints_compute(&h.w, &h.x, 2, 0, k);
	assert_true(isfinite(mat2_norm2(k[1].a)) && isfinite(mat2_norm2(k[1].b)) && isfinite(mat2_norm2(k[1].c)));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(derivatives_agree_in_corner_cases),
		cmocka_unit_test(transfer_equals_the_product_of_geometry_terms),
		cmocka_unit_test(degenerate_derivatives_are_singular_without_invalid_operations),
	};
	return cmocka_run_group_tests_name("constraint", tests, NULL, NULL);
}
