/* SPDX-License-Identifier: Apache-2.0 */
/* Phase functions with several parts in scenes: a weight on a grid, evaluated at the point of scattering; the
 * scattering coefficient that the weights of a mixture leave; errors. */
#include "tests/support/memory_assets.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"
#include "worker/render/medium/medium.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static struct vol grid;
static const vec3 along_z = {0, 0, 1};

static double ramp_along_x(double x, double y, double z, uint32_t channel)
{
	(void)y, (void)z;
	return 0.25 + 0.5 * x + 0.125 * channel;
}

/* A sphere of a medium that scatters by `phase`; g.vol is `grid`. */
static const struct memory_file *make_scene_files(const char *phase)
{
	static char xml[2048];
	static struct memory_file files[3];
	snprintf(xml, sizeof xml,
		 "<scene version='3.0.0'>" SENSOR("0,0,9",
						  "0,0,0") "<emitter type='constant'/><shape type='sphere'>"
							   "<bsdf type='null'/><medium type='homogeneous' "
							   "name='interior'><float name='sigma_t' value='4'/>"
							   "<float name='albedo' value='0.5'/>%s</medium></shape>"
							   "</scene>",
		 phase);
	files[0] = (struct memory_file){"s.xml", xml, strlen(xml)};
	files[1] = (struct memory_file){"g.vol", grid.bytes, grid.size};
	return files;
}

#define ON_GRID "<volume type='gridvolume' name='weight'><string name='filename' value='g.vol'/></volume>"
#define FORWARDS "<phase type='hg'><float name='g' value='0.5'/></phase>"
#define TABLE "<phase type='tabphase'><string name='values' value='0,1,3'/></phase>"
#define BLEND(weight) "<phase type='blendphase'>" weight "<phase name='a' type='isotropic'/>" FORWARDS "</phase>"
#define MIXTURE(weights, parts) \
	"<phase type='mixturephase'><string name='weights' value='" weights "'/>" parts "</phase>"

/* Two values along x, at the centres of the halves of the unit cube: the weight is interpolated between them, and
 * constant beyond. */
static void test_weights_on_grids_are_interpolated(void **state)
{
	(void)state;
	static const struct {
		double x, weight;
	} places[] = {{-1, 0.25}, {0.1, 0.25}, {0.25, 0.25}, {0.5, 0.5}, {0.6, 0.6}, {0.75, 0.75}, {0.9, 0.75}};
	vol_make(&grid, (const uint32_t[3]){2, 1, 1}, 1, ramp_along_x);
	struct world *w = world_from_files(8, 8, make_scene_files(BLEND(ON_GRID)));
	const struct phase *p = &w->media[0].phase;
	vec3 wo = {0, 0.6, 0.8}, wi = {0, 0, -1}; /* the cosine of the scattering angle is 0.8 */
	double even = 1 / (4 * M_PI), forwards = even * 0.75 / pow(0.45, 1.5);
	for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
		double weight = places[i].weight, pdf;
		vec3 at = vec3_scale(w->scale, vec3_sub((vec3){places[i].x, 0.3, 0.4}, w->center));
		assert_true(fabs(phase_eval(p, at, wo, wi) - ((1 - weight) * even + weight * forwards)) < 1e-7);
		/* The numbers u that choose the first part: half of its directions go backwards. */
		unsigned back = 0;
		for (int k = 0; k < 1000; k++) {
			vec3 drawn = phase_sample(p, at, wo, (const double[2]){(k + 0.5) / 1000, 0.3}, &pdf);
			back += vec3_dot(drawn, wo) > 0 && (k + 0.5) / 1000 < 1 - weight;
			assert_true(fabs(pdf / phase_eval(p, at, wo, drawn) - 1) < 1e-12);
		}
		assert_true(fabs(back - 500 * (1 - weight)) < 2);
	}
	world_free(w);
}

static void test_missing_weight_is_absorbed(void **state)
{
	(void)state;
	const struct wavelengths wl = wavelengths_sample(0.3);
	struct world *w = world_from_files(8, 8, make_scene_files(MIXTURE(".2; .5", FORWARDS TABLE)));
	const struct medium *m = &w->media[0];
	const vec3 o = {0, 0, 0};
	assert_true(fabs(medium_scattering(m, o, along_z, &wl).v[0] * w->scale - 0.7 * 2) < 1e-12);
	assert_true(fabs(medium_extinction(m, o, along_z, &wl).v[0] * w->scale - 4) < 1e-12);
	double table = 1.8 / (2.5 * 2 * M_PI), forwards = 0.75 / (4 * M_PI * pow(0.85, 1.5)); /* at the cosine 0.4 */
	double found = m->phase.ops->eval(&m->phase, o, 0.4);
	assert_true(fabs(found - (0.2 * forwards + 0.5 * table) / 0.7) < 1e-12);
	world_free(w);
}

/* A weight above 1 selects the second part alone. */
static void test_weight_above_one_selects_the_second_part(void **state)
{
	(void)state;
	struct world *w = world_from_files(8, 8, make_scene_files(BLEND("<float name='weight' value='1.5'/>")));
	const struct phase *p = &w->media[0].phase;
	const vec3 o = {0, 0, 0};
	assert_true(fabs(p->ops->eval(p, o, 0.4) - 0.75 / (4 * M_PI * pow(0.85, 1.5))) < 1e-12);
	world_free(w);
}

static void test_invalid_phases_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *phase, *why;
	} cases[] = {
		{"<phase type='blendphase'>" FORWARDS "</phase>", "needs exactly two phase functions inside"},
		{"<phase type='blendphase'>" FORWARDS FORWARDS FORWARDS "</phase>",
		 "needs exactly two phase functions"},
		{BLEND("<spectrum name='weight' value='400:1.5, 500:1'/>"), "weight=1.5 is outside [0, 1]"},
		{BLEND("<rgb name='weight' value='.2,.3,.4'/>"), "weight: is a colour; it must be the same at all"},
		{BLEND("<texture name='weight' type='checkerboard'/>"), "`weight` may be a volume, but not a texture"},
		{BLEND(ON_GRID), "weight: is a colour"},
		{"<phase type='mixturephase'/>", "needs phase functions inside"},
		{MIXTURE("1", FORWARDS FORWARDS), "needs 2 weights, one for each phase function"},
		{MIXTURE("1,x", FORWARDS FORWARDS), "needs 2 weights"},
		{MIXTURE("1,-1", FORWARDS FORWARDS), "weights=\"1,-1\": must be within [0, 1e6]"},
		{MIXTURE("0,0", FORWARDS FORWARDS), "weights=\"0,0\": all are 0"},
		{MIXTURE(".5,.5", FORWARDS MIXTURE(".5", FORWARDS)), "its weights must add up to 1 inside another"},
		{"<phase type='tabphase'/>", "values: needs a list of 2 to 65536 numbers"},
		{"<phase type='tabphase'><string name='values' value='1'/></phase>", "values: needs a list of 2"},
		{"<phase type='tabphase'><string name='values' value='1,nan'/></phase>", "values: needs a list of 2"},
		{"<phase type='tabphase'><string name='values' value='1,-2'/></phase>",
		 "values: -2 is outside [0, 1e+30]"},
		{"<phase type='tabphase'><string name='values' value='0,0,0'/></phase>", "values: all are 0"},
		{"<phase type='hg'>" FORWARDS "</phase>", "a phase without a name has no place in <phase type=\"hg\">"},
	};
	vol_make(&grid, (const uint32_t[3]){2, 1, 1}, 3, ramp_along_x);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		world_check_files_refused(make_scene_files(cases[i].phase), cases[i].why);
	char many[2000] = "<phase type='mixturephase'>";
	for (int i = 0; i < 17; i++)
		strcat(many, "<phase type='isotropic'/>");
	strcat(many, "</phase>");
	world_check_files_refused(make_scene_files(many), "more than 16 phase functions inside");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_weights_on_grids_are_interpolated),
		cmocka_unit_test(test_missing_weight_is_absorbed),
		cmocka_unit_test(test_weight_above_one_selects_the_second_part),
		cmocka_unit_test(test_invalid_phases_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
