/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Densities of sub-paths, and of all techniques that could have sampled a path, recomputed independently by
 * tests/support/density.h. The worlds have rough and specular surfaces, environments, surfaces that let light
 * straight through, fog, clouds, flakes, thin lenses, point lights and bent normals.
 */
#include "tests/support/density.h"
#include "tests/support/memory_assets.h"
#include "tests/support/rooms.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* clang-format off */
#define BOX \
	"<shape type='cube'>" \
		"<transform name='to_world'><scale value='3'/></transform>" \
		"<bsdf type='diffuse'><float name='reflectance' value='.7'/></bsdf>" \
	"</shape>"
#define LAMPS \
	"<shape type='sphere'>" \
		"<point name='center' x='-1' y='1.5' z='.5'/>" \
		"<float name='radius' value='.4'/>" \
		"<emitter type='area'><float name='radiance' value='5'/></emitter>" \
	"</shape>" \
	"<shape type='rectangle'>" \
		"<transform name='to_world'><rotate x='1' angle='90'/><translate y='2.5'/></transform>" \
		"<bsdf type='diffuse'/>" \
		"<emitter type='area'><float name='radiance' value='3'/></emitter>" \
	"</shape>"
#define BALL(x, y, z, bsdf) \
	"<shape type='sphere'>" \
		"<point name='center' x='" x "' y='" y "' z='" z "'/>" \
		"<float name='radius' value='.6'/>" \
		bsdf \
	"</shape>"
/* clang-format on */

static void densities_agree_for_diffuse_and_rough_surfaces(void **state)
{
	(void)state;
	/* clang-format off */
	density_check("diffuse and rough", world_from_text(32, 24,
		SENSOR("0,0,2.9", "0,0,0")
		BOX LAMPS
		BALL("0", "0", "0",
			"<bsdf type='roughconductor'>"
				"<string name='material' value='none'/>"
				"<float name='alpha' value='.3'/>"
			"</bsdf>")
		BALL("1.4", "-.5", "0", "<bsdf type='roughdielectric'><float name='alpha' value='.2'/></bsdf>")
		BALL("-1.4", "-.7", "0", "<bsdf type='phong'><float name='exponent' value='12'/></bsdf>")), 12000);
	/* clang-format on */
}

static void densities_agree_for_specular_surfaces(void **state)
{
	(void)state;
	/* clang-format off */
	struct density_tally t = density_check("specular", world_from_text(32, 24,
		SENSOR("0,0,2.9", "0,0,0")
		BOX LAMPS
		BALL("0", "0", "0.5", "<bsdf type='dielectric'><float name='int_ior' value='1.5'/></bsdf>")
		BALL("1.2", "-.5", "0", "<bsdf type='conductor'><string name='material' value='Au'/></bsdf>")
		BALL("-1.3", "-.7", "0",
			"<bsdf type='dielectric'>"
				"<float name='int_ior' value='1'/>"
				"<float name='ext_ior' value='1.4'/>"
			"</bsdf>")
		BALL("1.3", "-1.2", "1",
			"<bsdf type='dielectric'>"
				"<string name='int_ior' value='sf11'/>"
				"<boolean name='dispersion' value='true'/>"
			"</bsdf>")
		BALL("-.2", "-1.2", "1",
			"<bsdf type='roughdielectric'>"
				"<float name='alpha' value='.1'/>"
				"<float name='int_cauchy_b' value='.02'/>"
			"</bsdf>")), 20000);
	/* clang-format on */
	assert_true(t.with_delta > t.routes / 20);
}

static void densities_agree_for_infinite_emitters(void **state)
{
	(void)state;
	/* clang-format off */
	struct density_tally t = density_check("infinity", world_from_text(32, 24,
		SENSOR("0,1,4.9", "0,0,0")
		LAMPS
		"<emitter type='constant'><float name='radiance' value='.4'/></emitter>"
		BALL("0", "0", "0",
			"<bsdf type='roughconductor'>"
				"<string name='material' value='none'/>"
				"<float name='alpha' value='.3'/>"
			"</bsdf>")
		BALL("1.2", "-.5", "0", "<bsdf type='dielectric'/>")
		BALL("-1.3", "-.7", "0", "<bsdf type='diffuse'/>")
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='4'/>"
				"<rotate x='1' angle='-90'/>"
				"<translate y='-1.5'/>"
			"</transform>"
			"<bsdf type='phong'/>"
		"</shape>"), 20000);
	/* clang-format on */
	assert_true(t.from_infinity > t.routes / 10);
}

/* clang-format off */
#define DELTA_LIGHTS \
	"<emitter type='point'>" \
		"<point name='position' x='.5' y='2' z='1'/>" \
		"<float name='intensity' value='40'/>" \
	"</emitter>" \
	"<emitter type='directional'>" \
		"<vector name='direction' x='.3' y='-1' z='-.2'/>" \
		"<float name='irradiance' value='2'/>" \
	"</emitter>" \
	"<emitter type='spot'>" \
		"<float name='cutoff_angle' value='50'/>" \
		"<float name='intensity' value='100'/>" \
		"<transform name='to_world'><lookat origin='-1,2,1.5' target='0,0,0' up='1,0,0'/></transform>" \
	"</emitter>"
/* clang-format on */

/* clang-format off */
#define PANE(x, y, z, angle, inner) \
	"<shape type='rectangle'>" \
		"<transform name='to_world'>" \
			"<scale value='1.1'/>" \
			"<rotate x='1' angle='" angle "'/>" \
			"<translate x='" x "' y='" y "' z='" z "'/>" \
		"</transform>" \
		inner \
	"</shape>"
#define PANES \
	PANE("0", "1", "0", "-80", "<bsdf type='thindielectric'/>") \
	PANE("0", ".8", "0", "-95", "<bsdf type='thindielectric'/>") \
	PANE("0", "0", "1.7", "10", "<bsdf type='thindielectric'/>") \
	PANE("-1", ".2", ".6", "-60", "<bsdf type='mask'><float name='opacity' value='.3'/><bsdf type='diffuse'/></bsdf>")
/* clang-format on */

/* Connections pass through surfaces that let light straight through: to lamps, point lights, the sky and the lens. */
static void densities_agree_through_see_through_surfaces(void **state)
{
	(void)state;
	/* clang-format off */
	struct density_tally t = density_check("panes in a box", world_from_text(32, 24,
		SENSOR("0,0,2.9", "0,0,0")
		BOX LAMPS PANES "%s",
		BALL("0", "-.3", "0", "<bsdf type='roughconductor'><float name='alpha' value='.3'/></bsdf>")
		BALL("1.4", "-1", "0", "<bsdf type='dielectric'/>")), 3000);
	assert_true(t.with_passed_vertices > t.routes / 5);
	t = density_check("panes under the sky", world_from_text(32, 24,
		SENSOR("0,0,2.9", "0,0,0")
		PANES DELTA_LIGHTS "%s",
		BALL("0", "-.3", "0", "<bsdf type='diffuse'/>")
		"<emitter type='constant'><float name='radiance' value='.4'/></emitter>"
		"<shape type='sphere'>"
			"<point name='center' x='-1' y='1.5' z='.5'/>"
			"<float name='radius' value='.1'/>"
			"<emitter type='area'><float name='radiance' value='5'/></emitter>"
		"</shape>"), 8000);
	/* clang-format on */
	assert_true(t.with_passed_vertices > t.routes / 5 && t.from_infinity > t.routes / 10);
}

/* Lights that no path can hit, beside some that can be hit. */
static void densities_agree_for_delta_lights(void **state)
{
	(void)state;
	/* clang-format off */
	struct world *w = world_from_text(32, 24,
		SENSOR("0,1,4.9", "0,0,0")
		DELTA_LIGHTS
		"%s"
		"<emitter type='constant'><float name='radiance' value='.4'/></emitter>"
		"<shape type='sphere'>"
			"<point name='center' x='-1' y='1.5' z='.5'/>"
			"<float name='radius' value='.4'/>"
			"<emitter type='area'><float name='radiance' value='5'/></emitter>"
		"</shape>",
		BALL("0", "0", "0",
			"<bsdf type='roughconductor'>"
				"<string name='material' value='none'/>"
				"<float name='alpha' value='.3'/>"
			"</bsdf>")
		BALL("1.2", "-.5", "0", "<bsdf type='dielectric'/>")
		BALL("-1.3", "-.7", "0", "<bsdf type='diffuse'/>")
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='4'/>"
				"<rotate x='1' angle='-90'/>"
				"<translate y='-1.5'/>"
			"</transform>"
			"<bsdf type='phong'/>"
		"</shape>");
	/* clang-format on */
	for (uint32_t i = 0; i < w->emitter_count; i++)
		assert_true(w->emitter_pdf[i] > 0.01);
	struct density_tally t = density_check("delta lights", w, 30000);
	assert_true(t.with_delta > t.routes / 100);
	/* Only lights that no path can hit. */
	/* clang-format off */
	t = density_check("delta lights in a box", world_from_text(32, 24, SENSOR("0,0,2.9", "0,0,0") BOX DELTA_LIGHTS "%s",
		BALL("0", "0", "0.5", "<bsdf type='dielectric'><float name='int_ior' value='1.5'/></bsdf>")
		BALL("1.2", "-.5", "0", "<bsdf type='conductor'><string name='material' value='Au'/></bsdf>")), 6000);
	/* clang-format on */
	assert_true(t.with_delta > t.routes / 20);
}

/* The whole scene lies in fog that scatters forwards, behind a near plane, lit by a lamp and a point light. */
static void check_fog(const char *name, const char *medium, const struct vol *grid, size_t walks)
{
	char xml[4096];
	/* clang-format off */
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s%s%s</scene>",
		medium,
		"<sensor type='perspective'>"
			"<float name='fov' value='40'/>"
			"<float name='near_clip' value='.4'/>"
			"<transform name='to_world'><lookat origin='0,0,2.9' target='0,0,0' up='0,1,0'/></transform>"
			"<ref id='fog'/>"
		"</sensor>",
		BOX LAMPS
		"<emitter type='point'>"
			"<point name='position' x='.5' y='2' z='1'/>"
			"<float name='intensity' value='40'/>"
		"</emitter>"
		BALL("0", "0", "0.5",
			"<bsdf type='dielectric'/>"
			"<ref id='fog' name='interior'/>"
			"<ref id='fog' name='exterior'/>")
		BALL("1.4", "-.5", "0", "<bsdf type='diffuse'/>"));
	/* clang-format on */
	const struct memory_file files[] = {{"fog.xml", xml, strlen(xml)},
					    {"fog.vol", grid ? grid->bytes : NULL, grid ? grid->size : 0},
					    {NULL, NULL, 0}};
	struct world *w = world_from_files(32, 24, files);
	assert_true(w->effects.scattering && w->media_count == 1);
	for (uint32_t i = 0; i < w->emitter_count; i++)
		assert_int_equal(w->emitter_media[i], 1);
	density_check(name, w, walks);
}

#define FORWARDS "<phase type='hg'><float name='g' value='.5'/></phase></medium>"

static void densities_agree_in_fog(void **state)
{
	(void)state;
	/* clang-format off */
	check_fog("fog",
		"<medium type='homogeneous' id='fog'>"
			"<rgb name='sigma_t' value='.2,.5,.9'/>"
			"<rgb name='albedo' value='.9,.8,.7'/>"
			FORWARDS,
		NULL, 12000);
	/* clang-format on */
}

/* Fog of flakes that lie nearly flat, three times as dense along one direction as along another. */
static void densities_agree_in_fog_of_flakes(void **state)
{
	(void)state;
	/* clang-format off */
	check_fog("fog of flakes",
		"<medium type='homogeneous' id='fog'>"
			"<rgb name='sigma_t' value='.4,.8,1.2'/>"
			"<rgb name='albedo' value='.9,.8,.7'/>"
			"<phase type='sggx'>"
				"<volume type='constvolume' name='S'><string name='value' value='.4,1,.3,.2,-.1,.3'/></volume>"
			"</phase>"
		"</medium>",
		NULL, 4000);
	/* clang-format on */
}

static double puffs_density(double x, double y, double z, uint32_t channel)
{
	return 0.5 + 0.5 * sin(3 * x + channel) * cos(2 * y - channel) * sin(1 + 5 * z);
}

/* The blend of the two phase functions varies with position; one is a table that is 0 straight ahead. */
static void densities_agree_in_fog_of_blended_phases(void **state)
{
	(void)state;
	static struct vol grid;
	vol_make(&grid, (const uint32_t[3]){4, 3, 5}, 1, puffs_density);
	/* clang-format off */
	check_fog("fog of two phase functions",
		"<medium type='homogeneous' id='fog'>"
			"<rgb name='sigma_t' value='.2,.5,.9'/>"
			"<rgb name='albedo' value='.9,.8,.7'/>"
			"<phase type='blendphase'>"
				"<phase name='phase_0' type='hg'><float name='g' value='.5'/></phase>"
				"<phase name='phase_1' type='tabphase'><string name='values' value='3,1,2,0'/></phase>"
				"<volume type='gridvolume' name='weight'>"
					"<string name='filename' value='fog.vol'/>"
					"<transform name='to_world'>"
						"<translate x='-.5' y='-.5' z='-.5'/>"
						"<scale value='4'/>"
					"</transform>"
				"</volume>"
			"</phase>"
		"</medium>",
		&grid, 4000);
	/* clang-format on */
}

/* The density varies with position, in one channel or three, in a box that does not fill the room. */
static void densities_agree_in_fog_of_varying_density(void **state)
{
	(void)state;
	static struct vol grid;
	static const char *const media[] = {"<float name='albedo' value='.8'/>",
					    "<rgb name='albedo' value='.9,.8,.7'/>"};
	for (uint32_t channels = 1; channels <= 3; channels += 2) {
		char medium[1024];
		vol_make(&grid, (const uint32_t[3]){4, 3, 5}, channels, puffs_density);
		/* clang-format off */
		snprintf(medium, sizeof medium,
			"<medium type='heterogeneous' id='fog'>"
				"<volume type='gridvolume' name='sigma_t'>"
					"<string name='filename' value='fog.vol'/>"
					"<transform name='to_world'>"
						"<rotate x='1' y='1' angle='20'/>"
						"<translate x='-.5' y='-.5' z='-.5'/>"
						"<scale value='4'/>"
					"</transform>"
				"</volume>"
				"%s"
				FORWARDS,
			media[channels / 2]);
		/* clang-format on */
		check_fog(channels == 1 ? "grey puffs" : "coloured puffs", medium, &grid, 300);
	}
}

/* A wide lens, focused in front of the balls, so that the lens vertex x_k differs from path to path. */
static void densities_agree_for_a_wide_lens(void **state)
{
	(void)state;
	/* clang-format off */
	static const char lens[] =
		"<sensor type='thinlens'>"
			"<float name='fov' value='40'/>"
			"<float name='aperture_radius' value='.7'/>"
			"<float name='focus_distance' value='1.5'/>"
			"<transform name='to_world'><lookat origin='0,0,2.9' target='0,0,0' up='0,1,0'/></transform>"
		"</sensor>";
	struct world *w = world_from_text(32, 24, "%s%s", lens,
		BOX LAMPS
		BALL("0", "0", "0.5", "<bsdf type='dielectric'><float name='int_ior' value='1.5'/></bsdf>")
		BALL("1.4", "-.5", "0", "<bsdf type='roughdielectric'><float name='alpha' value='.2'/></bsdf>"));
	/* clang-format on */
	assert_true(w->effects.aperture);
	density_check("lens", w, 3000);
}

/* Vertex normals tilted by up to 40 degrees from the triangle normals. */
static void densities_agree_for_tilted_vertex_normals(void **state)
{
	(void)state;
	/* clang-format off */
	static const char scene[] =
		"<scene version='3.0.0'>"
			SENSOR("0,1,2.9", "0,-1,0")
			LAMPS
			"<shape type='obj'><string name='filename' value='bent.obj'/><bsdf type='diffuse'/></shape>"
			"<shape type='obj'>"
				"<string name='filename' value='bent.obj'/>"
				"<transform name='to_world'>"
					"<scale value='.4'/>"
					"<rotate x='1' angle='80'/>"
					"<translate y='-.5'/>"
				"</transform>"
				"<bsdf type='roughdielectric'><float name='alpha' value='.4'/></bsdf>"
			"</shape>"
			"<shape type='obj'>"
				"<string name='filename' value='bent.obj'/>"
				"<transform name='to_world'><scale value='.4'/><translate x='1' y='.6'/></transform>"
				"<bsdf type='dielectric'/>"
			"</shape>"
			"<shape type='obj'>"
				"<string name='filename' value='bent.obj'/>"
				"<transform name='to_world'>"
					"<scale value='.7'/>"
					"<rotate z='1' angle='70'/>"
					"<translate x='-1' y='0'/>"
				"</transform>"
				"<bsdf type='roughconductor'>"
					"<string name='material' value='none'/>"
					"<float name='alpha' value='.3'/>"
				"</bsdf>"
			"</shape>"
		"</scene>";
	/* clang-format on */
	static const char bent[] = "v -3 -1 -3\nv 3 -1.2 -3\nv 3 -1 3\nv -3 -1.1 3\nv 0 -.7 0\n"
				   "vn -.5 1 .3\nvn .4 1 -.4\nvn .6 1 .2\nvn -.2 1 .7\nvn .3 1 -.5\n"
				   "f 1//1 5//5 2//2\nf 2//2 5//5 3//3\nf 3//3 5//5 4//4\nf 4//4 5//5 1//1\n";
	const struct memory_file files[] = {
		{"bent.xml", scene, sizeof scene - 1}, {"bent.obj", bent, sizeof bent - 1}, {NULL, NULL, 0}};
	density_check("bent normals", world_from_files(32, 24, files), 20000);
	density_check("turned normals", room_build_named("turned normals"), 12000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(densities_agree_for_diffuse_and_rough_surfaces),
		cmocka_unit_test(densities_agree_for_specular_surfaces),
		cmocka_unit_test(densities_agree_for_infinite_emitters),
		cmocka_unit_test(densities_agree_through_see_through_surfaces),
		cmocka_unit_test(densities_agree_in_fog_of_blended_phases),
		cmocka_unit_test(densities_agree_in_fog_of_flakes),
		cmocka_unit_test(densities_agree_in_fog),
		cmocka_unit_test(densities_agree_in_fog_of_varying_density),
		cmocka_unit_test(densities_agree_for_a_wide_lens),
		cmocka_unit_test(densities_agree_for_delta_lights),
		cmocka_unit_test(densities_agree_for_tilted_vertex_normals),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
