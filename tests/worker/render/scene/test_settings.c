/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Film, camera, sampler and integrator in a scene file: the defaults of both dialects, the choice of the sensor, crop
 * windows, the values that --size overrides, and which parameters are used, noted, or refused by name.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "tests/support/scene_tables.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static int read_scene(const char *xml, uint32_t width, uint32_t height, struct scene_settings *set, struct error *e)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	int r = scene_read(&s, &assets, "s.xml", scene_tables(), NULL, 0, e);
	if (r)
		fail_msg("%s", e->text);
	r = scene_settings_read(&s, width, height, 1, set, e);
	scene_fini(&s);
	return r;
}

/* before: content of <scene>, in the old dialect; content: that of <sensor>. */
static struct scene_settings read_valid(const char *before, const char *content)
{
	char xml[2048];
	struct scene_settings set;
	struct error e;
	snprintf(xml, sizeof xml, "<scene version='0.6.0'>%s<sensor type='perspective'>%s</sensor></scene>", before,
		 content);
	if (read_scene(xml, 0, 0, &set, &e))
		fail_msg("%s", e.text);
	return set;
}

static void expect_refused(const char *content, const char *text)
{
	char xml[2048];
	struct scene_settings set;
	struct error e = {""};
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", content);
	int r = read_scene(xml, 0, 0, &set, &e);
	if (r >= 0 || !strstr(e.text, text))
		fail_msg("%s\n gave %d: %s\n not: %s", content, r, e.text, text);
}

static void test_defaults_are_those_of_mitsuba(void **state)
{
	(void)state;
	struct scene_settings s = read_valid("", "");
	assert_int_equal(s.width, 768);
	assert_int_equal(s.height, 576);
	assert_int_equal(s.filter, FILTER_GAUSSIAN);
	assert_true(s.filter_stddev == 0.5 && s.filter_radius == 2);
	assert_int_equal(s.border, 2);
	assert_int_equal(s.spp, 0);
	assert_int_equal(s.max_depth, 128);
	assert_string_equal(s.integrator, "");
	assert_true(s.near_clip == 0.01 && s.far_clip == 1e4);
	/* 50 mm on a film of 24 x 36 mm */
	assert_string_equal(s.fov_axis, "diagonal");
	assert_true(fabs(s.fov - 46.79300334396557) < 1e-12);
}

static void test_filters_have_radius_and_border(void **state)
{
	(void)state;
	static const struct {
		const char *filter;
		enum filter_kind kind;
		double radius;
		uint32_t border;
	} cases[] = {
		{"<rfilter type='box'/>", FILTER_BOX, 0.5, 0},
		{"<rfilter type='tent'/>", FILTER_TENT, 1, 1},
		{"<rfilter type='box'><float name='radius' value='2.5'/></rfilter>", FILTER_BOX, 2.5, 2},
		{"<rfilter type='gaussian'><float name='stddev' value='1'/></rfilter>", FILTER_GAUSSIAN, 4, 4},
		/* In 0.6 these filters have no radius. */
		{"<rfilter type='tent'><float name='radius' value='2.5'/></rfilter>", FILTER_TENT, 1, 1},
		{"<rfilter type='gaussian'><float name='radius' value='1.5'/></rfilter>", FILTER_GAUSSIAN, 2, 2},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char film[512];
		snprintf(film, sizeof film, "<film type='ldrfilm'>%s</film>", cases[i].filter);
		struct scene_settings s = read_valid("", film);
		assert_int_equal(s.filter, cases[i].kind);
		assert_true(s.filter_radius == cases[i].radius);
		assert_int_equal(s.border, cases[i].border);
	}
	static const struct {
		const char *filter;
		double radius;
	} newer[] = {{"<rfilter type='tent'><float name='radius' value='2.5'/></rfilter>", 2.5},
		     {"<rfilter type='gaussian'><float name='radius' value='1.5'/></rfilter>", 1.5}};
	for (size_t i = 0; i < sizeof newer / sizeof *newer; i++) {
		char xml[512];
		struct scene_settings s;
		struct error e;
		snprintf(
			xml, sizeof xml,
			"<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'>%s</film></sensor></scene>",
			newer[i].filter);
		assert_int_equal(read_scene(xml, 0, 0, &s, &e), 0);
		assert_true(s.filter_radius == newer[i].radius);
	}
}

/* 0.6's film for experiments, with defaults of one pixel and a box filter. */
static void test_mfilm_has_its_own_defaults(void **state)
{
	(void)state;
	struct scene_settings s = read_valid("", "<film type='mfilm'/>");
	assert_true(s.width == 1 && s.height == 1 && s.filter == FILTER_BOX && s.filter_radius == 0.5 && s.border == 0);
	s = read_valid("", "<film type='mfilm'><integer name='width' value='20'/><rfilter type='tent'/></film>");
	assert_true(s.width == 20 && s.height == 1 && s.filter == FILTER_TENT);
	s = read_valid("", "<film type='tiledhdrfilm'/>");
	assert_true(s.width == 768 && s.height == 576 && s.filter == FILTER_GAUSSIAN);
}

static void test_sampler_and_integrator_are_read(void **state)
{
	(void)state;
	struct scene_settings s =
		read_valid("<integrator type='bdpt'><integer name='maxDepth' value='9'/><integer name='rrDepth' "
			   "value='3'/></integrator>",
			   "<sampler type='sobol'><integer name='sampleCount' value='17'/>"
			   "<integer name='scramble' value='4'/></sampler>");
	assert_int_equal(s.max_depth, 9);
	assert_int_equal(s.roulette_depth, 3);
	assert_string_equal(s.integrator, "bdpt");
	assert_int_equal(s.spp, 17);
	assert_false(s.hides_emitters);
	assert_true(
		read_valid(
			"<integrator type='aov'><integrator type='path'><boolean name='hideEmitters' value='true'/></integrator>"
			"</integrator>",
			"")
			.hides_emitters);
	static const struct {
		const char *depth;
		uint32_t want;
	} depths[] = {{"-1", 128}, {"500", 128}, {"128", 128}, {"127", 127}, {"1", 1}};
	for (size_t i = 0; i < sizeof depths / sizeof *depths; i++) {
		char before[256];
		snprintf(before, sizeof before,
			 "<integrator type='irrcache'><integrator type='path'><integer name='maxDepth' "
			 "value='%s'/></integrator></integrator>",
			 depths[i].depth);
		assert_int_equal(read_valid(before, "").max_depth, depths[i].want);
		assert_int_equal(read_valid(before, "").roulette_depth, 5);
	}
	/* Of several integrators, the first that renders light. */
	static const char *const outer[] = {"multichannel", "aov"};
	for (int i = 0; i < 2; i++) {
		char xml[512];
		snprintf(xml, sizeof xml,
			 "<integrator type='%s'><integrator type='field'/><integrator type='path'><integer "
			 "name='maxDepth' value='7'/><integer name='rrDepth' value='4'/></integrator>"
			 "<integrator type='path'><integer name='maxDepth' value='3'/></integrator></integrator>",
			 outer[i]);
		s = read_valid(xml, "");
		assert_true(s.max_depth == 7 && s.roulette_depth == 4);
	}
	assert_int_equal(read_valid("<integrator type='direct'/>", "").max_depth, 2);
	assert_int_equal(read_valid("<integrator type='prb'/>", "").max_depth, 6);
	assert_int_equal(
		read_valid("<integrator type='aov'><integrator type='prb_projective'/></integrator>", "").max_depth, 6);
	assert_int_equal(read_valid("<integrator type='prbvolpath'/>", "").max_depth, 128);
	assert_int_equal(
		read_valid("<integrator type='prb'><integer name='max_depth' value='-1'/></integrator>", "").max_depth,
		128);
	assert_int_equal(read_valid("<integrator type='moment'><integrator type='direct_projective'/></integrator>", "")
				 .max_depth,
			 2);
	assert_int_equal(read_valid("<integrator type='direct'><integer name='max_depth' value='1'/></integrator>", "")
				 .max_depth,
			 1);
	assert_int_equal(read_valid("<integrator type='direct'><integer name='max_depth' value='-1'/></integrator>", "")
				 .max_depth,
			 2);
	assert_int_equal(read_valid("<integrator type='aov'><integrator type='direct'><integer name='max_depth' "
				    "value='6'/></integrator></integrator>",
				    "")
				 .max_depth,
			 2);
}

static void test_camera_parameters_are_read(void **state)
{
	(void)state;
	struct scene_settings s =
		read_valid("", "<float name='fov' value='35'/><string name='fovAxis' value='smaller'/>"
			       "<float name='nearClip' value='1'/><float name='farClip' value='2'/>"
			       "<transform name='toWorld'><scale value='3'/><rotate z='1' angle='90'/>"
			       "<translate x='5'/></transform>");
	assert_true(s.fov == 35 && s.near_clip == 1 && s.far_clip == 2);
	assert_string_equal(s.fov_axis, "smaller");
	static const double want[3][4] = {{0, -1, 0, 5}, {1, 0, 0, 0}, {0, 0, 1, 0}};
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			assert_true(fabs(s.to_world.m[i][j] - want[i][j]) < 1e-15);
	s = read_valid("", "<transform name='toWorld'><scale x='-2' y='2' z='2'/></transform>");
	assert_true(s.to_world.m[0][0] == -1 && s.to_world.m[1][1] == 1); /* mirroring is kept */
	for (int unit = 0; unit < 2; unit++) {
		s = read_valid("", unit ? "<string name='focalLength' value='24mm'/>"
					: "<string name='focalLength' value='24'/>");
		assert_true(fabs(s.fov - 2 * atan(43.266615305567875 / 48) * 180 / 3.14159265358979323846) < 1e-12);
	}
}

/* The first sensor is used; a note says so. */
static void test_first_of_several_sensors_is_used(void **state)
{
	(void)state;
	const char *xml =
		"<scene version='3.0.0'><emitter type='area' id='lamp'/>\n<sensor type='perspective'><float name='fov' "
		"value='20'/></sensor>\n<sensor type='perspective'><float name='fov' value='30'/></sensor></scene>";
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct scene_settings set;
	struct error e;
	assert_int_equal(scene_read(&s, &assets, "s.xml", scene_tables(), NULL, 0, &e), 0);
	assert_int_equal(scene_settings_read(&s, 0, 0, 1, &set, &e), 0);
	assert_true(set.fov == 20);
	assert_int_equal(s.note_count, 1);
	assert_string_equal(
		s.notes[0],
		"s.xml:3: <sensor type=\"perspective\">: sensor 2; without --sensor the first, in s.xml:2, is rendered");
	scene_fini(&s);
}

/* The notes say which parts of Mitsuba's image will be missing, and which will appear although Mitsuba does not show
 * them. */
static void test_missing_and_additional_light_is_noted(void **state)
{
	(void)state;
	static const struct {
		const char *xml, *note;
	} cases[] = {
		{"<sensor type='perspective'/>", "s.xml: the scene has no emitter: the image is black"},
		{"<sensor type='perspective'><string name='rolling_shutter_type' value='left'/><float name='shutter_close' "
		 "value='1'/></sensor>",
		 "s.xml:1: <sensor type=\"perspective\">: lines of the film are exposed one after the other"},
		{"<integrator type='photonmapper'/>",
		 "s.xml:1: <integrator type=\"photonmapper\">: the image shows all light, on surfaces and in media"},
		{"<integrator type='direct'/>",
		 "s.xml:1: <integrator type=\"direct\">: the image shows light that is scattered once; --max-depth shows more"},
		{"<integrator type='path'/><shape type='sphere'><medium type='homogeneous' name='interior'/></shape>",
		 "s.xml:1: <integrator type=\"path\">: Mitsuba's `path` leaves media out: the image has them only "
		 "with --set media=shown, or with `volpath` in its place"},
		{"<integrator type='aov'><integrator type='path'/></integrator><sensor type='perspective'>"
		 "<medium type='homogeneous'/></sensor>",
		 "Mitsuba's `path` leaves media out"},
		{"<shape type='sphere'><medium type='homogeneous' name='interior'/></shape>",
		 "s.xml:1: <shape type=\"sphere\">: without a BSDF it is grey and opaque, as in Mitsuba 3"},
		{"<integrator type='moment'><integrator type='path'><integer name='max_depth' value='2'/></integrator>"
		 "</integrator>",
		 "s.xml:1: <integrator type=\"moment\">: rendered as the `path` inside it"},
		{"<integrator type='moment'><integrator type='aov'><integrator type='direct'/></integrator></integrator>",
		 "s.xml:1: <integrator type=\"moment\">: rendered as the `direct` inside it"},
		{"<integrator type='stokes'><integrator type='aov'/></integrator>",
		 "<integrator type=\"stokes\">: the image shows all light, on surfaces and in media, without its polarization"},
		{"<integrator type='stokes'><integrator type='path'/></integrator>",
		 "rendered as the `path` inside it, without its polarization"},
		{"<integrator type='multichannel'/>", "the image shows all light, on surfaces and"},
		{"<integrator type='volprim_rf_basic'/>", "the image shows all light, on surfaces and"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[512];
		snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", cases[i].xml);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		assert_int_equal(scene_read(&s, &assets, "s.xml", scene_tables(), NULL, 0, &e), 0);
		if (!scene_has_note(&s, cases[i].note))
			fail_msg("%s: no note says: %s", cases[i].xml, cases[i].note);
		scene_fini(&s);
	}
}

/* Mitsuba's image of a stretched environment differs. */
static void test_stretched_environment_is_noted(void **state)
{
	(void)state;
	static const struct {
		const char *transform;
		bool is_stretched;
	} cases[] = {
		{"<scale value='2'/><rotate y='1' angle='30'/>", false},
		{"<scale x='-1'/>", false},
		{"<scale x='1.5'/>", true},
		{"<matrix value='1 0.5 0 0 0 1 0 0 0 0 1 0 0 0 0 1'/>", true},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[512];
		snprintf(xml, sizeof xml,
			 "<scene version='3.0.0'><emitter type='envmap'><string name='filename' value='e.png'/>"
			 "<transform name='to_world'>%s</transform></emitter></scene>",
			 cases[i].transform);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"e.png", "", 0}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s", e.text);
		if (scene_has_note(&s, "its to_world stretches the image") != cases[i].is_stretched)
			fail_msg("%s: %s", cases[i].transform, cases[i].is_stretched ? "no note" : "a note");
		scene_fini(&s);
	}
}

/* A sun of another model than Mitsuba 3's is darker in haze; Mitsuba 0.6 has the same model. */
static void test_suns_of_another_model_are_noted(void **state)
{
	(void)state;
	static const struct {
		const char *version, *type;
		bool is_noted;
	} cases[] = {
		{"3.0.0", "sunsky", true}, {"3.0.0", "sun", true}, {"3.0.0", "sky", false}, {"0.6.0", "sunsky", false}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[128];
		snprintf(xml, sizeof xml, "<scene version='%s'><emitter type='%s'/></scene>", cases[i].version,
			 cases[i].type);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s", e.text);
		if (scene_has_note(&s, "half as bright at a turbidity of 8") != cases[i].is_noted)
			fail_msg("%s", xml);
		scene_fini(&s);
	}
}

/* The values that Mitsuba 3 accepts in <scene> have no effect on light; other values there are mistakes. */
static void test_values_in_the_scene_element_are_checked(void **state)
{
	(void)state;
	static const struct {
		const char *element, *name;
		bool is_allowed;
	} cases[] = {
		{"boolean", "embree_use_robust_intersection", true},
		{"boolean", "allow_thread_reordering", true},
		{"boolean", "spectral", true}, /* of a fork */
		{"float", "radius", false},    /* of a plug-in */
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[128];
		snprintf(xml, sizeof xml, "<scene version='3.0.0'>\n<%s name='%s' value='true'/></scene>",
			 cases[i].element, cases[i].name);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e = {""};
		bool read = scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e) == 0;
		if (read != cases[i].is_allowed || (!read && !strstr(e.text, "has no place in <scene>")))
			fail_msg("%s: %s", xml, e.text);
		if (!read)
			continue;
		char note[128];
		snprintf(note, sizeof note, "s.xml:2: <%s>: `%s` is ignored", cases[i].element, cases[i].name);
		assert_true(scene_has_note(&s, note));
		scene_fini(&s);
	}
}

/* Only where Mitsuba's versions differ in what hidden lamps occlude. */
static void test_hidden_lamps_are_noted_where_versions_differ(void **state)
{
	(void)state;
#define HIDE "<integrator type='path'><boolean name='hide_emitters' value='true'/></integrator>"
#define LAMP "<shape type='sphere'><emitter type='area'/></shape>"
	static const struct {
		const char *version, *xml;
		bool noted;
	} cases[] = {
		{"3.0.0", HIDE LAMP, true},
		{"3.0.0", "<integrator type='aov'>" HIDE "</integrator>" LAMP, true},
		{"0.6.0", HIDE LAMP, false},
		{"3.0.0", LAMP, false},
		{"3.0.0", HIDE "<emitter type='constant'/><shape type='sphere'/>", false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[512];
		snprintf(xml, sizeof xml, "<scene version='%s'>%s</scene>", cases[i].version, cases[i].xml);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s: %s", xml, e.text);
		if (scene_has_note(&s, "hide_emitters hides its light") != cases[i].noted)
			fail_msg("%s", xml);
		scene_fini(&s);
	}
}

#define ONE_EDGE "<integrator type='path'><integer name='max_depth' value='1'/></integrator>"

/* Paths of one edge end at an emitter that can be hit, which a point light cannot. */
static void test_black_images_of_one_edge_are_noted(void **state)
{
	(void)state;
	static const struct {
		const char *xml;
		bool is_black;
	} cases[] = {
		{ONE_EDGE "<emitter type='point'/>", true},
		{ONE_EDGE "<emitter type='spot'/><emitter type='directional'/>", true},
		{ONE_EDGE "<emitter type='point'/><emitter type='constant'/>", false},
		{ONE_EDGE "<shape type='sphere'><emitter type='area'/></shape>", false},
		{"<integrator type='path'><integer name='max_depth' value='2'/></integrator><emitter type='point'/>",
		 false},
		{"<integrator type='direct'/><emitter type='point'/>", false},
		{"<emitter type='point'/>", false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[512];
		snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", cases[i].xml);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s: %s", cases[i].xml, e.text);
		if (scene_has_note(&s, "max_depth 1 shows emitters themselves") != cases[i].is_black)
			fail_msg("%s: %s", cases[i].xml, cases[i].is_black ? "no note" : "a note");
		scene_fini(&s);
	}
}

static void test_crop_window_is_read(void **state)
{
	(void)state;
#define FILM \
	"<film type='hdrfilm'><integer name='width' value='100'/><integer name='height' value='60'/>" CROP "</film>"
#define CROP \
	"<integer name='cropOffsetX' value='10'/><integer name='cropWidth' value='30'/><integer name='cropHeight' value='60'/>"
	struct scene_settings s = read_valid("", FILM);
	assert_true(s.width == 100 && s.height == 60);
	assert_true(s.crop_x == 10 && s.crop_y == 0 && s.crop_width == 30 && s.crop_height == 60);
#undef CROP
#define CROP "<integer name='cropOffsetX' value='0'/><integer name='cropWidth' value='100'/>"
	assert_int_equal(read_valid("", FILM).crop_width, 0); /* a crop of the whole film is no crop */
#undef CROP
#undef FILM
	s = read_valid(
		"",
		"<float name='principalPointOffsetX' value='0.25'/><integer name='principalPointOffsetY' value='0'/>");
	assert_true(s.principal_x == 0.25 && s.principal_y == 0);
}

static void test_requested_size_overrides_the_film(void **state)
{
	(void)state;
	struct scene_settings s;
	struct error e;
	const char *xml =
		"<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' "
		"value='100'/><integer name='height' value='50'/></film></sensor></scene>";
	assert_int_equal(read_scene(xml, 0, 0, &s, &e), 0);
	assert_true(s.width == 100 && s.height == 50);
	assert_int_equal(read_scene(xml, 7, 8, &s, &e), 0);
	assert_true(s.width == 7 && s.height == 8);
	assert_int_equal(read_scene(xml, 70000, 8, &s, &e), -ERANGE);
}

/* The camera that Mitsuba 3 adds to a scene without one. */
static void test_scene_without_sensor_gets_the_default_camera(void **state)
{
	(void)state;
	struct scene_settings s;
	struct error e = {""};
	assert_int_equal(read_scene("<scene version='3.0.0'/>", 0, 0, &s, &e), 0);
	assert_true(s.is_unplaced && s.fov == 45 && s.width == 768 && s.height == 576);
	assert_string_equal(s.fov_axis, "x");
	assert_int_equal(scene_settings_place_sensor(&s, "s.xml", (vec3){0, -1, 3}, (vec3){4, 1, 5}, &e), 0);
	double distance = 2 / tan(M_PI / 8); /* the nearest side, 4 units wide, fills the image */
	assert_true(fabs(s.to_world.m[2][3] - (3 - distance)) < 1e-12);
	assert_true(s.to_world.m[0][3] == 2 && s.to_world.m[1][3] == 0);
	assert_true(s.to_world.m[0][0] == 1 && s.to_world.m[1][1] == 1 && s.to_world.m[2][2] == 1);
	assert_true(s.near_clip < distance && s.far_clip > distance + 2);
	assert_int_equal(scene_settings_place_sensor(&s, "s.xml", (vec3){1, 1, 1}, (vec3){1, 1, 1}, &e), -EINVAL);
	assert_non_null(strstr(e.text, "s.xml: has no <sensor>, and no shape to place one in front of; it looks like"));
	assert_false(read_valid("", "").is_unplaced);
}

static void test_invalid_settings_are_refused(void **state)
{
	(void)state;
#define SENSOR(x) "<sensor type='perspective'>" x "</sensor>"
	expect_refused(
		SENSOR("<film type='hdrfilm'><integer name='width' value='10'/><integer name='crop_width' value='11'/></film>"),
		"s.xml:1: <film type=\"hdrfilm\">: the crop window of 11 x 576 pixels at 0, 0 exceeds the film of 10 x 576");
	expect_refused(
		SENSOR("<film type='hdrfilm'><integer name='width' value='10'/><integer name='crop_offset_x' value='1'/></film>"),
		"the crop window of 10 x 576 pixels at 1, 0 exceeds");
	expect_refused(
		SENSOR("<film type='hdrfilm'><integer name='width' value='32000'/><integer name='height' value='32000'/></film>"),
		"a film of 32000 x 32000 pixels");
	expect_refused(SENSOR("") "<integrator type='path'><integer name='max_depth' value='0'/></integrator>",
		       "a depth of 0");
	expect_refused(SENSOR("") "<integrator type='path'/><integrator type='path'/>", "a second integrator");
	expect_refused(SENSOR("<float name='fov' value='40'/><string name='focal_length' value='50mm'/>"),
		       "only one is allowed");
	expect_refused(SENSOR("<string name='focal_length' value='50cm'/>"), "is not a length");
	expect_refused(SENSOR("<string name='focal_length' value='-1mm'/>"), "is not a length");
	expect_refused(SENSOR("<float name='near_clip' value='5'/><float name='far_clip' value='5'/>"),
		       "is not below far_clip");
	expect_refused(SENSOR("<transform name='to_world'><matrix value='1 0.5 0 0 1 0 0 0 1'/></transform>"),
		       "may only rotate");
	expect_refused(SENSOR("<transform name='to_world'><scale z='0'/></transform>"), "may only rotate");
}

/* Thin lenses of both dialects; all other parameters are those of a pinhole camera. */
static void test_thin_lens_is_read_in_both_dialects(void **state)
{
	(void)state;
	struct scene_settings s;
	struct error e;
	/* clang-format off */
	if (read_scene(
		"<scene version='0.5.0'>"
			"<sensor type='thinlens'>"
				"<float name='fov' value='30'/>"
				"<float name='apertureRadius' value='.25'/>"
				"<float name='focusDistance' value='7'/>"
			"</sensor>"
		"</scene>",
		0, 0, &s, &e))
		fail_msg("%s", e.text);
	/* clang-format on */
	assert_true(s.aperture_radius == 0.25 && s.focus_distance == 7 && s.fov == 30);
	/* Without a focus distance, the lens is focused at the far plane. */
	if (read_scene(
		    "<scene version='3.0.0'><sensor type='thinlens'><float name='fov' value='30'/><float name='aperture_radius' value='2'/>"
		    "<float name='far_clip' value='50'/></sensor></scene>",
		    0, 0, &s, &e))
		fail_msg("%s", e.text);
	assert_true(s.aperture_radius == 2 && s.focus_distance == 50);
	s = read_valid("", "<float name='focusDistance' value='7'/>");
	assert_true(s.aperture_radius == 0 && s.focus_distance == 0);
	expect_refused("<sensor type='thinlens'/>", "needs an aperture_radius");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_thin_lens_is_read_in_both_dialects),
		cmocka_unit_test(test_defaults_are_those_of_mitsuba),
		cmocka_unit_test(test_filters_have_radius_and_border),
		cmocka_unit_test(test_mfilm_has_its_own_defaults),
		cmocka_unit_test(test_sampler_and_integrator_are_read),
		cmocka_unit_test(test_camera_parameters_are_read),
		cmocka_unit_test(test_first_of_several_sensors_is_used),
		cmocka_unit_test(test_missing_and_additional_light_is_noted),
		cmocka_unit_test(test_stretched_environment_is_noted),
		cmocka_unit_test(test_suns_of_another_model_are_noted),
		cmocka_unit_test(test_values_in_the_scene_element_are_checked),
		cmocka_unit_test(test_hidden_lamps_are_noted_where_versions_differ),
		cmocka_unit_test(test_black_images_of_one_edge_are_noted),
		cmocka_unit_test(test_crop_window_is_read),
		cmocka_unit_test(test_requested_size_overrides_the_film),
		cmocka_unit_test(test_scene_without_sensor_gets_the_default_camera),
		cmocka_unit_test(test_invalid_settings_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
