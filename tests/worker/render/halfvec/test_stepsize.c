/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Step sizes: singular values against one-sided Jacobi rotations in long double, ray differentials against rays
 * through neighbouring film points, the density against samples; and extreme constraints, which never make a step
 * infinite or 0.
 */
#include "tests/support/stats.h"
#include "tests/worker/render/halfvec/dense.h"
#include "tests/worker/render/halfvec/hand.h"
#include "worker/render/halfvec/stepsize.h"

#include <fenv.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static struct constraint k[FULL_PATH_VERTICES_MAX];
static struct halfvec_step step[FULL_PATH_VERTICES_MAX];
static struct hand h;

/* Computes the steps with a film step of `pixels` pixels. */
static void compute_steps(unsigned b, double pixels)
{
	const struct path_context c = {.w = &h.w};
	h.w.camera.width = h.w.camera.height = pixels / 0.02;
	halfvec_compute_steps(&c, &h.x, k, b, 0, step);
}

static bool is_valid_step(const struct halfvec_step *s, double limit)
{
	double turn = s->rotation.xx * s->rotation.yy - s->rotation.xy * s->rotation.yx;
	return s->sigma[0] > 0 && s->sigma[1] > 0 && s->sigma[0] <= limit && s->sigma[1] <= limit &&
	       fabs(turn - 1) < 1e-15 * 8 && fabs(s->rotation.xx - s->rotation.yy) < 1e-300 &&
	       isfinite(halfvec_step_log_pdf(s, (vec2){0.1 * limit, -0.2 * limit}));
}

/* Returns the singular values and the left singular vector of the larger one: one rotation makes the columns of e^T
 * orthogonal. */
static void decompose_by_jacobi(mat2 e, long double s[2], long double left[2])
{
	long double a[2] = {e.xx, e.xy}, b[2] = {e.yx, e.yy}; /* rows */
	long double aa = a[0] * a[0] + a[1] * a[1], bb = b[0] * b[0] + b[1] * b[1], ab = a[0] * b[0] + a[1] * b[1];
	long double c = 1, t = 0;
	if (ab != 0) {
		long double zeta = (bb - aa) / (2 * ab);
		t = copysignl(1, zeta) / (fabsl(zeta) + sqrtl(1 + zeta * zeta));
		c = 1 / sqrtl(1 + t * t);
	}
	long double n = c * t, p[2] = {c * a[0] - n * b[0], c * a[1] - n * b[1]},
		    q[2] = {n * a[0] + c * b[0], n * a[1] + c * b[1]};
	long double lp = sqrtl(p[0] * p[0] + p[1] * p[1]), lq = sqrtl(q[0] * q[0] + q[1] * q[1]);
	bool first = lp >= lq;
	s[0] = first ? lp : lq;
	s[1] = first ? lq : lp;
	left[0] = first ? c : n;
	left[1] = first ? -n : c;
}

/* The larger singular value errs by a few roundings; the smaller one and the direction by a few roundings times the
 * factor by which the ratio of the two magnifies them. */
static void singular_values_agree_with_jacobi_rotations(void **state)
{
	(void)state;
	struct dice d = dice_for_test("singular values");
	double worst[3] = {0, 0, 0};
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		double size = exp(dice_between(&d, -200, 200)), thin = i % 3 ? 1 : exp(dice_between(&d, -12, 0));
		double a = dice_between(&d, -4, 4), b = dice_between(&d, -4, 4);
		mat2 left = {cos(a), -sin(a), sin(a), cos(a)}, right = {cos(b), -sin(b), sin(b), cos(b)};
		mat2 e = mat2_mul(mat2_mul(left, (mat2){size, 0, 0, size * thin * dice_between(&d, 0.1, 1)}), right);
		long double s[2], u[2];
		decompose_by_jacobi(e, s, u);
		struct halfvec_step r = halfvec_step_from_matrix(e, 1, (double)s[0] * 2);
		double ratio = (double)(s[1] / s[0]);
		assert_true(is_valid_step(&r, (double)s[0] * 2));
		worst[0] = fmax(worst[0], (double)fabsl(r.sigma[0] / s[0] - 1));
		if (ratio > 1e-5)
			worst[1] = fmax(worst[1], (double)fabsl(r.sigma[1] / s[1] - 1) * ratio);
		double across = (double)fabsl(u[0] * r.rotation.yx - u[1] * r.rotation.xx);
		worst[2] = fmax(worst[2], across * (1 - ratio * ratio));
	}
	print_message("larger %.1e, smaller %.1e / (ratio), direction %.1e / (1 - ratio^2)\n", worst[0], worst[1],
		      worst[2]);
	assert_true(worst[0] < 1e-15 && worst[1] < 2e-15 && worst[2] < 2e-15);
	/* Afterwards each is clipped separately, at both ends. */
	struct halfvec_step r = halfvec_step_from_matrix((mat2){3, 0, 0, 0.25}, 2, 1);
	assert_true(r.sigma[0] == 1 && r.sigma[1] == 0.5);
	r = halfvec_step_from_matrix((mat2){1, 1, 1, 1}, 0.1, 1);
	assert_true(fabs(r.sigma[0] - 0.2) < 1e-15 && r.sigma[1] > 0 && r.sigma[1] < 1e-5);
}

/* A reflection seen by the camera, on a triangle with turned and bent normals. */
static bool make_visible_reflection(struct dice *d)
{
	hand_begin(&h, 2);
	const struct hand_triangle t = {.size = 0.2, .aspect = 1, .bend = 3, .uv = HAND_UV};
	vec3 n = dice_direction(d), bent = vec3_normalize(vec3_madd(n, 0.2, dice_direction(d)));
	hand_triangle(&h, 1, vec3_scale(0.2, dice_direction(d)), n, bent, &t, d);
	hand_place_sphere(&h, 0, dice_direction(d), dice_direction(d), 0.3, 1, 1, d);
	hand_place_camera(&h, 2, (vec3){dice_between(d, -0.2, 0.2), dice_between(d, -0.2, 0.2), -1});
	h.bsdf[1].min_alpha = INFINITY;
	hand_compute_edges(&h);
	hand_set_scattering(&h, 1, dice_uniform(d) < 0.5 ? 0 : 1.5);
	vec3 sum = vec3_sub(vec3_scale(full_path_eta(&h.x, 1), h.x.edge[1].w), h.x.edge[0].w);
	return fabs(vec3_dot(sum, h.x.v[1].x.sh.n)) > 0.2 && fabs(vec3_dot(h.x.v[1].x.ng, h.x.edge[1].w)) > 0.1 &&
	       fabs(vec3_dot(h.x.v[1].x.sh.n, h.x.edge[1].w)) > 0.1;
}

/* Returns the half vector at x_1 after the film point, and x_1 with it, has moved by (x, y) pixels. */
static vec2 half_vector_at_film_offset(double x, double y)
{
	const struct camera *c = &h.w.camera;
	static struct hand moved;
	double film[2], distance = sqrt(h.x.edge[1].distance2);
	moved = h;
	moved.w.shapes = moved.shape;
	vec3 from = h.x.v[2].x.p;
	assert_true(camera_project(c, from, vec3_neg(h.x.edge[1].w), distance, &film[0], &film[1]));
	vec3 w = camera_direction(c, from, film[0] + x, film[1] + y);
	struct geom_shape *s = &moved.shape[1];
	s->position = moved.position[1];
	s->normal = moved.normal[1];
	s->uv = moved.uv[1];
	s->index = moved.index[1];
	struct ray_hit hit = {.prim = {1, 0, 0}, .t = distance};
	surface_from_hit(s, from, w, &hit, &moved.x.v[1].x);
	hand_compute_edges(&moved);
	return halfvec_of(&moved.x, 1);
}

/* Central differences of a tenth of a pixel, extrapolated once: their error is far below the tolerance of 1e-6 of the
 * largest entry. */
static void ray_differentials_agree_with_neighbouring_rays(void **state)
{
	(void)state;
	struct dice d = dice_for_test("ray differentials");
	double worst = 0;
	for (size_t made = 0; made < dice_scaled_count(300);) {
		if (!make_visible_reflection(&d))
			continue;
		made++;
		vec2 column[2];
		for (int i = 0; i < 2; i++) {
			vec2 g[2];
			for (int half = 0; half < 2; half++) {
				double s = half ? 0.05 : 0.1;
				vec2 up = half_vector_at_film_offset(i ? 0 : s, i ? s : 0),
				     down = half_vector_at_film_offset(i ? 0 : -s, i ? -s : 0);
				g[half] = vec2_scale(0.5 / s, vec2_sub(up, down));
			}
			column[i] = vec2_scale(1.0 / 3, vec2_sub(vec2_scale(4, g[1]), g[0]));
		}
		mat2 e = mat2_of_columns(column[0], column[1]);
		constraints_compute(&h.w, &h.x, 2, 0, k);
		/* a film step for which neither limit applies: then sigma and U describe e e^T */
		const double pixels = 0.25 / mat2_largest(e);
		compute_steps(2, pixels);
		double s0 = step[1].sigma[0] / pixels, s1 = step[1].sigma[1] / pixels;
		mat2 u = step[1].rotation, us = {u.xx * s0, u.xy * s1, u.yx * s0, u.yy * s1};
		mat2 made_of = mat2_mul(us, (mat2){us.xx, us.yx, us.xy, us.yy}),
		     expected = mat2_mul(e, (mat2){e.xx, e.yx, e.xy, e.yy});
		worst = fmax(worst, mat2_largest(mat2_sub(made_of, expected)) / mat2_largest(expected));
	}
	print_message("against neighbouring rays: %.1e\n", worst);
	assert_true(worst < 1e-6);
}

/* Several vertices, some of them specular: shares of the pixels by roughness, with E from the inverse of the whole
 * matrix. */
static void vertices_share_the_film_step_by_roughness(void **state)
{
	(void)state;
	struct dice d = dice_for_test("shares of the step");
	static struct dense dense;
	double worst = 0;
	for (size_t made = 0; made < dice_scaled_count(200);) {
		unsigned edges = 3 + dice_below(&d, 4);
		if (!hand_make_chain(&h, edges, 0.2, &d))
			continue;
		hand_place_camera(&h, edges, h.x.v[edges].x.p);
		h.w.camera.axes = frame_around(vec3_neg(h.x.edge[edges - 1].w));
		double sum = 0;
		for (unsigned j = 1; j < edges; j++) {
			h.bsdf[j].min_alpha = exp(dice_between(&d, -3, 1));
			h.x.v[j].is_delta = j > 1 && dice_uniform(&d) < 0.3;
			if (!h.x.v[j].is_delta)
				sum += fmin(h.bsdf[j].min_alpha, 1);
		}
		constraints_compute(&h.w, &h.x, edges, 0, k);
		dense_fill(&dense, k, edges, 0);
		assert_true(dense_invert(&dense));
		if (dense_det_condition(&dense) > 1e4)
			continue;
		made++;
		memset(step, 0, sizeof step);
		const double pixels = 1e-5;
		compute_steps(edges, pixels);
		/* |det|: of J from the solid angle of a pixel, of D from the inverse. */
		double j = h.x.edge[edges - 1].distance2 /
			   fabs(vec3_dot(h.x.v[edges - 1].x.ng, h.x.edge[edges - 1].w)) /
			   camera_jac_film_from_solid(&h.w.camera, vec3_neg(h.x.edge[edges - 1].w));
		for (unsigned v = 1; v < edges; v++) {
			if (h.x.v[v].is_delta) {
				assert_true(step[v].sigma[0] == 0);
				continue;
			}
			unsigned r = 2 * (edges - 2), s = 2 * (v - 1);
			double det = (double)(dense.inverse[r][s] * dense.inverse[r + 1][s + 1] -
					      dense.inverse[r][s + 1] * dense.inverse[r + 1][s]);
			double share = pixels * fmin(h.bsdf[v].min_alpha, 1) / sum;
			double expected = share * share * j / fabs(det),
			       limit = fmin(h.bsdf[v].min_alpha, 1) / sqrt(M_PI);
			assert_true(is_valid_step(&step[v], limit));
			if (step[v].sigma[0] < limit && step[v].sigma[1] > 1e-6 * limit)
				worst = fmax(worst, fabs(step[v].sigma[0] * step[v].sigma[1] / expected - 1));
		}
		/* For a sub-path that begins in the middle of the path, the roughness alone decides. */
		compute_steps(edges - 1, pixels);
		for (unsigned v = 1; v + 1 < edges; v++)
			if (!h.x.v[v].is_delta)
				assert_true(step[v].rotation.xx == 1 && step[v].rotation.xy == 0 &&
					    step[v].sigma[0] == fmin(h.bsdf[v].min_alpha, 1) / sqrt(M_PI) &&
					    step[v].sigma[1] == step[v].sigma[0]);
	}
	print_message("area of the step over its share: %.1e\n", worst);
	assert_true(worst < 1e-9);
}

/* Extreme constraints: all steps are valid, and no operation is invalid. */
static void extreme_constraints_give_valid_steps(void **state)
{
	(void)state;
	struct dice d = dice_for_test("extreme steps");
	const double alphas[] = {1e-4, 0.1, 1, 7, INFINITY};
	const double values[] = {0, 1e-200, 1e-20, 1, 1e20, 1e69, 1e200, INFINITY};
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		if (!make_visible_reflection(&d))
			continue;
		double *entry = &k[1].a.xx;
		for (int q = 0; q < 12; q++)
			entry[q] = values[dice_below(&d, 8)] * dice_between(&d, -1, 1);
		for (int q = 4; q < 8 && i % 2; q++)
			entry[q] = entry[4 + q % 2];
		h.bsdf[1].min_alpha = alphas[dice_below(&d, 5)];
		if (i % 5 == 0)
			h.x.edge[1].w = h.w.camera.axes.n;
		if (i % 7 == 0)
			h.x.edge[1].w = vec3_cross(h.x.edge[1].w, h.x.v[1].x.ng);
		if (i % 11 == 0)
			h.w.camera.pixels_per_slope = 1e-30;
		feclearexcept(FE_INVALID);
		compute_steps(2, i % 3 ? 10 : 1e-12);
		assert_false(fetestexcept(FE_INVALID));
		assert_true(is_valid_step(&step[1], fmin(h.bsdf[1].min_alpha, 1) / sqrt(M_PI)));
	}
	const double entries[] = {0, 1e-320, 1, 1e300, INFINITY};
	for (unsigned q = 0; q < 625; q++) {
		mat2 e = {entries[q % 5], entries[q / 5 % 5], entries[q / 25 % 5], entries[q / 125]};
		for (int p = 0; p < 5; p++) {
			feclearexcept(FE_INVALID);
			struct halfvec_step s = halfvec_step_from_matrix(e, entries[p], 0.3);
			assert_false(fetestexcept(FE_INVALID));
			assert_true(is_valid_step(&s, 0.3));
		}
	}
}

/* Pearson's test of the positions of 200,000 steps over 18 x 18 cells and the region beyond; level 1e-6. A sigma that
 * is off by 2 % is found with a probability above 99.9 % (noncentrality 4 N 0.02^2 = 320 at 324 degrees of freedom). */
static void steps_follow_their_density(void **state)
{
	(void)state;
	struct dice d = dice_for_test("density of steps");
	enum { SIDE = 18, PARTS = 12, CELLS = SIDE * SIDE + 1 };
	static uint64_t observed[CELLS];
	static double expected[CELLS];
	const mat2 jacobian[] = {{0.2, 0.1, -0.05, 0.3}, {1e-3, 2e-3, 0.3, 0.1}};
	for (size_t t = 0; t < sizeof jacobian / sizeof *jacobian; t++) {
		struct halfvec_step s = halfvec_step_from_matrix(jacobian[t], 1.3, 0.35);
		size_t count = dice_scaled_count(200000);
		double half_width = 3 * s.sigma[0], cell[2];
		memset(observed, 0, sizeof observed);
		memset(expected, 0, sizeof expected);
		/* Cells along U, sized by the two sigmas: 3 sigmas to either side. */
		cell[0] = 2 * half_width / SIDE;
		cell[1] = 6 * s.sigma[1] / SIDE;
		expected[CELLS - 1] = (double)count;
		for (int q = 0; q < CELLS - 1; q++) {
			for (int p = 0; p < PARTS * PARTS; p++) {
				double x = ((q % SIDE) + (p % PARTS + 0.5) / PARTS) * cell[0] - half_width;
				double y = ((q / SIDE) + (p / PARTS + 0.5) / PARTS) * cell[1] - 3 * s.sigma[1];
				expected[q] += exp(halfvec_step_log_pdf(&s, mat2_apply(s.rotation, (vec2){x, y})));
			}
			expected[q] *= (double)count * cell[0] * cell[1] / (PARTS * PARTS);
			expected[CELLS - 1] -= expected[q];
		}
		for (size_t i = 0; i < count; i++) {
			double r = sqrt(-2 * log(1 - dice_uniform(&d))), phi = 2 * M_PI * dice_uniform(&d);
			vec2 dh = halfvec_step_sample(&s, r * cos(phi), r * sin(phi));
			double x = (s.rotation.xx * dh.x + s.rotation.yx * dh.y + half_width) / cell[0];
			double y = (s.rotation.xy * dh.x + s.rotation.yy * dh.y + 3 * s.sigma[1]) / cell[1];
			bool inside = x >= 0 && x < SIDE && y >= 0 && y < SIDE;
			observed[inside ? (int)y * SIDE + (int)x : CELLS - 1]++;
		}
		double p = stats_counts_p(observed, expected, CELLS);
		print_message("sigma %.4g %.4g: p = %.3g, %.0f expected beyond\n", s.sigma[0], s.sigma[1], p,
			      expected[CELLS - 1]);
		assert_true(p > 1e-6);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(singular_values_agree_with_jacobi_rotations),
		cmocka_unit_test(ray_differentials_agree_with_neighbouring_rays),
		cmocka_unit_test(vertices_share_the_film_step_by_roughness),
		cmocka_unit_test(extreme_constraints_give_valid_steps),
		cmocka_unit_test(steps_follow_their_density),
	};
	return cmocka_run_group_tests_name("stepsize", tests, NULL, NULL);
}
