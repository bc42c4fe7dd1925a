/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Full paths against the sub-paths that they are joined from: contribution and densities are multiplied out once by
 * the connections of bdpt and once vertex by vertex, and every cached quantity is recomputed.
 */
#include "tests/support/worlds.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/path/full_path.h"
#include "tests/support/path_check.h"
#include "worker/render/path/full_path_density.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
/* clang-format off */
#define ROOM                                                                                                                    \
	SENSOR("0,0.2,1.9", "0,-0.3,-1")                                                                                        \
	"<shape type='cube'>" AT("<scale value='2'/>") "<bsdf type='diffuse'><rgb name='reflectance' value='0.5,0.45,0.35'/>"     \
	"</bsdf></shape>"
#define LAMP                                                                                                                    \
	"<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>")                       \
	"<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>"
/* clang-format on */
#define BALL(bsdf)                                                                                               \
	"<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>" bsdf \
	"</shape>"

enum { EDGES = 8 };

/* Returns X + Y + Z of `l` and stores the shares of X, Y and Z. */
static double intensity_of(struct path_context *c, spectrum l, double share[3])
{
	struct path_sample s = {.splat_count = 0, .intensity = 0};
	path_sample_add_splat(c, &s, 0, 0, l);
	for (int k = 0; k < 3 && s.intensity > 0; k++)
		share[k] = s.splats[0].xyz[k] / s.intensity;
	return s.intensity;
}

/* The balance heuristic over all techniques turns the estimate f / p_s into f / sum p. */
static double balance_heuristic_estimate(struct path_context *c, struct full_path *x)
{
	double log_pdf[FULL_PATH_VERTICES_MAX], log_f = full_path_log_f(c, x), sum = 0;
	full_path_log_technique_pdfs(c, x, log_pdf);
	for (unsigned s = 0; s <= x->edges; s++)
		sum += exp(log_pdf[s] - log_f);
	return 1 / sum;
}

struct tally {
	unsigned long compared, disagreeing, black, refracted;
	double max_error;
};

static void compare_full_path(struct path_context *c, unsigned s, unsigned edges, struct tally *t)
{
	static struct full_path x;
	double film[2], share[3], colour[3];
	double expected = intensity_of(c, path_connect(c, s, edges + 1 - s, PATH_EDGES_MAX, film), share);
	bool is_full_path = full_path_from_subpaths(c, s, c->passed_count, edges + c->passed_count, &x);
	if (!is_full_path || expected == 0) {
		/* rounding may move a film point drawn on the border to the other side of it */
		t->black++;
		t->disagreeing += is_full_path != (expected > 0);
		return;
	}
	char text[200];
	if (!path_check(c, &x, text, sizeof text))
		fail_msg("technique %u of %u edges: %s", s, edges, text);
	double got = balance_heuristic_estimate(c, &x), relative_error = fabs(got - expected) / expected;
	full_path_colour(c, &x, colour);
	for (int k = 0; k < 3; k++)
		relative_error = fmax(relative_error, fabs(colour[k] - share[k]));
	t->compared++;
	t->refracted += s == 1 && path_vertex_is_refracting(&x.v[1]);
	if (relative_error > t->max_error)
		t->max_error = relative_error;
}

/* Returns the number of paths with a refracted connection. */
static unsigned long check_paths(const char *name, struct world *w, unsigned long samples)
{
	static struct path_context c;
	uint64_t counters[BATCH_COUNTERS] = {0};
	c = (struct path_context){
		.w = w,
		.window = {0, 0, 32, 32},
		.min_depth = 1,
		.max_depth = EDGES,
		.counters = counters,
		.refract = halfvec_refract,
	};
	struct tally t = {0};
	for (unsigned long i = 0; i < samples; i++) {
		struct sampler_random s;
		double film[2];
		sampler_random_init(&s, 0x77686f6c65, RNG_TEST, i, 0);
		unsigned camera = path_walk_camera(&c, &s.base, EDGES + 1, film),
			 light = path_walk_light(&c, &s.base, EDGES);
		for (unsigned edges = 1; edges <= EDGES; edges++)
			for (unsigned k = 0; k <= edges; k++) {
				unsigned tail = edges + 1 - k;
				if (tail > camera || (k > 1 && k > light) || (k == 1 && (edges < 2 || tail < 2)))
					continue;
				compare_full_path(&c, k, edges, &t);
			}
	}
	printf("%s: %lu paths, largest difference %.3g, %lu black, %lu in doubt\n", name, t.compared, t.max_error,
	       t.black, t.disagreeing);
	assert_true(t.compared > samples);
	assert_true(t.max_error < 1e-7);
	assert_true(t.disagreeing * 10000 <= t.compared);
	world_free(w);
	return t.refracted;
}

static void full_paths_agree_on_surfaces(void **state)
{
	(void)state;
	check_paths("rough glass",
		    world_from_text(
			    32, 32,
			    ROOM LAMP BALL("<bsdf type='roughdielectric'><float name='alpha' value='0.2'/></bsdf>")),
		    1500);
	check_paths("glass with holes",
		    world_from_text(32, 32,
				    ROOM LAMP BALL("<bsdf type='mask'><float name='opacity' value='0.8'/>"
						   "<bsdf type='dielectric'/></bsdf>")),
		    3000);
	check_paths(
		"gold",
		world_from_text(32, 32,
				ROOM LAMP BALL("<bsdf type='roughconductor'><float name='alpha' value='0.1'/></bsdf>")),
		1500);
	check_paths("mirror", world_from_text(32, 32, ROOM LAMP BALL("<bsdf type='conductor'/>")), 1500);
	/* clang-format off */
	check_paths("turned normals", world_from_text(32, 32,
		ROOM LAMP
		BALL(
			"<bsdf type='normalmap'>"
				"<texture type='checkerboard'>"
					"<rgb name='color0' value='.9,.35,.8'/>"
					"<rgb name='color1' value='.15,.8,.75'/>"
				"</texture>"
				"<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf>"
			"</bsdf>")), 1500);
	/* clang-format on */
	check_paths("phong", world_from_text(32, 32, ROOM LAMP BALL("<bsdf type='phong'/>")), 1500);
	/* The probability of going straight on through a hair differs between paths from the lamp and paths from the
	 * camera. */
	check_paths("hair", world_from_text(32, 32, ROOM LAMP BALL("<bsdf type='hair'/>")), 3000);
	/* Curves do not scatter at their backs. */
	check_paths("hairs", world_from_own_scene("integrators", "hair.xml", 32, 32), 3000);
}

/* Coloured glass around a stone that states no medium and around a bubble that states its exterior medium; water up
 * to the lamp. */
static void full_paths_agree_in_media(void **state)
{
	(void)state;
/* clang-format off */
#define MEDIUM(side, sigma) \
	"<medium type='homogeneous' name='" side "'>" \
		"<rgb name='sigma_a' value='" sigma "'/>" \
		"<spectrum name='sigma_s' value='0'/>" \
	"</medium>"
#define INSIDE(radius, x, inner) \
	"<shape type='sphere'>" \
		"<point name='center' value='" x ",-0.6,-0.3'/>" \
		"<float name='radius' value='" radius "'/>" \
		inner \
	"</shape>"
	struct world *w = world_from_text(32, 32,
		ROOM LAMP
		BALL(
			"<bsdf type='roughdielectric'><float name='alpha' value='0.3'/></bsdf>"
			MEDIUM("interior", "0.3,1,2"))
		INSIDE("0.3", "-0.3", "<bsdf type='diffuse'/>")
		INSIDE("0.2", "0.3",
			"<bsdf type='roughdielectric'>"
				"<float name='int_ior' value='1.2'/>"
				"<float name='ext_ior' value='1.5'/>"
				"<float name='alpha' value='0.3'/>"
			"</bsdf>"
			MEDIUM("exterior", "0.3,1,2")));
	/* clang-format on */
	assert_true(w->effects.absorption && w->media_count == 2);
	check_paths("coloured glass", w, 4000);
	/* clang-format off */
	check_paths("from haze", world_from_text(32, 32,
		"<sensor type='perspective'>"
			"<float name='fov' value='40'/>"
			"<float name='near_clip' value='0.5'/>"
			AT("<lookat origin='0,0.2,1.9' target='0,-0.3,-1' up='0,1,0'/>")
			MEDIUM("medium", "0.4,0.2,0.1")
		"</sensor>"
		"<shape type='cube'>" AT("<scale value='2'/>") "</shape>"
		LAMP
		BALL("<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf>")), 1500);
	check_paths("a layer of water", world_from_text(32, 32,
		ROOM LAMP
		BALL("<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf>")
		"<shape type='cube'>"
			AT("<scale x='1.9' y='0.5' z='1.9'/><translate y='-1.4'/>")
			"<bsdf type='dielectric'><float name='int_ior' value='1.33'/></bsdf>"
			MEDIUM("interior", "0.9,0.4,0.2")
		"</shape>"), 4000);
	/* clang-format on */
}

/* Next-event estimation samples a sphere within the cone in which the vertex sees it; a light sub-path starts
 * anywhere on the sphere's area. */
static void full_paths_agree_for_a_spherical_lamp(void **state)
{
	(void)state;
	/* clang-format off */
	check_paths("round lamp, gold", world_from_text(32, 32,
		ROOM
		"<shape type='sphere'>"
			"<point name='center' value='0.8,1,-0.5'/>"
			"<float name='radius' value='0.3'/>"
			"<emitter type='area'><rgb name='radiance' value='9,8,7'/></emitter>"
		"</shape>"
		BALL("<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf>")), 1500);
	/* clang-format on */
}

static void full_paths_agree_for_an_environment(void **state)
{
	(void)state;
	/* clang-format off */
	check_paths("environment", world_from_text(32, 32,
		SENSOR("0,1,5", "0,0,0")
		"<shape type='rectangle'>"
			AT("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1'/>")
		"</shape>"
		BALL("<bsdf type='roughdielectric'><float name='alpha' value='0.3'/></bsdf>")
		"<emitter type='constant'><rgb name='radiance' value='0.8,0.9,1'/></emitter>"), 3000);
	/* clang-format on */
}

/* A lens, and lights that no path can hit, beside an environment. */
static void full_paths_agree_for_lenses_and_delta_lights(void **state)
{
	(void)state;
	/* clang-format off */
	static const char lens[] =
		"<sensor type='thinlens'>"
			"<float name='fov' value='40'/>"
			"<float name='aperture_radius' value='.4'/>"
			"<float name='focus_distance' value='3'/>"
			AT("<lookat origin='0,1,5' target='0,0,0' up='0,1,0'/>")
		"</sensor>";
	static const char lights[] =
		"<emitter type='point'>"
			"<point name='position' x='1.5' y='2' z='1'/>"
			"<float name='intensity' value='3'/>"
		"</emitter>"
		"<emitter type='spot'>"
			"<float name='cutoff_angle' value='40'/>"
			AT("<lookat origin='-1,3,1' target='0,0,0' up='1,0,0'/>")
		"</emitter>"
		"<emitter type='directional'><vector name='direction' x='.3' y='-1' z='-.2'/></emitter>";
	static const char floor[] =
		"<shape type='rectangle'>"
			AT("<scale value='3'/><rotate x='1' angle='-90'/><translate y='-1'/>")
		"</shape>"
		"<shape type='rectangle'>" AT("<scale value='3'/><translate z='-2'/>") "</shape>";
	check_paths("lens and lamps, rough", world_from_text(32, 32, "%s%s%s%s", lens, lights, floor,
		BALL("<bsdf type='roughdielectric'><float name='alpha' value='0.3'/></bsdf>")
		"<emitter type='constant'><float name='radiance' value='.2'/></emitter>"), 3000);
	/* clang-format on */
	check_paths("lens and lamps, glass",
		    world_from_text(32, 32, "%s%s%s%s", lens, lights, floor, BALL("<bsdf type='dielectric'/>")), 6000);
}

/* Connections through panes, through holes, and through a block that absorbs light between faces that let it straight
 * through. */
static void full_paths_agree_through_see_through_surfaces(void **state)
{
	(void)state;
	/* clang-format off */
	struct world *w = world_from_text(32, 32,
		ROOM LAMP
		BALL("<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf>")
		"<emitter type='point'>"
			"<point name='position' x='-.5' y='1.5' z='.5'/>"
			"<float name='intensity' value='3'/>"
		"</emitter>"
		"<shape type='cube'>"
			AT("<scale x='1.5' y='.2' z='1.5'/><rotate z='1' angle='10'/><translate y='1'/>")
			"<bsdf type='thindielectric'/>"
			MEDIUM("interior", "0.9,2,0.2")
		"</shape>"
		"<shape type='rectangle'>"
			AT("<scale value='.3'/><translate y='.1' z='1.2'/>")
			"<bsdf type='mask'>"
				"<texture name='opacity' type='checkerboard'>"
					"<float name='color0' value='.2'/>"
					"<float name='color1' value='.7'/>"
				"</texture>"
				"<bsdf type='diffuse'/>"
			"</bsdf>"
		"</shape>");
	/* clang-format on */
	assert_true(w->effects.transparent_shadows && w->effects.absorption);
	check_paths("panes", w, 3000);
}

/* Small lamps in, under and behind glass of several kinds, some of which absorbs, disperses or has bent normals. */
static void full_paths_agree_with_refracted_connections(void **state)
{
	(void)state;
	/* clang-format off */
	assert_true(check_paths("lamps behind glass", world_from_text(32, 32, "%s",
		ROOM
		BALL("<bsdf type='dielectric'/>")
		"<shape type='sphere'>"
			"<point name='center' x='0' y='1' z='-1'/><float name='radius' value='.4'/>"
			"<bsdf type='dielectric'><float name='int_ior' value='1.2'/></bsdf>"
			"<medium name='interior' type='homogeneous'><float name='albedo' value='0'/>"
				"<rgb name='sigma_t' value='.5,1,2'/></medium>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='.1' y='1' z='-1'/><float name='radius' value='.02'/>"
			"<emitter type='area'><float name='radiance' value='90'/></emitter>"
		"</shape>"
		"<emitter type='point'><point name='position' x='-.5' y='-1' z='-1.9'/></emitter>"), 3000) > 300);
	assert_true(check_paths("a prism and the sun", world_from_text(32, 32, "%s",
		SENSOR("0,-1,2.8", "0,-1.4,0")
		"<shape type='rectangle'>" AT("<scale value='3'/><rotate x='1' angle='-90'/><translate y='-1.5'/>")
			"<bsdf type='phong'/></shape>"
		"<shape type='cube'>" AT("<scale x='4' y='.1' z='4'/><rotate z='1' angle='20'/>")
			"<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='int_cauchy_b' value='.02'/>"
		"</bsdf></shape>"
		"<emitter type='directional'><vector name='direction' value='.2,-1,.1'/></emitter>"
		"<emitter type='constant'><float name='radiance' value='.2'/></emitter>"), 3000) > 300);
	/* clang-format on */
}

/* Surfaces that a connection passes through count as edges: no path is shorter or longer than requested, and some
 * paths are long enough only because of these surfaces. */
static void passed_surfaces_count_as_edges(void **state)
{
	(void)state;
	enum { LEAST = 4, MOST = 6 };
	static struct path_context c;
	uint64_t counters[BATCH_COUNTERS] = {0};
	unsigned joined = 0, lengthened = 0;
	/* clang-format off */
	struct world *w = world_from_text(32, 32, "%s",
		ROOM LAMP
		BALL("<bsdf type='diffuse'/>")
		"<shape type='rectangle'>"
			AT("<rotate x='1' angle='80'/><translate y='.5'/>")
			"<bsdf type='thindielectric'/>"
		"</shape>"
		"<shape type='rectangle'>"
			AT("<rotate x='1' angle='70'/><translate y='1'/>")
			"<bsdf type='thindielectric'/>"
		"</shape>");
	/* clang-format on */
	c = (struct path_context){
		.w = w, .window = {0, 0, 32, 32}, .min_depth = LEAST, .max_depth = MOST, .counters = counters};
	for (uint64_t i = 0; i < 2000; i++) {
		struct sampler_random s;
		double film[2];
		sampler_random_init(&s, 0x6c656e677468, RNG_TEST, i, 0);
		unsigned camera = path_walk_camera(&c, &s.base, MOST + 1, film),
			 light = path_walk_light(&c, &s.base, MOST);
		for (unsigned t = 1; t <= camera; t++)
			for (unsigned k = t > 1 ? 0 : 2; k <= (light > 1 ? light : 1); k++) {
				if (!path_may_connect(&c, k, t) ||
				    spectrum_is_zero(path_connect(&c, k, t, PATH_EDGES_MAX, film)))
					continue;
				unsigned edges = k + t - 1 + c.passed_count;
				assert_in_range(edges, LEAST, MOST);
				joined++;
				lengthened += k + t - 1 < LEAST;
			}
	}
	print_message("%u paths, %u of them long enough by what is passed\n", joined, lengthened);
	assert_true(joined > 1000 && lengthened > 100);
	world_free(w);
}

/* A lamp straight behind more panes than a connection may pass through: only a sub-path that goes through the panes
 * one by one finds it, so the weight of this technique is 1. With one pane less, the lamp can be connected to the
 * lens as well, a technique with the higher density. */
static void technique_beyond_the_pass_limit_has_no_weight(void **state)
{
	(void)state;
	static struct path_context c;
	uint64_t counters[BATCH_COUNTERS] = {0};
	for (unsigned panes = PATH_PASSED_VERTICES_MAX; panes <= PATH_PASSED_VERTICES_MAX + 4; panes++) {
		char xml[16384];
		size_t used = 0;
		unsigned hits = 0;
		for (unsigned i = 0; i < panes; i++)
			used += (size_t)snprintf(
				xml + used, sizeof xml - used,
				"<shape type='rectangle'>" AT("<translate z='%g'/>") "<bsdf type='null'/></shape>",
				0.1 * i);
		struct world *w = world_from_text(
			32, 32, "%s%s",
			SENSOR("0,0,4", "0,0,0") "<shape type='sphere'><point name='center' value='0,0,-1'/>"
						 "<float name='radius' value='.02'/><emitter type='area'/></shape>",
			xml);
		c = (struct path_context){.w = w,
					  .window = {14, 14, 4, 4},
					  .min_depth = 1,
					  .max_depth = 40,
					  .counters = counters,
					  .joins_emitters_to_lens = true,
					  .light_subpath_interval = 1};
		for (uint64_t i = 0; i < 8000; i++) {
			struct sampler_random s;
			double film[2];
			sampler_random_init(&s, 0x6d6f7374, RNG_TEST, i, 0);
			unsigned camera = path_walk_camera(&c, &s.base, 40, film);
			const struct path_vertex *z = &c.camera[camera - 1];
			if (camera < panes + 2 || z->emitter < 0)
				continue;
			spectrum l = path_connect(&c, 0, camera, PATH_EDGES_MAX, film),
				 whole = spectrum_mul(z->beta, path_emitted_radiance(&c, z, z->to_prev, &c.wl));
			double weight = l.v[0] / whole.v[0];
			assert_true(panes > PATH_PASSED_VERTICES_MAX ? fabs(weight - 1) < 1e-12 : weight < 0.1);
			hits++;
		}
		assert_true(hits > 10);
		world_free(w);
	}
}

/* A wall in front of the near plane, another behind the far plane, and the sky: everything that a camera path finds
 * between the two planes is visible. */
static void camera_paths_see_what_lies_between_clip_planes(void **state)
{
	(void)state;
	/* clang-format off */
	static const char sensor[] =
		"<sensor type='perspective'>"
			"<float name='fov' value='40'/>"
			"<float name='near_clip' value='2'/>"
			"<float name='far_clip' value='7'/>"
			AT("<lookat origin='0,1,5' target='0,0,0' up='0,1,0'/>")
		"</sensor>";
	static const char walls[] =
		"<shape type='rectangle'>" AT("<scale value='3'/><translate z='4'/>") "</shape>"
		"<shape type='rectangle'>" AT("<scale value='3'/><translate z='-3'/>") "</shape>";
	check_paths("clipped", world_from_text(32, 32, "%s%s%s", sensor, walls,
		BALL("<bsdf type='diffuse'/>")
		"<emitter type='constant'><float name='radiance' value='.2'/></emitter>"), 3000);
	/* clang-format on */
}

/* A surface scatters only if both directions lie on the same side of the shading normal and both on the same side of
 * the geometric normal: all eight cases, with a shading normal tilted by 60 degrees. */
static void scattering_needs_both_directions_on_one_side(void **state)
{
	(void)state;
	static struct full_path x;
	const double bend = M_PI / 3;
	x.edges = 2;
	x.v[1].x.sh = frame_around((vec3){0, 0, 1});
	x.v[1].x.ng = (vec3){sin(bend), 0, cos(bend)};
	for (int i = 0; i < 36; i++)
		for (int o = 0; o < 36; o++) {
			double a = (i + 0.5) * M_PI / 18, b = (o + 0.5) * M_PI / 18;
			vec3 wi = {sin(a), 0, cos(a)}, wo = {sin(b), 0, cos(b)};
			bool up_i = cos(a) > 0, up_o = cos(b) > 0;
			bool agree = up_i == (cos(a - bend) > 0) && up_o == (cos(b - bend) > 0);
			x.edge[0].w = vec3_neg(wi);
			x.edge[1].w = wo;
			assert_int_equal(full_path_mode(&x, 1), !agree	       ? 0
								: up_i == up_o ? BSDF_REFLECT
									       : BSDF_TRANSMIT);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(full_paths_agree_on_surfaces),
		cmocka_unit_test(full_paths_agree_in_media),
		cmocka_unit_test(full_paths_agree_for_a_spherical_lamp),
		cmocka_unit_test(full_paths_agree_for_an_environment),
		cmocka_unit_test(full_paths_agree_for_lenses_and_delta_lights),
		cmocka_unit_test(camera_paths_see_what_lies_between_clip_planes),
		cmocka_unit_test(full_paths_agree_through_see_through_surfaces),
		cmocka_unit_test(full_paths_agree_with_refracted_connections),
		cmocka_unit_test(passed_surfaces_count_as_edges),
		cmocka_unit_test(technique_beyond_the_pass_limit_has_no_weight),
		cmocka_unit_test(scattering_needs_both_directions_on_one_side),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
