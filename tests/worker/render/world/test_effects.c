/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which effects a scene needs (worker/render/world/effects.h), decided without rendering: which surfaces light can
 * reach, which shapes enclose others, colour, depth, media, and shadows through glass. Each case expects the decision
 * and the sentence that explains it; the last tests force effects on or off with --effects.
 */
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define VIEW SENSOR("0,0,9", "0,0,0")
/* clang-format off */
#define LAMP                                                                                                                    \
	"<shape type='rectangle' id='lamp'><transform name='to_world'><rotate x='1' angle='90'/><translate y='4'/></transform>"  \
	"<emitter type='area' id='tube'><float name='radiance' value='3'/></emitter></shape>"
#define FLOOR \
	"<shape type='rectangle'>" \
		"<transform name='to_world'>" \
			"<scale value='4'/>" \
			"<rotate x='1' angle='-90'/>" \
			"<translate y='-3'/>" \
		"</transform>" \
	"</shape>"
/* clang-format on */
#define SF11(id)                          \
	"<bsdf type='dielectric' id='" id \
	"'><string name='int_ior' value='sf11'/><boolean name='dispersion' value='true'/></bsdf>"
#define BALL(radius, inner) "<shape type='sphere'><float name='radius' value='" radius "'/>" inner "</shape>"
#define USES(id) "<ref id='" id "'/>"
#define GREY "<bsdf type='diffuse' id='grey'/>"
#define BOX(size, inner) \
	"<shape type='cube'><transform name='to_world'><scale value='" size "'/></transform>" inner "</shape>"

static struct world *world_with_effects(const char *effects, const char *scene)
{
	worlds_effects = effects;
	struct world *w = world_from_text(16, 16, "%s", scene);
	worlds_effects = NULL;
	return w;
}

static const struct effect_line *find_effect_line(const struct world *w, const char *name)
{
	for (size_t i = 0; i < w->effects.effect_line_count; i++)
		if (strcmp(w->effects.effect_lines[i].name, name) == 0)
			return &w->effects.effect_lines[i];
	fail_msg("no line %s", name);
	return NULL;
}

static void expect_effect(const char *scene, const char *name, bool on, const char *why)
{
	struct world *w = world_with_effects(NULL, scene);
	const struct effect_line *l = find_effect_line(w, name);
	if (l->is_on != on || strcmp(l->reason, why) != 0)
		fail_msg("%s: %s, \"%s\"", name, l->is_on ? "on" : "off", l->reason);
	assert_true(*l->savings && !l->is_forced && !l->changes_scene);
	world_free(w);
}

static void test_dispersion_out_of_reach_is_off(void **state)
{
	(void)state;
	expect_effect(VIEW LAMP SF11("sf") BALL("1", USES("sf")), "dispersion", true,
		      "the index of `sf` varies with wavelength: paths that meet it carry one");
	expect_effect(VIEW LAMP SF11("sf") BALL("1", ""), "dispersion", false, "`sf` disperses, but no shape uses it");
	expect_effect(VIEW LAMP SF11("a") SF11("b") BALL("1", ""), "dispersion", false,
		      "`a` and 1 more disperse, but no shape uses them");
	expect_effect(VIEW LAMP SF11("sf") BALL("1", USES("sf")) BOX("1.5", ""), "dispersion", false,
		      "`sf` disperses, but it is inside a closed opaque shape");
	expect_effect(VIEW LAMP SF11("sf") BALL("1", USES("sf")) BALL("1.5", ""), "dispersion", false,
		      "`sf` disperses, but it is inside a closed opaque shape");
	expect_effect(VIEW SF11("sf") BALL("1", USES("sf")), "dispersion", false, "`sf` disperses, but nothing shines");
	expect_effect("<integrator type='path'><integer name='max_depth' value='1'/></integrator>" VIEW LAMP SF11("sf")
			      BALL("1", USES("sf")),
		      "dispersion", false, "`sf` disperses, but paths of one edge do not scatter");
	expect_effect(VIEW LAMP "<bsdf type='dielectric' id='glass1'/>" BALL("1", USES("glass1")), "dispersion", false,
		      "`glass1` has constant eta");
	expect_effect(VIEW LAMP BALL("1", ""), "dispersion", false, "no material refracts");
}

/* Only a closed and opaque shape with the camera outside encloses others, and these must not reach through it. */
static void test_only_closed_opaque_shapes_hide_effects(void **state)
{
	(void)state;
	static const char *const scenes[] = {
		VIEW LAMP SF11("sf") BALL("1", USES("sf")) BOX("1.5", "<bsdf type='dielectric'/>"),
		VIEW LAMP SF11("sf") BALL("1", USES("sf")) BOX("0.9", ""),
		VIEW LAMP SF11("sf") BALL("1", USES("sf")) BOX("20", ""),
		VIEW LAMP SF11("sf") BALL("1", USES("sf")) BALL("1", ""),
		/* The camera's near plane lies inside the enclosure. */
		VIEW LAMP SF11("sf") BALL("1", USES("sf")) BALL("8.999", ""),
		/* clang-format off */
		VIEW LAMP SF11("sf") BALL("1", USES("sf"))
		"<shape type='cube'>"
			"<transform name='to_world'><scale value='1.5'/></transform>"
			"<float name='displacement' value='0.1'/>"
			"<integer name='displacement_level' value='2'/>"
		"</shape>",
		/* clang-format on */
	};
	for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
		struct world *w = world_with_effects(NULL, scenes[i]);
		if (!w->effects.dispersion)
			fail_msg("scene %zu: %s", i, find_effect_line(w, "dispersion")->reason);
		world_free(w);
	}
}

static void test_colour_is_off_in_grey_scenes(void **state)
{
	(void)state;
	expect_effect(VIEW LAMP GREY BALL("1", USES("grey")), "colour", false,
		      "all materials are grey and all emitters have one spectrum");
	expect_effect(
		VIEW LAMP BALL("1",
			       "<bsdf type='diffuse' id='red'><rgb name='reflectance' value='0.8,0.1,0.1'/></bsdf>"),
		"colour", true, "`red` varies with wavelength");
	/* Inside a box, and on a lamp without power. */
	expect_effect(VIEW LAMP BALL("1", "<bsdf type='diffuse'><rgb name='reflectance' value='0.8,0.1,0.1'/></bsdf>")
			      BOX("1.5", ""),
		      "colour", false, "all materials are grey and all emitters have one spectrum");
	expect_effect(VIEW LAMP BALL("1", "") "<emitter type='constant'><rgb name='radiance' value='0,0,0'/></emitter>",
		      "colour", false, "all materials are grey and all emitters have one spectrum");
	expect_effect(
		VIEW LAMP BALL(
			"1",
			"") "<emitter type='constant' id='sky'><rgb name='radiance' value='0.1,0.2,0.5'/></emitter>",
		"colour", true, "the light of `sky` is coloured");
	expect_effect(VIEW LAMP GREY BALL("1", USES("grey")), "wavelength", false, "paths carry no wavelength");
}

static void test_effects_depend_on_lights_and_depth(void **state)
{
	(void)state;
	expect_effect(VIEW LAMP BALL("1", ""), "emitter-move", true, "`tube` has many points or directions");
	expect_effect(VIEW "<emitter type='point'/>" BALL("1", ""), "emitter-move", false,
		      "all emitters are single points or directions");
	expect_effect(VIEW "<emitter type='point'/>" BALL("1", ""), "area-light", false, "no surface shines");
	expect_effect(VIEW LAMP BALL("1", ""), "delta-light", false, "no emitter is a point or parallel light");
	expect_effect(VIEW LAMP BALL("1", ""), "environment", false, "rays that escape meet nothing");
	expect_effect(
		VIEW LAMP FLOOR, "depth", false,
		"paths may have 128 edges, but only up to 2 can carry light: everything that scatters is in one plane");
	expect_effect(VIEW LAMP BALL("1", "<bsdf type='diffuse'><float name='reflectance' value='0'/></bsdf>"), "depth",
		      false, "paths may have 128 edges, but only up to 1 can carry light: nothing scatters");
	expect_effect(VIEW LAMP FLOOR BALL("1", ""), "depth", true, "paths of up to 128 edges can carry light");
}

static void test_effects_depend_on_surfaces(void **state)
{
	(void)state;
	expect_effect(VIEW LAMP BALL("1", ""), "half-vectors", false,
		      "no lobe is narrow: paths that are traced and joined are as likely to carry light");
	expect_effect(VIEW LAMP BALL("1", "<bsdf type='dielectric' id='g'/>"), "half-vectors", true,
		      "lobes are narrow: specular");
	expect_effect(VIEW LAMP BALL("1", "<bsdf type='dielectric' id='g'/>"), "specular", true,
		      "`g` has exactly specular lobes");
	expect_effect(VIEW LAMP BALL("1", "<bsdf type='dielectric' id='g'/>") BOX("1.5", ""), "specular", false,
		      "`g` is specular, but it is inside a closed opaque shape");
	expect_effect(VIEW LAMP BALL("1", "<bsdf type='dielectric' id='g'/>"), "transmission", true,
		      "`g` lets light through");
	expect_effect(VIEW LAMP BALL("1", "<bsdf type='roughconductor' id='m'/>"), "glossy", true,
		      "`m` has rough lobes of finite width");
	expect_effect(VIEW LAMP BALL("1", ""), "aperture", false, "the sensor is a pinhole");
	expect_effect(VIEW LAMP BALL("1", ""), "textures", false, "no material and no emitter has a texture");
	expect_effect(VIEW LAMP BALL("1", ""), "displacement", false, "no shape is displaced");
	expect_effect(VIEW LAMP BALL("1", ""), "bump", false,
		      "bump and normal maps cost nothing where no material has one");
	expect_effect(VIEW LAMP BALL("1", ""), "alpha", false, "masks are specular lobes");
	expect_effect(VIEW LAMP BALL("1", ""), "instancing", false, "no mesh is used in several places");
}

static void test_effects_can_be_forced(void **state)
{
	(void)state;
	struct world *w = world_with_effects("+dispersion", VIEW LAMP BALL("1", "<bsdf type='dielectric' id='g'/>"));
	assert_true(w->effects.dispersion && w->effects.colour && find_effect_line(w, "dispersion")->is_forced &&
		    find_effect_line(w, "colour")->is_forced);
	assert_non_null(strstr(find_effect_line(w, "colour")->reason, "dispersion needs it"));
	assert_true(w->bsdfs[w->shape_bindings[1].bsdf].is_dispersive);
	world_free(w);
	w = world_with_effects("-dispersion", VIEW LAMP SF11("sf") BALL("1", USES("sf")));
	assert_true(!w->effects.dispersion && find_effect_line(w, "dispersion")->is_forced &&
		    find_effect_line(w, "dispersion")->changes_scene);
	struct render_summary s;
	char note[256];
	world_summary(w, &s);
	render_other_scene_note(&s, note, sizeof note);
	assert_string_equal(note, "the image is of another scene: without dispersion");
	world_free(w);
	w = world_with_effects("-half-vectors,-area-light", VIEW LAMP BALL("1", "<bsdf type='dielectric'/>"));
	world_summary(w, &s);
	render_other_scene_note(&s, note, sizeof note);
	assert_string_equal(note, "the image is of another scene: without area-light");
	assert_true(w->emitter_cdf[w->emitter_count] == 0);
	world_free(w);
	w = world_with_effects("all", VIEW LAMP BALL("1", ""));
	assert_true(w->effects.aperture && camera_has_aperture(&w->camera) &&
		    find_effect_line(w, "half-vectors")->is_on && w->effects.max_depth == 128);
	world_free(w);
}

#define CLOUD(sigma_s)                                                                                    \
	"<bsdf type='null'/><medium type='homogeneous' name='interior'><float name='sigma_a' value='1'/>" \
	"<spectrum name='sigma_s' value='" sigma_s "'/></medium>"

/* Scattering media change the direction of light even where there is no surface. Forced off, scattered light is lost;
 * the effect cannot be forced on, as nothing says how light would scatter. */
static void test_scattering_can_be_switched_off(void **state)
{
	(void)state;
	struct world *w = world_with_effects("", VIEW LAMP BALL("1", CLOUD("0")));
	assert_true(w->effects.absorption && !w->effects.scattering && !w->shape_bindings[1].is_null_face);
	assert_string_equal(find_effect_line(w, "scattering")->reason, "no medium scatters");
	world_free(w);
	w = world_with_effects("", VIEW LAMP BALL("1", CLOUD("2")));
	assert_true(w->effects.absorption && w->effects.scattering && w->shape_bindings[1].is_null_face &&
		    w->has_null_faces);
	assert_true(w->media[0].is_scattering && w->media[0].is_absorbing);
	assert_non_null(strstr(find_effect_line(w, "scattering")->reason, "borders on a medium that scatters"));
	world_free(w);
	w = world_with_effects("", VIEW LAMP BALL("1", CLOUD("2") "<emitter type='area'/>"));
	assert_true(w->effects.scattering && !w->has_null_faces); /* the surface of an emitter is a vertex */
	world_free(w);
	w = world_with_effects("-scattering", VIEW LAMP BALL("1", CLOUD("2")));
	assert_true(!w->effects.scattering && !w->media[0].is_scattering && w->media[0].is_absorbing &&
		    !w->has_null_faces);
	assert_true(find_effect_line(w, "scattering")->changes_scene);
	world_free(w);
	w = world_with_effects("-absorption", VIEW LAMP BALL("1", CLOUD("2")));
	assert_true(w->media[0].is_scattering && !w->media[0].is_absorbing);
	world_free(w);
	w = world_with_effects("", "<sensor type='perspective'><medium type='homogeneous' name='m'/></sensor>" LAMP);
	assert_true(w->effects.scattering && w->camera_medium == 1 && w->effects.max_depth == 128);
	world_free(w);
	char text[PLAN_EFFECTS_MAX];
	struct error e;
	assert_int_equal(render_canonical_effects("+scattering", text, &e), -EINVAL);
	assert_non_null(strstr(e.text, "scattering cannot be forced on"));
}

/* Paths walk through an emitting medium as through one that scatters, and the medium counts as a light of the scene. */
static void test_emitting_media_count_as_lights(void **state)
{
	(void)state;
#define GLOW(radiance) "<emitter type='volumelight'><rgb name='radiance' value='" radiance "'/></emitter>"
	struct world *w = world_with_effects("", VIEW BALL("1", CLOUD("0") GLOW("2,2,2")));
	assert_true(w->effects.medium_light && w->effects.scattering && w->shape_bindings[0].is_null_face &&
		    w->emitter_count == 0);
	assert_true(!w->effects.colour && w->effects.max_depth == 128 && !w->media[0].is_scattering);
	assert_string_equal(find_effect_line(w, "scattering")->reason, "no medium scatters");
	assert_non_null(strstr(find_effect_line(w, "medium-light")->reason, "borders on a medium that shines"));
	world_free(w);
	w = world_with_effects("", VIEW BALL("1", CLOUD("0") GLOW("2,1,2")));
	assert_true(w->effects.colour);
	world_free(w);
	w = world_with_effects("", VIEW LAMP BALL("1", CLOUD("0") GLOW("0,0,0")));
	assert_true(!w->effects.medium_light && !w->effects.scattering);
	assert_string_equal(find_effect_line(w, "medium-light")->reason, "no medium shines");
	world_free(w);
	w = world_with_effects("-medium-light", VIEW LAMP BALL("1", CLOUD("2") GLOW("2,2,2")));
	assert_true(!w->effects.medium_light && w->effects.scattering && !w->media[0].is_emissive &&
		    w->media[0].is_scattering);
	assert_true(find_effect_line(w, "medium-light")->changes_scene);
	world_free(w);
	w = world_with_effects("-scattering", VIEW LAMP BALL("1", CLOUD("2") GLOW("2,2,2")));
	assert_true(w->effects.medium_light && w->media[0].is_emissive && !w->media[0].is_scattering &&
		    w->media[0].is_absorbing);
	world_free(w);
}

/* Not through hair, and not in scenes with scattering media, in which edges pass through `null` faces anyway. */
static void test_transparent_shadows_need_thin_glass(void **state)
{
	(void)state;
#define PANE "<shape type='rectangle'><bsdf type='thindielectric' id='pane'/></shape>"
	struct world *w = world_with_effects("", VIEW LAMP PANE);
	assert_true(w->effects.transparent_shadows);
	assert_string_equal(find_effect_line(w, "transparent-shadows")->reason, "`pane` lets light straight through");
	world_free(w);
	w = world_with_effects("-transparent-shadows", VIEW LAMP PANE);
	assert_true(!w->effects.transparent_shadows && !find_effect_line(w, "transparent-shadows")->changes_scene);
	world_free(w);
	static const char *const without[] = {VIEW LAMP "<shape type='sphere'><bsdf type='dielectric'/></shape>",
					      VIEW LAMP "<shape type='sphere'><bsdf type='hair'/></shape>"};
	for (int i = 0; i < 2; i++) {
		w = world_with_effects("", without[i]);
		assert_true(!w->effects.transparent_shadows);
		assert_string_equal(find_effect_line(w, "transparent-shadows")->reason,
				    "no material that light meets lets light straight through");
		world_free(w);
	}
	w = world_with_effects("+transparent-shadows", VIEW LAMP BALL("1", CLOUD("2")) PANE);
	assert_true(!w->effects.transparent_shadows && !find_effect_line(w, "transparent-shadows")->is_on);
	assert_non_null(strstr(find_effect_line(w, "transparent-shadows")->reason, "`null` alone"));
	world_free(w);
}

/* Refracted shadows apply behind surfaces that refract exactly and transmit nothing straight through, but not in
 * scenes with scattering media. */
static void test_refracted_shadows_need_exact_refraction(void **state)
{
	(void)state;
#define POOL "<shape type='rectangle'><bsdf type='dielectric' id='water'/></shape>"
	struct world *w = world_with_effects("", VIEW LAMP POOL);
	assert_true(w->effects.refracted_shadows);
	assert_string_equal(find_effect_line(w, "refracted-shadows")->reason, "`water` refracts light exactly");
	assert_true(w->refracting_bounds.min.x < w->refracting_bounds.max.x);
	world_free(w);
	w = world_with_effects("-refracted-shadows", VIEW LAMP POOL);
	assert_true(!w->effects.refracted_shadows && !find_effect_line(w, "refracted-shadows")->changes_scene);
	assert_true(w->refracting_bounds.min.x > w->refracting_bounds.max.x);
	world_free(w);
	static const char *const without[] = {
		VIEW LAMP PANE, VIEW LAMP "<shape type='sphere'><bsdf type='roughdielectric'/></shape>",
		VIEW LAMP "<shape type='sphere'><bsdf type='conductor'/></shape>",
		VIEW LAMP "<shape type='sphere'><bsdf type='mask'><float name='opacity' value='.5'/><bsdf "
			  "type='dielectric'/></bsdf></shape>"};
	for (size_t i = 0; i < sizeof without / sizeof *without; i++) {
		w = world_with_effects("", without[i]);
		assert_true(!w->effects.refracted_shadows);
		assert_string_equal(find_effect_line(w, "refracted-shadows")->reason,
				    "no material that light meets refracts light exactly");
		world_free(w);
	}
	w = world_with_effects("+refracted-shadows", VIEW LAMP BALL("1", CLOUD("2")) POOL);
	assert_true(!w->effects.refracted_shadows && !find_effect_line(w, "refracted-shadows")->is_on);
	world_free(w);
}

static void test_effect_texts_become_canonical(void **state)
{
	(void)state;
	static const struct {
		const char *text, *canonical; /* canonical form; NULL: refused */
	} texts[] = {
		{"", ""},
		{"all", "all"},
		{"-dispersion,+aperture", "-dispersion,+aperture"},
		{"+aperture,-dispersion", "-dispersion,+aperture"},
		{"+aperture,-aperture", "-aperture"},
		{"-glossy,all", "all,-glossy"},
		{"all,-glossy", "all,-glossy"},
		{"aperture", NULL},
		{"+", NULL},
		{"+dispersoin", NULL},
		{"+all", NULL},
		{"-all", NULL},
		{"-colour", NULL},
		{"+instancing", NULL},
		{"+aperture,", NULL},
	};
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
		char once[PLAN_EFFECTS_MAX], twice[PLAN_EFFECTS_MAX];
		struct error e = {""};
		int rc = render_canonical_effects(texts[i].text, once, &e);
		assert_int_equal(rc, texts[i].canonical ? 0 : -EINVAL);
		if (rc) {
			assert_true(strlen(e.text) > 10);
			continue;
		}
		assert_string_equal(once, texts[i].canonical);
		assert_true(plan_text_is_valid(once, sizeof once));
		assert_int_equal(render_canonical_effects(once, twice, &e), 0);
		assert_memory_equal(once, twice, sizeof once);
	}
	struct error e = {""};
	char text[PLAN_EFFECTS_MAX];
	render_canonical_effects("+dispersoin", text, &e);
	assert_non_null(strstr(e.text, "did you mean `dispersion`?"));
	/* Each effect alone fits the buffer, and so does the longest combination. */
	struct effects_override c = {.forces_any_on = false};
	for (int i = 0; i < EFFECTS; i++)
		c.states[i] = (effect_table[i].override_flags & EFFECT_MAY_FORCE_OFF) ? -1 : 0;
	effects_print(&c, text);
	assert_true(strlen(text) + 16 < sizeof text);
	assert_int_equal(effects_parse(text, &c, &e), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_dispersion_out_of_reach_is_off),
		cmocka_unit_test(test_only_closed_opaque_shapes_hide_effects),
		cmocka_unit_test(test_colour_is_off_in_grey_scenes),
		cmocka_unit_test(test_effects_depend_on_lights_and_depth),
		cmocka_unit_test(test_effects_depend_on_surfaces),
		cmocka_unit_test(test_effects_can_be_forced),
		cmocka_unit_test(test_scattering_can_be_switched_off),
		cmocka_unit_test(test_emitting_media_count_as_lights),
		cmocka_unit_test(test_transparent_shadows_need_thin_glass),
		cmocka_unit_test(test_refracted_shadows_need_exact_refraction),
		cmocka_unit_test(test_effect_texts_become_canonical),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
