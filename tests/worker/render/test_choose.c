/* Which integrator a scene calls for: scenes whose light is easy and hard to find, the rule itself, and the same choice twice. */
#include "tests/support/worlds.h"
#include "worker/render/choose.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

static void choose(const struct world *w, uint64_t seed, uint64_t spp, struct plan_request *r, struct render_choice *c)
{
	struct error e = {""};
	*r = (struct plan_request){.integrator = RENDER_INTEGRATOR_DEFAULT, .kind = PLAN_CHAINS, .width = w->settings.width,
				   .height = w->settings.height, .border = w->settings.border, .seed = seed, .spp = spp, .min_depth = 1,
				   .max_depth = w->settings.max_depth};
	snprintf(r->mixture, sizeof r->mixture, "hslt=1");
	if (render_choose(w, r, c, &e))
		fail_msg("%s", e.text);
}

static bool chooses_chains(struct world *w, uint64_t seed)
{
	struct plan_request r;
	struct render_choice c;
	choose(w, seed, 16, &r, &c);
	const struct render_integrator *i = render_integrator_find(r.integrator);
	assert_non_null(i);
	assert_int_equal(r.kind, i->kind);
	assert_int_equal(i->has_mutations, *r.mixture != 0);
	print_message("seed %d: %s, path cost %.3g rare %.3g heavy %.3g, bdpt cost %.3g rare %.3g heavy %.3g\n", (int)seed, r.integrator,
		      c.path.cost, c.path.rare, c.path.heavy, c.bdpt.cost, c.bdpt.rare, c.bdpt.heavy);
	return strcmp(r.integrator, "hslt") == 0;
}

enum { SEEDS = 4 };

static void an_open_room_needs_no_chains(void **state)
{
	(void)state;
	struct world *w = world_of_own_scene("box", "box.xml", 60, 50);
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_false(chooses_chains(w, seed));
	world_free(w);
}

/* It is far brighter than the map's cells around it, but every sample of its pixel says so. */
static void a_lamp_in_view_is_not_rare_light(void **state)
{
	(void)state;
	struct world *w = world_of_text(48, 48,
		"<integrator type='path'><integer name='max_depth' value='5'/></integrator>" SENSOR("0,0,4", "0,0,0")
		"<shape type='cube'><transform name='to_world'><scale value='5'/></transform>"
		"<bsdf type='diffuse'><rgb name='reflectance' value='0.3,0.3,0.3'/></bsdf></shape>"
		"<shape type='sphere'><point name='center' x='0.3' y='0.2' z='0'/><float name='radius' value='0.08'/>"
		"<emitter type='area'><rgb name='radiance' value='%d,%d,%d'/></emitter></shape>", 5000, 5000, 5000);
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_false(chooses_chains(w, seed));
	world_free(w);
}

/* A caustic of a point light: path does not find it, so that what it finds looks clean. */
static void path_is_not_chosen_where_it_misses_light(void **state)
{
	(void)state;
	struct world *w = world_of_text(48, 48,
		"<integrator type='path'><integer name='max_depth' value='%d'/></integrator>" SENSOR("0,2,6", "0,0,0")
		"<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/><translate y='-1'/></transform>"
		"<bsdf type='diffuse'/></shape>"
		"<shape type='sphere'><float name='radius' value='0.7'/><bsdf type='dielectric'/></shape>"
		"<emitter type='point'><point name='position' x='1' y='3' z='0'/><rgb name='intensity' value='30,30,30'/></emitter>", 6);
	for (uint64_t seed = 0; seed < SEEDS; seed++) {
		struct plan_request r;
		struct render_choice c;
		choose(w, seed, 16, &r, &c);
		assert_true(c.path.cost < 0.75 * c.bdpt.cost); /* it would be */
		assert_string_equal(r.integrator, "bdpt");
	}
	world_free(w);
}

static void light_through_water_needs_chains(void **state)
{
	(void)state;
	struct world *w = world_of_own_scene("displaced", "water.xml", 160, 90);
	for (uint64_t seed = 0; seed < SEEDS; seed++)
		assert_true(chooses_chains(w, seed));
	world_free(w);
}

static void where_no_light_is_found_the_longest_search_goes_on(void **state)
{
	(void)state;
	struct world *w = world_of_text(16, 16,
		"<integrator type='path'><integer name='max_depth' value='%d'/></integrator>" SENSOR("0,0,4", "0,0,0")
		"<shape type='sphere'><bsdf type='diffuse'/></shape>", 5);
	assert_true(chooses_chains(w, 0));
	world_free(w);
}

static void the_same_request_gives_the_same_choice(void **state)
{
	(void)state;
	struct world *w = world_of_own_scene("box", "box.xml", 60, 50);
	struct plan_request r[2];
	struct render_choice c[2];
	choose(w, 7, 16, &r[0], &c[0]);
	choose(w, 7, 16, &r[1], &c[1]);
	assert_memory_equal(&c[0], &c[1], sizeof c[0]);
	assert_memory_equal(&r[0], &r[1], sizeof r[0]);
	choose(w, 8, 16, &r[1], &c[1]);
	assert_true(c[0].bdpt.cost != c[1].bdpt.cost);
	world_free(w);
}

/* Crops of a film are put together: all must be rendered by one integrator. */
static void a_crop_is_rendered_as_the_whole_is(void **state)
{
	(void)state;
	struct world *w = world_of_own_scene("box", "box.xml", 60, 50);
	struct plan_request whole = {.integrator = RENDER_INTEGRATOR_DEFAULT, .width = 60, .height = 50, .spp = 16, .min_depth = 1,
				     .max_depth = 8, .seed = 7},
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

static void the_rule(void **state)
{
	(void)state;
	static const struct {
		struct render_choice c; /* cost, rare, heavy of path, then of bdpt */
		const char *name;
	} cases[] = {
		{{{1, 0, 0}, {2, 0, 0}, false}, "path"},
		{{{1.9, 0, 0}, {2, 0, 0}, false}, "bdpt"}, /* not much better, and less sure */
		{{{1, 0, 0.3}, {2, 0, 0.1}, false}, "bdpt"}, /* better but for its tails */
		{{{1, 0, 0.3}, {2, 0, 0.3}, false}, "path"},
		{{{1, 0.9, 0.9}, {2, 0, 0}, false}, "bdpt"}, /* bdpt finds what path does not */
		{{{1, 0, 0}, {2, 0.9, 0.9}, false}, "path"},
		{{{1, 0.5, 0.6}, {2, 0.5, 0.6}, false}, "hslt"},
		{{{0, 0, 0}, {0, 0, 0}, false}, "hslt"},
		{{{1, 0, 0}, {2, 0, 0}, true}, "bdpt"},
		{{{1, 0, 0}, {2, 0.9, 0.9}, true}, "hslt"}, /* what path does not find says nothing */
		{{{0, 0, 0}, {1, 0, 0}, false}, "bdpt"}, /* no path from the camera found light */
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		assert_string_equal(render_choice_of(&cases[i].c), cases[i].name);
}

static void what_cannot_be_rendered_is_said(void **state)
{
	(void)state;
	struct world *w = world_of_own_scene("box", "box.xml", 60, 50);
	struct plan_request r = {.integrator = RENDER_INTEGRATOR_DEFAULT, .width = 60, .height = 50, .spp = 1, .min_depth = 1, .max_depth = 4,
				 .crop_x = 50, .crop_width = 20, .crop_height = 20};
	struct render_choice c;
	struct error e = {""};
	assert_int_equal(render_choose(w, &r, &c, &e), -EINVAL);
	assert_non_null(strstr(e.text, "crop"));
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_open_room_needs_no_chains),
		cmocka_unit_test(a_lamp_in_view_is_not_rare_light),
		cmocka_unit_test(path_is_not_chosen_where_it_misses_light),
		cmocka_unit_test(light_through_water_needs_chains),
		cmocka_unit_test(where_no_light_is_found_the_longest_search_goes_on),
		cmocka_unit_test(the_same_request_gives_the_same_choice),
		cmocka_unit_test(a_crop_is_rendered_as_the_whole_is),
		cmocka_unit_test(the_rule),
		cmocka_unit_test(what_cannot_be_rendered_is_said),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
