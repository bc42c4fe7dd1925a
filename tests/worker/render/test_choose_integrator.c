/* SPDX-License-Identifier: Apache-2.0 */
/* The integrator that is chosen for scenes whose light is known to be easy or hard to find, and the length of the
 * pilot. The rule itself is tested in test_choose_rule.c. */
#include "tests/support/test_length.h"
#include "tests/support/worlds.h"
#include "worker/render/render.h"
#include "worker/render/choose_integrator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

static void choose_for(const struct world *w, uint64_t seed, uint64_t spp, struct plan_request *r,
		       struct render_choice *c)
{
	struct error e = {""};
	*r = (struct plan_request){.integrator = RENDER_INTEGRATOR_DEFAULT,
				   .kind = PLAN_CHAINS,
				   .width = w->settings.width,
				   .height = w->settings.height,
				   .border = w->settings.border,
				   .seed = seed,
				   .spp = spp,
				   .min_depth = 1,
				   .max_depth = w->settings.max_depth};
	snprintf(r->mixture, sizeof r->mixture, "hslt=1");
	if (render_choose(w, r, c, &e))
		fail_msg("%s", e.text);
}

/* A world without refracted connections, in which only chance finds light behind glass. */
static struct world *world_without_refraction(const char *folder, const char *file)
{
	worlds_effects = "-refracted-shadows";
	struct world *w = world_from_own_scene(folder, file, 160, 90);
	worlds_effects = NULL;
	return w;
}

enum { SEEDS = 4, SPP = 40 }; /* length of the usual pilot, which 30 or more give at 160x90 */

static bool chooses_chains(struct world *w, uint64_t seed)
{
	struct plan_request r;
	struct render_choice c;
	choose_for(w, seed, SPP, &r, &c);
	const struct integrator_properties *i = render_integrator_find(r.integrator);
	assert_non_null(i);
	assert_int_equal(r.kind, i->kind);
	assert_int_equal(i->has_mutations, *r.mixture != 0);
	char text[512];
	render_choice_text(r.integrator, &c, text, sizeof text);
	print_message("seed %d: %s\n", (int)seed, text);
	return strcmp(r.integrator, "hslt") == 0;
}

static void an_open_room_needs_no_chains(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("box", "box.xml", 60, 50);
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_false(chooses_chains(w, seed));
	world_free(w);
}

/* A furnace: all samples contribute nearly the same, with a second moment of 1. */
static void samples_that_are_all_alike_have_no_variance(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		32, 32,
		SENSOR("0,0,5",
		       "0,0,0") "<emitter type='constant'><float name='radiance' value='1'/></emitter><shape type='sphere'>"
				"<bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf></shape>");
	struct plan_request r;
	struct render_choice c;
	choose_for(w, 1, SPP, &r, &c);
	assert_true(c.path.cost < 0.1 && c.path.tail_index > 2);
	assert_string_equal(r.integrator, "path");
	world_free(w);
}

/* Merging does not support scattering media: the choice is made by samples alone. */
static void fog_is_not_merged(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		32, 32,
		SENSOR("0,0,5",
		       "0,0,0") "<emitter type='point'><point name='position' x='0' y='3' z='0'/></emitter>"
				"<shape type='sphere'><bsdf type='dielectric'/><medium type='homogeneous' "
				"name='interior'/></shape><shape type='rectangle'><transform name='to_world'><scale "
				"value='4'/><translate z='-2'/></transform></shape>");
	struct plan_request r;
	struct render_choice c;
	choose_for(w, 1, SPP, &r, &c);
	assert_string_equal(r.integrator, "erpt4");
	assert_true(c.path_misses_light && c.has_narrow_lobes && c.merging.rare_share == 0 &&
		    c.merging.seen_share == 0);
	world_free(w);
}

/* The `null` faces of a cloud do not focus light; glass inside the cloud does. */
static void null_faces_of_clouds_focus_no_light(void **state)
{
	(void)state;
	static const char *const inner[] = {"",
					    "<shape type='sphere'><float name='radius' value='.3'/>"
					    "<bsdf type='roughconductor'/></shape>",
					    "<shape type='sphere'><float name='radius' value='.3'/>"
					    "<bsdf type='dielectric'/></shape>"};
	for (int i = 0; i < 3; i++) {
		struct world *w = world_from_text(
			32, 32,
			SENSOR("0,0,5",
			       "0,0,0") "<emitter type='constant'/><shape type='sphere'><bsdf type='null'/><medium "
					"type='homogeneous' name='interior'/></shape>%s",
			inner[i]);
		struct plan_request r;
		struct render_choice c;
		choose_for(w, 1, SPP, &r, &c);
		assert_int_equal(c.has_narrow_lobes, i > 0);
		assert_int_equal(c.has_transmission, i == 2);
		assert_string_equal(r.integrator, i == 0 ? "path" : "erpt4");
		world_free(w);
	}
}

/* Light sub-paths find the light: the samples of bdpt start the chains, and no pilot of bdpt itself is needed. */
static bool merging_finds_rare_light(struct world *w, uint64_t seed)
{
	struct plan_request r;
	struct render_choice c;
	choose_for(w, seed, SPP, &r, &c);
	return c.merging.rare_share > 0.03 && c.is_settled && strcmp(r.integrator, "erpt") == 0;
}

/* The lamp is far brighter than the map's cells around it, but every sample of its pixel finds it. */
static void a_lamp_in_view_is_not_rare_light(void **state)
{
	(void)state;
	/* clang-format off */
	struct world *w = world_from_text(48, 48,
		"<integrator type='path'><integer name='max_depth' value='5'/></integrator>"
		SENSOR("0,0,4", "0,0,0")
		"<shape type='cube'>"
			"<transform name='to_world'><scale value='5'/></transform>"
			"<bsdf type='diffuse'><rgb name='reflectance' value='0.3,0.3,0.3'/></bsdf>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='0.3' y='0.2' z='0'/>"
			"<float name='radius' value='0.08'/>"
			"<emitter type='area'><rgb name='radiance' value='%d,%d,%d'/></emitter>"
		"</shape>",
		5000, 5000, 5000);
	/* clang-format on */
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_false(chooses_chains(w, seed));
	world_free(w);
}

/* Light sub-paths end in the lamp's image, one pixel thousands of times brighter than its surroundings, which none of
 * the map's samples met. In a darker room, the light that the lamp throws by the mirror onto the visible wall would
 * be rare indeed. */
static void a_small_lamp_in_a_mirror_is_not_rare_light(void **state)
{
	(void)state;
	double rare = 0;
	/* clang-format off */
	struct world *w = world_from_text(160, 90,
		"<integrator type='path'><integer name='max_depth' value='5'/></integrator>"
		SENSOR("0,0,4", "0,0,0")
		"<shape type='cube'>"
			"<transform name='to_world'><scale value='5'/></transform>"
			"<bsdf type='diffuse'><rgb name='reflectance' value='0.3,0.3,0.3'/></bsdf>"
		"</shape>"
		"<shape type='rectangle'>"
			"<transform name='to_world'><scale value='1.5'/></transform>"
			"<bsdf type='roughconductor'><float name='alpha' value='0.02'/></bsdf>"
		"</shape>"
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='3'/>"
				"<rotate x='1' angle='90'/>"
				"<translate y='4.9'/>"
			"</transform>"
			"<emitter type='area'><rgb name='radiance' value='100,100,100'/></emitter>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='1.2' y='0.1' z='0.07'/>"
			"<float name='radius' value='0.003'/>"
			"<emitter type='area'><rgb name='radiance' value='%d,%d,%d'/></emitter>"
		"</shape>",
		1000000, 1000000, 1000000);
	/* clang-format on */
	for (uint64_t seed = 0; seed < SEEDS; seed++) {
		struct plan_request r;
		struct render_choice c;
		choose_for(w, seed, SPP, &r, &c);
		assert_string_not_equal(r.integrator, "hslt");
		rare += c.bdpt.rare_share / SEEDS;
	}
	assert_true(rare < 0.05); /* 0.003; 0.15 if splats were not compared with their pixels */
	world_free(w);
}

/* Wide lobes and a large lamp: the contributions have a wide but bounded range. */
static void light_of_bounded_range_is_given_to_erpt4(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("../bench/scenes", "effects-glass.xml", 160, 90);
	int times = 0;
	for (uint64_t seed = 0; seed < SEEDS; seed++) {
		struct plan_request r;
		struct render_choice c;
		choose_for(w, seed, SPP, &r, &c);
		assert_true(c.path.tail_index < 2);
		times += strcmp(r.integrator, "erpt4") == 0;
	}
	assert_true(times >= SEEDS / 2); /* 78 % over other seeds */
	world_free(w);
}

/* A lamp in a glass ball: bdpt finds the light on the walls, without noise, but misses the light seen in a mirror. */
static void a_lamp_behind_glass_that_path_never_hits_needs_chains(void **state)
{
	(void)state;
	struct world *w = world_without_refraction("bulb", "scene.xml");
	for (uint64_t seed = 0; seed < 2 * SEEDS; seed++)
		assert_true(chooses_chains(w, seed));
	world_free(w);
	/* Refracted connections find this light. */
	w = world_from_own_scene("bulb", "scene.xml", 160, 90);
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_false(chooses_chains(w, seed));
	world_free(w);
}

/* Short pilots of the kitchen in which path finds nothing (the seeds are chosen for that): bdpt finds the light. */
static void light_that_path_never_finds_may_be_easy_for_bdpt(void **state)
{
	(void)state;
	struct world *w = world_without_refraction("../bench/scenes", "kitchen.xml");
	static const uint64_t seeds[] = {2001, 2005, 2007};
	for (size_t i = 0; i < sizeof seeds / sizeof *seeds; i++) {
		struct plan_request r;
		struct render_choice c;
		choose_for(w, seeds[i], 8, &r, &c);
		assert_true(c.path_misses_light && isinf(c.path.cost));
		assert_string_equal(r.integrator, "erpt");
	}
	world_free(w);
}

/* The sun on the floor of a pool, without refracted connections: the samples of a pilot meet it once or never, and
 * one such sample cannot be told from the edge of a lamp. Merging knows it: 0.05 to 0.07 of the light is rare, and
 * 0.03 suffices. */
static void merging_detects_light_that_no_sample_meets(void **state)
{
	(void)state;
	struct world *w = world_without_refraction("../bench/scenes", "pool.xml");
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_true(merging_finds_rare_light(w, seed));
	world_free(w);
}

/* A caustic of a point light: path does not find it, so that its samples look clean. */
static void path_is_not_chosen_where_it_misses_light(void **state)
{
	(void)state;
	/* clang-format off */
	struct world *w = world_from_text(48, 48,
		"<integrator type='path'><integer name='max_depth' value='%d'/></integrator>"
		SENSOR("0,2,6", "0,0,0")
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='3'/>"
				"<rotate x='1' angle='-90'/>"
				"<translate y='-1'/>"
			"</transform>"
			"<bsdf type='diffuse'/>"
		"</shape>"
		"<shape type='sphere'><float name='radius' value='0.4'/><bsdf type='dielectric'/></shape>"
		"<emitter type='point'>"
			"<point name='position' x='1' y='6' z='0'/>"
			"<rgb name='intensity' value='30,30,30'/>"
		"</emitter>",
		6);
	/* clang-format on */
	int would = 0;
	for (uint64_t seed = 0; seed < SEEDS; seed++) {
		struct plan_request r;
		struct render_choice c;
		choose_for(w, seed, 16, &r, &c);
		assert_int_equal(strncmp(r.integrator, "erpt", 4), 0);
		c.path_misses_light = c.has_narrow_lobes = c.has_transmission = false;
		would += strcmp(render_choice_integrator(&c), "path") == 0;
	}
	assert_true(would >= SEEDS - 1);
	world_free(w);
}

/* In most pilots, at most one sample meets the sun through the water, and the others look clean. */
static void path_is_not_chosen_where_glass_may_focus_light(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("../bench/scenes", "pool.xml", 160, 90);
	int clean = 0;
	for (uint64_t seed = 0; seed < SEEDS; seed++) {
		struct plan_request r;
		struct render_choice c;
		choose_for(w, seed, 8, &r, &c);
		assert_true(c.has_narrow_lobes);
		assert_string_not_equal(r.integrator, "path");
		clean += c.path.tail_index >= 2.1;
	}
	assert_true(clean >= SEEDS / 2);
	world_free(w);
}

static void light_through_water_needs_chains(void **state)
{
	(void)state;
	struct world *w = world_without_refraction("displaced", "water.xml");
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_true(merging_finds_rare_light(w, seed));
	world_free(w);
}

/* A scene seen and lit through glass: a few samples in 16,384 find most of the light, and the others look clean. */
static void light_that_few_samples_find_needs_chains(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("../bench/scenes", "torus.xml", 160, 90);
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_true(merging_finds_rare_light(w, seed));
	world_free(w);
}

/* All light comes through rough glass, and much of the image is seen through it: samples find light by luck only. */
static void light_that_is_found_by_luck_needs_chains(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("../bench/scenes", "pane.xml", 160, 90);
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_true(chooses_chains(w, seed));
	world_free(w);
}

static void scene_without_found_light_gets_chains(void **state)
{
	(void)state;
	struct world *w =
		world_from_text(16, 16,
				"<integrator type='path'><integer name='max_depth' value='%d'/></integrator>" SENSOR(
					"0,0,4", "0,0,0") "<shape type='sphere'><bsdf type='diffuse'/></shape>",
				5);
	assert_true(chooses_chains(w, 0));
	world_free(w);
}

/* Longer renders have longer pilots, up to one or two seconds for each kind of sample, because pilots use one thread.
 */
static void pilot_of_a_long_render_is_bounded(void **state)
{
	(void)state;
	struct world *w =
		world_from_text(16, 16,
				"<integrator type='path'><integer name='max_depth' value='%d'/></integrator>" SENSOR(
					"0,0,4", "0,0,0") "<shape type='sphere'><bsdf type='diffuse'/></shape>",
				2);
	static const struct {
		uint64_t spp, samples;
	} of[] = {{1 << 17, 1 << 18}, {1 << 18, 1 << 18}, {1 << 20, 1 << 19}, {1ull << 40, 1 << 20}};
	for (size_t i = 0; i < (test_is_scaled() ? 1 : sizeof of / sizeof *of); i++) {
		struct plan_request r;
		struct render_choice c;
		choose_for(w, 0, of[i].spp, &r, &c);
		/* Two maps, as the first is black, path, and bdpt. */
		assert_int_equal(c.sample_count, 4 * of[i].samples);
	}
	world_free(w);
}

static void the_same_request_gives_the_same_choice(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("box", "box.xml", 60, 50);
	struct plan_request r[2];
	struct render_choice c[2];
	choose_for(w, 7, 16, &r[0], &c[0]);
	choose_for(w, 7, 16, &r[1], &c[1]);
	assert_memory_equal(&c[0], &c[1], sizeof c[0]);
	assert_memory_equal(&r[0], &r[1], sizeof r[0]);
	choose_for(w, 8, 16, &r[1], &c[1]);
	assert_true(c[0].path.cost != c[1].path.cost);
	world_free(w);
}

/* Crops of a film are assembled, so one integrator must render them all. */
static void crop_gets_the_integrator_of_the_whole_film(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("box", "box.xml", 60, 50);
	struct plan_request whole = {.integrator = RENDER_INTEGRATOR_DEFAULT,
				     .width = 60,
				     .height = 50,
				     .spp = 16,
				     .min_depth = 1,
				     .max_depth = 8,
				     .seed = 7},
			    crop = whole;
	struct render_choice c[2];
	struct error e = {""};
	crop.crop_x = crop.crop_y = 25;
	crop.crop_width = crop.crop_height = 20;
	assert_int_equal(render_choose(w, &whole, &c[0], &e), 0);
	assert_int_equal(render_choose(w, &crop, &c[1], &e), 0);
	assert_memory_equal(&c[0], &c[1], sizeof c[0]);
	assert_string_equal(whole.integrator, crop.integrator);
	assert_int_equal(crop.crop_width, 20);
	world_free(w);
}

static void a_short_render_has_a_brief_pilot(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("box", "box.xml", 60, 50);
	struct plan_request r;
	struct render_choice c;
	choose_for(w, 1, 2, &r, &c);
	assert_true(c.is_brief);
	choose_for(w, 1, 400, &r, &c);
	assert_false(c.is_brief);
	world_free(w);
}

/* The pilot is a share of the render, whatever its length, but long enough to tell the tail of the distribution. */
static void the_pilot_is_a_small_part_of_the_render(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("box", "box.xml", 60, 50);
	static const struct {
		uint64_t spp, least; /* least: samples of each kind */
	} of[] = {{1, 1 << 12}, {50, 1 << 12}, {100, 1 << 13}, {200, 1 << 14}, {500, 1 << 14}, {3000, 1 << 16}};
	for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
		struct plan_request r;
		struct render_choice c;
		choose_for(w, 3, of[i].spp, &r, &c);
		double all = 62.0 * 52.0 * (double)of[i].spp;
		assert_in_range(c.sample_count, 2 * of[i].least, 3 * of[i].least);
		if (of[i].spp > 1)
			assert_true((double)of[i].least < all / 22); /* the power of two nearest to 1/32 */
	}
	world_free(w);
}

/* A render of seconds, or one with only a target error, must not have a pilot of hours. */
static void a_render_without_a_number_of_samples_has_a_short_pilot(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("box", "box.xml", 60, 50);
	static const struct {
		double seconds, target;
		uint64_t spp, samples; /* spp: per pixel; samples: of the pilot, each kind */
	} of[] = {{1, 0, 0, 1 << 12},  {8, 0, 0, 1 << 14},  {8, 0, 1 << 30, 1 << 14},
		  {60, 0, 0, 1 << 16}, {60, 0, 1, 1 << 12}, {0, 0.02, 0, 1 << 14}};
	for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
		struct render_choice c;
		struct error e = {""};
		struct plan_request r = {.integrator = RENDER_INTEGRATOR_DEFAULT,
					 .width = 60,
					 .height = 50,
					 .min_depth = 1,
					 .max_depth = 8,
					 .spp = of[i].spp,
					 .seconds = of[i].seconds,
					 .target_error = of[i].target};
		if (render_choose(w, &r, &c, &e))
			fail_msg("%s", e.text);
		assert_in_range(c.sample_count, 2 * of[i].samples, 3 * of[i].samples);
	}
	world_free(w);
}

static void unrenderable_scene_is_refused_with_a_reason(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("box", "box.xml", 60, 50);
	struct plan_request r = {.integrator = RENDER_INTEGRATOR_DEFAULT,
				 .width = 60,
				 .height = 50,
				 .spp = 1,
				 .min_depth = 1,
				 .max_depth = 4,
				 .crop_x = 50,
				 .crop_width = 20,
				 .crop_height = 20};
	struct render_choice c;
	struct error e = {""};
	assert_int_equal(render_choose(w, &r, &c, &e), -EINVAL);
	assert_non_null(strstr(e.text, "crop"));
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(samples_that_are_all_alike_have_no_variance),
		cmocka_unit_test(fog_is_not_merged),
		cmocka_unit_test(null_faces_of_clouds_focus_no_light),
		cmocka_unit_test(an_open_room_needs_no_chains),
		cmocka_unit_test(a_lamp_in_view_is_not_rare_light),
		cmocka_unit_test(a_small_lamp_in_a_mirror_is_not_rare_light),
		cmocka_unit_test(light_of_bounded_range_is_given_to_erpt4),
		cmocka_unit_test(a_lamp_behind_glass_that_path_never_hits_needs_chains),
		cmocka_unit_test(light_that_path_never_finds_may_be_easy_for_bdpt),
		cmocka_unit_test(merging_detects_light_that_no_sample_meets),
		cmocka_unit_test(path_is_not_chosen_where_it_misses_light),
		cmocka_unit_test(path_is_not_chosen_where_glass_may_focus_light),
		cmocka_unit_test(light_through_water_needs_chains),
		cmocka_unit_test(light_that_few_samples_find_needs_chains),
		cmocka_unit_test(light_that_is_found_by_luck_needs_chains),
		cmocka_unit_test(scene_without_found_light_gets_chains),
		cmocka_unit_test(pilot_of_a_long_render_is_bounded),
		cmocka_unit_test(the_same_request_gives_the_same_choice),
		cmocka_unit_test(crop_gets_the_integrator_of_the_whole_film),
		cmocka_unit_test(a_short_render_has_a_brief_pilot),
		cmocka_unit_test(the_pilot_is_a_small_part_of_the_render),
		cmocka_unit_test(a_render_without_a_number_of_samples_has_a_short_pilot),
		cmocka_unit_test(unrenderable_scene_is_refused_with_a_reason),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
