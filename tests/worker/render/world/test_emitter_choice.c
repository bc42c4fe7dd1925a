/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The choice of emitters by position: the contribution to each point against closed forms, probabilities against the
 * frequencies of drawn emitters, and images against those with the choice by power. Level of the statistical tests:
 * 1e-6 each; their power is stated with each.
 */
#include "tests/support/agreement.h"
#include "tests/support/dice.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/world/emitter_choice.h"
#include "worker/render/world/emitter_part.h"
#include "worker/render/world/emitter_points.h"

#include <fenv.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

/* clang-format off */
#define FLOOR                                                                                                         \
	"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/></transform>"    \
	"<bsdf type='diffuse'/></shape>"
#define WALL                                                                                                          \
	"<shape type='rectangle'><transform name='to_world'><scale value='9'/><translate z='-2'/></transform>"            \
	"<bsdf type='diffuse'/></shape>"
#define POINT_LIGHT(x, y, z, i)                                                                                       \
	"<emitter type='point'><point name='position' x='" x "' y='" y "' z='" z "'/>"                                    \
	"<rgb name='intensity' value='" i "'/></emitter>"
#define BALL(x, y, z, r, inside)                                                                                      \
	"<shape type='sphere'><point name='center' x='" x "' y='" y "' z='" z "'/><float name='radius' value='" r "'/>"   \
	inside "</shape>"
#define LAMP(x, y, z, r, radiance)                                                                                    \
	BALL(x, y, z, r, "<emitter type='area'><rgb name='radiance' value='" radiance "'/></emitter>")
#define ROOM(x)                                                                                                       \
	"<shape type='cube'><transform name='to_world'><scale value='2'/><translate x='" x "'/></transform>"              \
	"<bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='0.3'/></emitter>"
/* clang-format on */

static struct world *world_with_choice(const char *choice, const char *shapes)
{
	worlds_accuracy = choice;
	struct world *w = world_from_text(64, 64, "%s%s", SENSOR("0,5,6", "0,0,0"), shapes);
	worlds_accuracy = NULL;
	return w;
}

static vec3 in_world(const struct world *w, double x, double y, double z)
{
	return vec3_scale(w->scale, vec3_sub((vec3){x, y, z}, w->center));
}

static void find_emitter_points(const struct world *w, uint32_t max_points, struct arena *arena,
				struct emitter_points *out)
{
	assert_int_equal(emitter_points_find(w, max_points, arena, out), 0);
}

/* Lights of intensities I = 1 and 3 contribute I (0.1 + 0.9 cos) / d^2 to a point on the floor. */
static void test_point_lights_are_chosen_by_contribution(void **state)
{
	(void)state;
	struct world *w =
		world_with_choice(NULL, FLOOR POINT_LIGHT("1", "2", "0", "1") POINT_LIGHT("-2", "1", "1", "3"));
	const vec3 at[2] = {in_world(w, 1, 2, 0), in_world(w, -2, 1, 1)};
	struct arena arena = {0};
	struct emitter_points points;
	find_emitter_points(w, 300, &arena, &points);
	assert_int_equal(points.count, 300);
	for (uint32_t i = 0; i < points.count; i++) {
		double brought[2];
		for (int e = 0; e < 2; e++) {
			vec3 d = vec3_sub(at[e], points.nodes[i].p);
			double r = vec3_length(d);
			brought[e] = (e ? 3 : 1) * (0.1 + 0.9 * d.y / r) / (r * r);
		}
		assert_int_equal(points.nodes[i].id, i);
		for (int e = 0; e < 2; e++)
			assert_true(fabs((double)points.shares[2 * i + (uint32_t)e] -
					 brought[e] / (brought[0] + brought[1])) < 1e-5);
	}
	arena_fini(&arena);
	world_free(w);
}

static double share_of_second(const char *shapes)
{
	struct world *w = world_with_choice(NULL, shapes);
	struct arena arena = {0};
	struct emitter_points points;
	double sum = 0;
	find_emitter_points(w, 300, &arena, &points);
	assert_true(points.count >= 250);
	for (uint32_t i = 0; i < points.count; i++)
		sum += (double)points.shares[emitter_part_count(w) * i + 1] / points.count;
	arena_fini(&arena);
	world_free(w);
	return sum;
}

/* Light passes through glass and not through an opaque ball; a light enclosed by the opaque ball contributes nothing.
 */
static void test_occluded_lights_are_not_chosen(void **state)
{
	(void)state;
#define TWO POINT_LIGHT("1", "2", "0", "1") POINT_LIGHT("-2", "2", "1", "1")
	double open = share_of_second(FLOOR TWO),
	       glass = share_of_second(FLOOR TWO BALL("-2", "2", "1", "0.3", "<bsdf type='dielectric'/>")),
	       hidden = share_of_second(FLOOR TWO BALL("-2", "2", "1", "0.3", "<bsdf type='diffuse'/>"));
	assert_true(open > 0.3 && fabs(glass - open) < 0.1);
	/* Points would lie inside the ball, too, if walks began there; none does. */
	assert_true(hidden < 1e-9);
}

/* Two closed rooms with a lamp each, and a camera in one of them: only the lamp of this room is chosen, however much
 * stronger the other is. */
static void test_only_lamps_of_the_room_are_chosen(void **state)
{
	(void)state;
	worlds_accuracy = NULL;
	struct world *w =
		world_from_text(64, 64, "%s%s", SENSOR("0,0,1.5", "0,0,0"),
				ROOM("0") ROOM("9") LAMP("0", "1", "0", "0.1", "1") LAMP("9", "1", "0", "0.1", "1000"));
	assert_non_null(w->emitter_choice);
	double u[3] = {0.5, 0.5, 0};
	unsigned ours = 0;
	for (int i = 0; i < 1000; i++) {
		struct emitter_pick pick;
		u[2] = (i + 0.5) / 1000;
		assert_true(emitter_choice_pick(w, in_world(w, 0.5, -1.9, 0.3), u, &pick));
		ours += pick.emitter == 0;
	}
	/* By power this lamp has a probability of 1/1000. A cell uses the global probabilities in one tenth of all
	 * cases; these are half by power and half by position. */
	assert_true(ours > 940 && ours < 960);
	assert_true(w->emitter_pdf[0] > 0.499 && w->emitter_pdf[0] < 0.502);
	assert_true(w->emitter_cdf[2] == 1 && fabs(w->emitter_cdf[1] - w->emitter_pdf[0]) < 1e-12);
	world_free(w);
}

/* A single emitter that is not divided into parts needs no choice. */
static void test_single_emitter_needs_no_choice(void **state)
{
	(void)state;
	struct world *w = world_with_choice(NULL, FLOOR LAMP("0", "2", "0", "0.2", "1"));
	assert_null(w->emitter_choice);
	world_free(w);
	w = world_with_choice("emitter-choice=power", FLOOR LAMP("0", "2", "0", "0.2", "1") SKY);
	assert_null(w->emitter_choice);
	assert_true(fabs(w->emitter_pdf[0] - w->emitters[0].power / (w->emitters[0].power + w->emitters[1].power)) <
		    1e-12);
	world_free(w);
	/* No light reaches any surface in a straight line. */
	w = world_with_choice(NULL, FLOOR POINT_LIGHT("1", "-2", "0", "1") POINT_LIGHT("-2", "-2", "1", "1"));
	assert_null(w->emitter_choice);
	world_free(w);
}

static int compare_values(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

/* Each cell has points: those of a floor do not all lie on one side of a split along its height. Nothing is in
 * shadow, so the probabilities differ between any two cells. */
static void test_every_cell_has_points(void **state)
{
	(void)state;
	enum { POINTS_MAX = 64 * 64, CELLS = POINTS_MAX / 16 };
	struct world *w =
		world_with_choice(NULL, FLOOR WALL POINT_LIGHT("1", "4", "0", "1") POINT_LIGHT("-2", "3", "1", "3"));
	struct arena arena = {0};
	struct emitter_points points;
	static double chance[POINTS_MAX];
	unsigned cells = 1;
	find_emitter_points(w, POINTS_MAX, &arena, &points);
	assert_int_equal(points.count, POINTS_MAX);
	for (uint32_t i = 0; i < POINTS_MAX; i++)
		chance[i] = emitter_choice_density_ratio(w, points.nodes[i].p, 0, &w->emitters[0], NULL);
	qsort(chance, POINTS_MAX, sizeof *chance, compare_values);
	for (uint32_t i = 1; i < POINTS_MAX; i++)
		cells += chance[i] > chance[i - 1];
	assert_int_equal(cells, CELLS);
	arena_fini(&arena);
	world_free(w);
}

/* Emitters that are switched off keep their place in the list and are never chosen. */
static void test_switched_off_emitters_are_never_chosen(void **state)
{
	(void)state;
	static const char *const off[] = {"-area-light", "-delta-light", "-environment"};
	const char *lights = FLOOR LAMP("2", "1", "0", "0.2", "9") POINT_LIGHT("0", "3", "-2", "1") SKY;
	for (int32_t which = 0; which < 3; which++) {
		worlds_effects = off[which];
		struct world *w = world_with_choice(NULL, lights);
		worlds_effects = NULL;
		assert_non_null(w->emitter_choice);
		assert_true(w->emitter_pdf[which] == 0);
		for (int i = 0; i < 1000; i++) {
			const double u[3] = {0.5, 0.5, (i + 0.5) / 1000};
			struct emitter_pick pick;
			assert_true(emitter_choice_pick(w, in_world(w, 1, 0, 0.3), u, &pick));
			assert_int_not_equal(pick.emitter, which);
		}
		world_free(w);
	}
}

/* At positions within the scene and far from it, emitters are drawn as often as their densities say. For an emitter
 * that is not divided, emitter_choice_density_ratio() is its probability; for the environment, its mean over uniformly
 * drawn points is. 100,000 draws find an error of 2 % in a probability. */
static void test_emitters_are_drawn_by_their_density(void **state)
{
	(void)state;
	struct world *w =
		world_with_choice(NULL, FLOOR LAMP("2", "1", "0", "0.2", "9") LAMP("-2", "0.6", "1", "0.1", "20")
						POINT_LIGHT("0", "3", "-2", "1") SKY);
	struct dice dice = dice_for_test("densities of choices");
	const vec3 places[] = {in_world(w, 2, 0, 0.3), in_world(w, -1, 0, 1), in_world(w, 30, 20, -70)};
	assert_non_null(w->emitter_choice);
	for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
		uint64_t seen[4] = {0};
		double chance[4] = {0};
		size_t draws = dice_scaled_count(100000);
		for (size_t i = 0; i < draws; i++) {
			const double u[3] = {dice_uniform(&dice), dice_uniform(&dice), dice_uniform(&dice)};
			struct emitter_pick pick;
			struct emitter_point y;
			double pdf;
			assert_true(emitter_choice_pick(w, places[k], u, &pick));
			const struct emitter *em = &w->emitters[pick.emitter];
			seen[pick.emitter]++;
			assert_true(emitter_sample_toward(em, places[k], pick.u, &y, &pdf));
			double denser = emitter_choice_density_ratio(w, places[k], pick.emitter, em, &y);
			assert_true(fabs(denser - pick.density_ratio) < 1e-12);
			if (pick.emitter != w->environment)
				chance[pick.emitter] = denser;
			assert_true(w->emitters[3].ops->sample_point(&w->emitters[3], u, &y, &pdf));
			chance[3] += emitter_choice_density_ratio(w, places[k], 3, &w->emitters[3], &y) / (double)draws;
		}
		double sum = 0, expected[4];
		for (int e = 0; e < 4; e++) {
			sum += chance[e];
			expected[e] = chance[e] * (double)draws;
		}
		assert_true(fabs(sum - 1) < 0.02);
		assert_true(stats_counts_p(seen, expected, 4) > 1e-6);
	}
	world_free(w);
}

/* Lights of extreme power, size and position: no invalid operation, and all densities are finite. */
static void test_extreme_lights_have_finite_densities(void **state)
{
	(void)state;
#define FOG                                                                                                   \
	BALL("0", "0", "0", "20",                                                                             \
	     "<bsdf type='null'/><medium type='homogeneous' name='interior'><rgb name='albedo' value='0.5'/>" \
	     "<float name='sigma_t' value='0.1'/></medium>")
	static const char *const scenes[] = {
		FLOOR POINT_LIGHT("0", "2", "0", "1e25") POINT_LIGHT("0", "1", "0", "1e-25") SKY,
		FLOOR LAMP("0", "1", "0", "1e-6", "1e20") LAMP("1", "1", "0", "1e-3", "1") SKY,
		/* in, on and far from the floor, whose middle is near the world's origin */
		FLOOR POINT_LIGHT("0", "0", "0", "1") POINT_LIGHT("0", "1e-18", "0", "1")
			POINT_LIGHT("0", "1e6", "0", "1"),
		/* half sunk into the floor, around the camera, and around everything */
		FLOOR LAMP("0", "0", "0", "1", "1") LAMP("0", "5", "6", "0.2", "1") LAMP("0", "0", "0", "99", "1"),
		FOG FLOOR POINT_LIGHT("0", "0", "0", "1") LAMP("1", "1", "0", "0.1", "1e12") SKY,
	};
	struct dice dice = dice_for_test("extreme lights");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		struct arena arena = {0};
		struct emitter_points points;
		feclearexcept(FE_INVALID);
		struct world *w = world_with_choice("media=shown", scenes[k]);
		find_emitter_points(w, 600, &arena, &points);
		for (uint32_t i = 0; i < points.count; i++) {
			double sum = 0;
			for (uint32_t e = 0; e < emitter_part_count(w); e++)
				sum += (double)points.shares[(size_t)i * emitter_part_count(w) + e];
			assert_true(fabs(sum - 1) < 1e-5);
		}
		for (int i = 0; i < 2000; i++) {
			const double u[3] = {dice_uniform(&dice), dice_uniform(&dice), dice_uniform(&dice)};
			struct emitter_pick pick;
			vec3 p = points.count ? points.nodes[(uint32_t)i % points.count].p : (vec3){0, 0, 0};
			assert_true(emitter_choice_pick(w, p, u, &pick));
			assert_true(pick.density_ratio > 0 && isfinite(pick.density_ratio));
			assert_true(pick.u[0] >= 0 && pick.u[0] < 1 && pick.u[1] >= 0 && pick.u[1] < 1);
		}
		assert_false(fetestexcept(FE_INVALID));
		arena_fini(&arena);
		world_free(w);
	}
}

static void test_choice_is_reproducible(void **state)
{
	(void)state;
	struct world *a = world_with_choice(NULL, FLOOR LAMP("2", "1", "0", "0.2", "9") SKY),
		     *b = world_with_choice(NULL, FLOOR LAMP("2", "1", "0", "0.2", "9") SKY);
	struct dice dice = dice_for_test("the same twice");
	for (int i = 0; i < 1000; i++) {
		const double u[3] = {dice_uniform(&dice), dice_uniform(&dice), dice_uniform(&dice)};
		vec3 p = {dice_between(&dice, -1, 1), dice_between(&dice, -1, 1), dice_between(&dice, -1, 1)};
		struct emitter_pick of_a, of_b;
		assert_true(emitter_choice_pick(a, p, u, &of_a) && emitter_choice_pick(b, p, u, &of_b));
		assert_true(of_a.emitter == of_b.emitter && of_a.density_ratio == of_b.density_ratio &&
			    of_a.u[0] == of_b.u[0] && of_a.u[1] == of_b.u[1]);
	}
	world_free(a);
	world_free(b);
}

/* The image does not depend on the choice of emitters; level and power as in tests/support/agreement.h. */
static void test_image_does_not_depend_on_the_choice(void **state)
{
	(void)state;
#define LIGHTS \
	FLOOR LAMP("2", "1", "0", "0.5", "2") LAMP("-2", "1.5", "1", "0.4", "3") POINT_LIGHT("0", "3", "-2", "3") SKY
	struct world *place = world_with_choice(NULL, LIGHTS),
		     *power = world_with_choice("emitter-choice=power", LIGHTS);
	const struct agreement_options path = {.integrator = "path", .spp = dice_scaled_count(256), .groups = 16},
				       bdpt = {.integrator = "bdpt", .spp = dice_scaled_count(128), .groups = 16};
	static struct agreement_image a, b, c;
	agreement_render(place, "emitters by place", "place", &path, &a);
	agreement_render(power, "emitters by place", "power", &path, &b);
	agreement_render(place, "emitters by place", "bdpt", &bdpt, &c);
	agreement_check("emitters by place, path", &a, &b);
	agreement_check("emitters by place, bdpt", &c, &b);
	world_free(place);
	world_free(power);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_point_lights_are_chosen_by_contribution),
		cmocka_unit_test(test_occluded_lights_are_not_chosen),
		cmocka_unit_test(test_only_lamps_of_the_room_are_chosen),
		cmocka_unit_test(test_single_emitter_needs_no_choice),
		cmocka_unit_test(test_every_cell_has_points),
		cmocka_unit_test(test_switched_off_emitters_are_never_chosen),
		cmocka_unit_test(test_emitters_are_drawn_by_their_density),
		cmocka_unit_test(test_extreme_lights_have_finite_densities),
		cmocka_unit_test(test_choice_is_reproducible),
		cmocka_unit_test(test_image_does_not_depend_on_the_choice),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
