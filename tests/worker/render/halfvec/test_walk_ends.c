/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Walks with a known end: every kind of failure by its name; an occluder of the same material, which a walk that only
 * checks the end of its last ray would mistake for the target; and foci at which a pivot block or the whole matrix is
 * singular. Also limits of iterations, which apply equally in both directions. Paths are made of rays through given
 * points of the scene. Deterministic.
 */
#include "tests/support/dice.h"
#include "tests/support/worlds.h"
#include "worker/render/halfvec/constraint_system.h"
#include "worker/render/halfvec/walk.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static struct path_context c;
static uint64_t counters[BATCH_COUNTERS];
static struct full_path x, y;
static struct walk_scratch s;
static struct constraint k[FULL_PATH_VERTICES_MAX];

static vec3 in_world(const struct world *w, vec3 p)
{
	return vec3_scale(w->scale, vec3_sub(p, w->center));
}

/* Makes the path x from p[0] (the camera) by rays towards p[1], p[2] .. that are reflected at each hit; the last
 * point is a free point that emits light. */
static void lay_path(const struct world *w, const vec3 *p, unsigned n)
{
	memset(counters, 0, sizeof counters);
	c = (struct path_context){.w = w, .window = {-100, -100, 300, 300}, .counters = counters};
	memset(&x, 0, sizeof x);
	x.edges = n - 1;
	x.wl.is_grey = true;
	x.v[n - 1] = (struct path_vertex){
		.kind = VERTEX_CAMERA, .emitter = -1, .x = {.p = in_world(w, p[0]), .prim = PRIM_NONE}};
	for (unsigned j = n - 1; j-- > 0;) {
		struct path_vertex *from = &x.v[j + 1], *to = &x.v[j];
		vec3 target = in_world(w, p[n - 1 - j]);
		*to = (struct path_vertex){
			.kind = VERTEX_EMITTER, .x = {.p = target, .prim = PRIM_NONE}, .mode = BSDF_REFLECT};
		if (j > 0)
			assert_true(
				path_extend(&c, from, vec3_normalize(vec3_sub(target, from->x.p)), 0, INFINITY, to));
		assert_true(full_path_compute_edge(&x, j));
	}
	for (unsigned j = 1; j + 1 < n; j++) {
		assert_int_equal(x.v[j].kind, VERTEX_SURFACE);
		assert_int_equal(full_path_mode(&x, j), BSDF_REFLECT);
	}
	memset(counters, 0, sizeof counters);
}

/* Walks from x to half vectors that differ by h from its own, to 1e-9. */
static enum walk_result walk_by_halfvecs(const vec2 *h, bool visible, struct walk_limits limits)
{
	struct walk_target target[FULL_PATH_VERTICES_MAX];
	constraints_compute(c.w, &x, x.edges, 0, k);
	for (unsigned j = 1; j < x.edges; j++)
		target[j] = (struct walk_target){vec2_add(k[j].h, h[j]), 1e-9};
	y = x;
	return halfvec_walk(&c, &y, y.edges, 0, target, visible, &limits, WALK_STALE_ALL, &s);
}

/* Computes the differences h that move vertex 1 by about d (scene units) and no other vertex. */
static void halfvecs_for_move(const struct world *w, vec3 d, vec2 *h)
{
	constraints_compute(w, &x, x.edges, 0, k);
	vec3 du, dv, m = vec3_scale(w->scale, d);
	surface_tangents(&x.v[1].x, &du, &dv);
	vec2 dx = {vec3_dot(m, du), vec3_dot(m, dv)};
	h[1] = mat2_apply(k[1].b, dx);
	for (unsigned j = 2; j < x.edges; j++)
		h[j] = j == 2 ? mat2_apply(k[2].a, dx) : (vec2){0, 0};
}

#define MATERIAL(id)                          \
	"<bsdf type='roughconductor' id='" id \
	"'><string name='material' value='none'/><float name='alpha' value='.1'/></bsdf>"
/* clang-format off */
#define FLOOR                                                                                                                  \
	"<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/></transform>"              \
	"<ref id='metal'/></shape>"
#define BLOCK(x, y, z, r, material)                                                                                            \
	"<shape type='sphere'><point name='center' x='" x "' y='" y "' z='" z "'/><float name='radius' value='" r "'/>"           \
	"<ref id='" material "'/></shape>"
/* clang-format on */

static struct walk_limits default_limits;

/* At the end of the walk a ball hides the light; the ball has the floor's own material or another one. */
static void occluded_walk_fails_whatever_the_material(void **state)
{
	(void)state;
	for (int same = 0; same < 2; same++) {
		struct world *w = same ? world_from_text(32, 32,
							 SENSOR("0,1,3", "0,0,0") MATERIAL("metal")
								 FLOOR BLOCK("0.1", "0.5", "-0.5", ".1", "metal"))
				       : world_from_text(32, 32,
							 SENSOR("0,1,3", "0,0,0") MATERIAL("metal") MATERIAL("other")
								 FLOOR BLOCK("0.1", "0.5", "-0.5", ".1", "other"));
		lay_path(w, (vec3[]){{0, 1, 1}, {0.5, 0, 0}, {0, 1, -1}}, 3);
		vec2 h[3];
		/* vertex 1 moves to (0.2, 0, 0), where the middle of the edge to the light lies at the ball's centre */
		halfvecs_for_move(w, (vec3){-0.3, 0, 0}, h);
		struct path_vertex light = x.v[0];
		assert_int_equal(walk_by_halfvecs(h, true, default_limits), WALK_OK);
		assert_int_equal(counters[COUNT_RAYS_SHADOW] + counters[COUNT_RAYS_CLOSEST], 0);
		struct ray_end a = {y.v[1].x.p, y.v[1].x.ng, y.v[1].x.prim}, b = {y.v[0].x.p, {0, 0, 0}, PRIM_NONE};
		assert_true(accel_occluded(w->accel, &a, &b));
		assert_int_equal(walk_by_halfvecs(h, false, default_limits), WALK_BLOCKED);
		assert_memory_equal(&light.x, &y.v[0].x, sizeof light.x);
		halfvecs_for_move(w, (vec3){0.3, 0, 0}, h);
		assert_int_equal(walk_by_halfvecs(h, false, default_limits), WALK_OK);
		world_free(w);
	}
}

static void each_failure_has_its_name(void **state)
{
	(void)state;
	struct world *w = world_from_text(32, 32,
					  SENSOR("0,1,3", "0,0,0") MATERIAL("metal") MATERIAL("other")
						  FLOOR BLOCK("0", "-3", "0", "2.5", "other"));
	lay_path(w, (vec3[]){{0, 1, 1}, {0, 0, 0}, {0, 1, -1}}, 3);
	vec2 h[3];
	struct walk_limits one_iteration = default_limits;
	one_iteration.max_iterations = 1;
	/* Beyond the border of the floor; the walk's own rays cannot reach this position. */
	halfvecs_for_move(w, (vec3){40, 0, 0}, h);
	assert_int_equal(walk_by_halfvecs(h, false, one_iteration), WALK_MISSED);
	assert_int_equal(counters[COUNT_RAYS_CLOSEST], 1);
	/* Far away, but on the floor: one iteration is not enough. */
	halfvecs_for_move(w, (vec3){0.3, 0, 0.4}, h);
	assert_int_equal(walk_by_halfvecs(h, false, one_iteration), WALK_ITERATION_LIMIT);
	assert_int_equal(s.iterations, 1);
	assert_int_equal(walk_by_halfvecs(h, false, default_limits), WALK_OK);
	assert_in_range(s.iterations, 2, 8);
	/* The camera moves below the floor, so that the reflection becomes impossible. */
	struct path_vertex camera = x.v[2];
	vec3 mirrored = in_world(w, (vec3){0, -1, 1});
	halfvecs_for_move(w, (vec3){0, 0, 0}, h);
	constraints_compute(w, &x, 2, 0, k);
	struct walk_target target[3] = {{{0, 0}, 0}, {k[1].h, 1e-9}, {{0, 0}, 0}};
	y = x;
	y.v[2].x.p = mirrored;
	assert_int_equal(halfvec_walk(&c, &y, 2, 0, target, false, &default_limits, WALK_STALE_ALL, &s),
			 WALK_MODE_CHANGED);
	y.v[2] = camera;
	assert_int_equal(halfvec_walk(&c, &y, 2, 0, target, false, &default_limits, WALK_STALE_ALL, &s), WALK_OK);
	/* The fixed end coincides with a vertex. */
	y.v[2].x.p = y.v[1].x.p;
	assert_int_equal(halfvec_walk(&c, &y, 2, 0, target, false, &default_limits, WALK_STALE_ALL, &s), WALK_SINGULAR);
	world_free(w);
}

/* The reverse walk, from the same start and with the same limit of iterations, must find every path that a forward
 * walk can propose, although its tolerances need more iterations; and no other path. */
static void reverse_walk_finds_each_forward_proposal(void **state)
{
	(void)state;
	enum { WALKS = 200 };
	struct dice d = dice_for_test("few iterations");
	struct world *w = world_from_text(32, 32, SENSOR("0,1,3", "0,0,0") MATERIAL("metal") FLOOR);
	lay_path(w, (vec3[]){{0, 1, 1}, {0, 0, 0}, {0, 1, -1}}, 3);
	unsigned later = 0;
	for (int i = 0; i < WALKS; i++) {
		vec2 h[3];
		struct walk_limits few_iterations = default_limits;
		halfvecs_for_move(w, (vec3){dice_uniform(&d) - 0.5, 0, dice_uniform(&d) - 0.5}, h);
		assert_int_equal(walk_by_halfvecs(h, false, default_limits), WALK_OK);
		few_iterations.max_iterations = s.iterations;
		assert_int_equal(walk_by_halfvecs(h, true, few_iterations), WALK_OK);
		later += s.iterations > few_iterations.max_iterations;
		if (few_iterations.max_iterations == 1)
			continue;
		few_iterations.max_iterations--;
		assert_int_equal(walk_by_halfvecs(h, false, few_iterations), WALK_ITERATION_LIMIT);
		assert_int_equal(walk_by_halfvecs(h, true, few_iterations), WALK_ITERATION_LIMIT);
	}
	assert_in_range(later, 1, WALKS - 1);
	world_free(w);
}

/* Beyond the silhouette of a ball lies another material. */
static void walk_onto_another_material_fails(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		32, 32,
		SENSOR("0,1,3", "0,0,0") MATERIAL("metal") MATERIAL("other") BLOCK(
			"0", "0", "0", ".5",
			"metal") "<shape type='rectangle'><transform name='to_world'><scale value='9'/><translate z='-2'/></transform>"
				 "<ref id='other'/></shape><emitter type='constant'/>"); /* dark materials are black */
	lay_path(w, (vec3[]){{0.2, 0, 3}, {0.2, 0, 0}, {2, 0, 3}}, 3);
	vec2 h[3];
	struct walk_limits one_iteration = default_limits;
	one_iteration.max_iterations = 1;
	halfvecs_for_move(w, (vec3){-2, 0, 0}, h);
	assert_int_equal(walk_by_halfvecs(h, false, one_iteration), WALK_BLOCKED);
	/* No point of the ball has this half vector: the residual stops shrinking before the silhouette. */
	h[1] = (vec2){50, 30};
	assert_int_not_equal(walk_by_halfvecs(h, false, default_limits), WALK_OK);
	world_free(w);
}

/* A concave mirror of radius 1 around the origin, hit at (0,-1,0) (far from its poles, where frames spin) at the
 * angle `a`, from the camera at distance `away`: in the plane of incidence its image lies at the distance 1 / (2 /
 * cos a - 1 / away). A small mirror at the image continues the path. */
static vec3 image_point(double a, double away, double *distance)
{
	*distance = 1 / (2 / cos(a) - 1 / away);
	return (vec3){-*distance * sin(a), -1 + *distance * cos(a), 0};
}

#define BOWL "<shape type='sphere'><float name='radius' value='1'/><ref id='metal'/></shape>"

/* The half vector at the first mirror does not change as the vertex there moves: its block is singular, the matrix is
 * not. */
static void walk_passes_a_singular_block(void **state)
{
	(void)state;
	const double a = 0.4, away = 1.2;
	double at;
	vec3 camera = {away * sin(a), -1 + away * cos(a), 0}, image = image_point(a, away, &at);
	struct world *w = world_from_text(
		32, 32,
		SENSOR("0.4,.1,0", "0,0,0") MATERIAL("metal") BOWL
		"<shape type='rectangle'><transform name='to_world'><scale value='.1'/>"
		"<lookat origin='%.17g,%.17g,%.17g' target='0,-0.7,0.4' up='0,1,0'/></transform><ref id='metal'/></shape>",
		image.x, image.y, image.z);
	lay_path(w, (vec3[]){camera, {0, -1, 0}, image, {-0.1, -0.5, 0.6}}, 4);
	constraints_compute(w, &x, 3, 0, k);
	double det = fabs(mat2_det(k[2].b)) / mat2_norm2(k[2].b);
	assert_true(det < 1e-6);
	assert_int_equal(constraint_double.factor(k, 3, 0, &s.system), CONSTRAINT_OK);
	assert_true(s.system.is_pivoted);
	struct dice d = dice_for_test("walks at a focus");
	size_t ends[WALK_ITERATION_LIMIT + 1] = {0}, n = dice_scaled_count(2000);
	double iterations = 0;
	for (size_t i = 0; i < n; i++) {
		vec2 h[4];
		for (unsigned j = 1; j < 3; j++)
			h[j] = (vec2){dice_between(&d, -0.01, 0.01), dice_between(&d, -0.01, 0.01)};
		enum walk_result e = walk_by_halfvecs(h, false, default_limits);
		ends[e]++;
		iterations += s.iterations;
		for (unsigned j = 1; j < 3 && e == WALK_OK; j++) {
			vec2 deviation = vec2_sub(halfvec_of(&y, j), vec2_add(k[j].h, h[j]));
			assert_true(vec2_dot(deviation, deviation) <= 1.01e-18);
		}
	}
	print_message("focus: %zu of %zu arrive in %.2f iterations, %zu singular\n", ends[WALK_OK], n,
		      iterations / (double)n, ends[WALK_SINGULAR]);
	assert_true(ends[WALK_OK] > n * 9 / 10);
	assert_int_equal(ends[WALK_SINGULAR], 0);
	world_free(w);
}

/* The camera's image falls on the light: moving the vertex does not change the half vector within the plane, so there
 * is no step. */
static void walk_without_a_step_is_singular(void **state)
{
	(void)state;
	const double a = 0.4, away = 1.2;
	double at;
	vec3 camera = {away * sin(a), -1 + away * cos(a), 0}, image = image_point(a, away, &at);
	struct world *w = world_from_text(32, 32, SENSOR("0.4,.1,0", "0,0,0") MATERIAL("metal") BOWL);
	lay_path(w, (vec3[]){camera, {0, -1, 0}, image}, 3);
	constraints_compute(w, &x, 2, 0, k);
	assert_true(fabs(mat2_det(k[1].b)) < 1e-12 * mat2_norm2(k[1].b));
	vec2 h[3] = {{0, 0}, {0.01, 0.01}, {0, 0}};
	/* Rounding may leave a nonzero pivot, and then a huge step that leads nowhere. */
	enum walk_result e = walk_by_halfvecs(h, false, default_limits);
	assert_true(e == WALK_SINGULAR || e == WALK_DIVERGED);
	world_free(w);
}

int main(void)
{
	default_limits = walk_limits_of(&accuracy_settings_default);
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(occluded_walk_fails_whatever_the_material),
		cmocka_unit_test(each_failure_has_its_name),
		cmocka_unit_test(reverse_walk_finds_each_forward_proposal),
		cmocka_unit_test(walk_onto_another_material_fails),
		cmocka_unit_test(walk_passes_a_singular_block),
		cmocka_unit_test(walk_without_a_step_is_singular),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
