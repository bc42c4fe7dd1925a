/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Media of SGGX microflakes in scenes: the extinction along a direction, for constant matrices and matrices on a grid,
 * and for constant densities and densities on a grid; the optical depth as its integral, by the midpoint rule with
 * 200,000 steps; the distance at which the depth reaches a value; errors.
 */
#include "tests/support/dice.h"
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

static struct vol matrices, density;

/* A matrix that rotates from x to y along z, and decreases along x. */
static double matrix_at(double x, double y, double z, uint32_t channel)
{
	double c = cos(2 * z), s = sin(2 * z), size = 1 - 0.7 * x, thin = 0.1 + 0.3 * y;
	const double m[6] = {c * c + thin * s * s, s * s + thin * c * c, thin, (1 - thin) * c * s, 0, 0};
	return size * m[channel];
}

static double density_at(double x, double y, double z, uint32_t channel)
{
	return 1 + sin(3 * x + channel) * cos(2 * y) * cos(4 * z);
}

#define AT "<transform name='to_world'><scale x='2' y='1.5' z='1'/><translate x='-1' y='0.2'/></transform>"
#define MATRICES "<volume type='gridvolume' name='S'><string name='filename' value='s.vol'/>" AT "</volume>"
#define DENSITY "<volume type='gridvolume' name='sigma_t'><string name='filename' value='d.vol'/>" AT "</volume>"
#define S_OF(text) "<volume type='constvolume' name='S'><string name='value' value='" text "'/></volume>"

static const struct memory_file *make_scene_files(const char *version, const char *type, const char *sigma_t,
						  const char *phase)
{
	static char xml[4096];
	static struct memory_file files[4];
	snprintf(xml, sizeof xml,
		 "<scene version='%s'>" SENSOR("0,0,9", "0,0,0") "<emitter type='constant'/><shape type='sphere'>"
								 "<bsdf type='null'/><medium type='%s' "
								 "name='interior'>%s<float name='albedo' value='0.5'/>"
								 "%s</medium></shape></scene>",
		 version, type, sigma_t, phase);
	files[0] = (struct memory_file){"s.xml", xml, strlen(xml)};
	files[1] = (struct memory_file){"s.vol", matrices.bytes, matrices.size};
	files[2] = (struct memory_file){"d.vol", density.bytes, density.size};
	return files;
}

static vec3 in_world(const struct world *w, vec3 p)
{
	return vec3_scale(w->scale, vec3_sub(p, w->center));
}

/* Checks rays through the box from (-1, .2, 0) to (1, 1.7, 1). */
static void check_depths(const struct world *w, const char *name)
{
	enum { STEPS = 200000 };
	const struct medium *m = &w->media[0];
	const struct wavelengths wl = wavelengths_sample(0.3);
	struct dice d = dice_for_test(name);
	double most = 0;
	for (int round = 0; round < 5; round++) {
		vec3 from = {dice_between(&d, -1.2, 1), dice_between(&d, 0, 1.7), dice_between(&d, -0.2, 1)},
		     to = {dice_between(&d, -1, 1.2), dice_between(&d, 0.2, 1.9), dice_between(&d, 0, 1.2)};
		vec3 o = in_world(w, from), way = vec3_sub(in_world(w, to), o);
		double length = vec3_length(way), sum = 0;
		const struct grid_ray r = {o, vec3_scale(1 / length, way), 0, length};
		for (int i = 0; i < STEPS; i++)
			sum += medium_extinction(m, vec3_madd(o, (i + 0.5) * length / STEPS, r.d), r.d, &wl).v[0];
		sum *= length / STEPS;
		struct medium_lanes forth = medium_lanes_along(m, r.d, &wl),
				    back = medium_lanes_along(m, vec3_neg(r.d), &wl);
		const struct grid_ray turned = {in_world(w, to), vec3_neg(r.d), 0, length};
		double depth = medium_optical_depth(&forth, &r).v[0];
		assert_true(depth > 0.01);
		most = fmax(most, fabs(depth / sum - 1));
		assert_true(fabs(medium_optical_depth(&back, &turned).v[0] / depth - 1) < 1e-9);
		spectrum reached, left;
		double t = medium_invert_depth(&forth, &r, 0, 0.4 * depth, &reached);
		assert_true(t > 0 && t < length && fabs(reached.v[0] / (0.4 * depth) - 1) < 1e-6);
		left = medium_optical_depth(&forth, &(struct grid_ray){o, r.d, t, length});
		assert_true(fabs(left.v[0] / (0.6 * depth) - 1) < 1e-5);
	}
	printf("%s: depths off by %.1e at most\n", name, most);
	assert_true(most < 1e-5);
}

static void test_depths_through_grids_are_exact(void **state)
{
	(void)state;
	static const struct {
		const char *name, *sigma_t;
	} cases[] = {{"flakes in a box",
		      "<volume type='constvolume' name='sigma_t'><float name='value' value='1.5'/>" AT "</volume>"},
		     {"flakes on a grid", DENSITY}};
	static const uint32_t side[3] = {4, 3, 5};
	vol_make(&matrices, side, 6, matrix_at);
	for (uint32_t channels = 1; channels <= 3; channels += 2)
		for (int k = 0; k < 2; k++) {
			vol_make(&density, side, channels, density_at);
			const struct memory_file *files = make_scene_files("3.0.0", "heterogeneous", cases[k].sigma_t,
									   "<phase type='sggx'>" MATRICES "</phase>");
			struct world *w = world_from_files(8, 8, files);
			check_depths(w, cases[k].name);
			world_free(w);
		}
}

/* At the centre of a cell, the matrix is that of the file, in world axes. */
static void test_matrices_are_in_world_axes(void **state)
{
	(void)state;
	static const uint32_t side[3] = {2, 2, 2};
	vol_make(&matrices, side, 6, matrix_at);
	vol_make(&density, side, 1, density_at);
	struct world *w =
		world_from_files(8, 8,
				 make_scene_files("3.0.0", "heterogeneous",
						  "<volume type='gridvolume' name='sigma_t'><string name='filename' "
						  "value='d.vol'/></volume>",
						  "<phase type='sggx'><volume type='gridvolume' name='S'><string "
						  "name='filename' value='s.vol'/></volume></phase>"));
	const struct wavelengths wl = wavelengths_sample(0.3);
	for (int k = 0; k < 8; k++) {
		double x = k & 1, y = k >> 1 & 1, z = k >> 2;
		vec3 p = in_world(w, (vec3){0.25 + x / 2, 0.25 + y / 2, 0.25 + z / 2}), d = {0.36, 0.48, 0.8};
		double s[6], square = 0;
		for (uint32_t c = 0; c < 6; c++)
			s[c] = matrix_at(x, y, z, c);
		square = s[0] * d.x * d.x + s[1] * d.y * d.y + s[2] * d.z * d.z +
			 2 * (s[3] * d.x * d.y + s[4] * d.x * d.z + s[5] * d.y * d.z);
		double wanted = density_at(x, y, z, 0) * sqrt(square),
		       found = medium_extinction(&w->media[0], p, d, &wl).v[0] * w->scale;
		assert_true(fabs(found / wanted - 1) < 1e-6);
		assert_true(fabs(medium_scattering(&w->media[0], p, d, &wl).v[0] * w->scale / wanted - 0.5) < 1e-6);
	}
	world_free(w);
}

/* A constant matrix, given by six numbers and by a grid of one point, in both kinds of media. */
static void test_constant_matrices_agree(void **state)
{
	(void)state;
	static const char *const kinds[] = {
		"<phase type='sggx'>" S_OF("0.5, 0.3 0.4, 0.1, -0.05, 0.02") "</phase>",
		"<phase type='sggx'><volume type='gridvolume' name='S'><string name='filename' value='s.vol'/></volume>"
		"</phase>"};
	const float s[6] = {0.5F, 0.3F, 0.4F, 0.1F, -0.05F, 0.02F};
	vol_make(&matrices, (const uint32_t[3]){1, 1, 1}, 6, matrix_at);
	memcpy(matrices.value, s, sizeof s);
	vol_write(&matrices);
	vol_make(&density, (const uint32_t[3]){2, 2, 2}, 1, density_at);
	const struct wavelengths wl = wavelengths_sample(0.3);
	vec3 d = {0.36, 0.48, 0.8};
	double area = sqrt(0.5 * 0.1296 + 0.3 * 0.2304 + 0.4 * 0.64 + 0.2 * 0.1728 - 0.1 * 0.288 + 0.04 * 0.384);
	for (int k = 0; k < 4; k++) {
		struct world *w =
			world_from_files(8, 8,
					 make_scene_files("3.0.0", k & 1 ? "heterogeneous" : "homogeneous",
							  "<float name='sigma_t' value='3'/>", kinds[k >> 1]));
		vec3 p = in_world(w, (vec3){0.5, 0.5, 0.5});
		double found = medium_extinction(&w->media[0], p, d, &wl).v[0] * w->scale;
		assert_true(fabs(found / (3 * area) - 1) < 1e-6);
		struct medium_lanes lanes = medium_lanes_along(&w->media[0], d, &wl);
		double depth = medium_optical_depth(&lanes, &(struct grid_ray){p, d, 0, 0.1 * w->scale}).v[0];
		assert_true(fabs(depth / (0.3 * area) - 1) < 1e-6);
		world_free(w);
	}
}

#define FLAKES(volume) "<phase type='sggx'>" volume "</phase>"
#define ONE "1,1,1,0,0,0"
#define FILE_OF(more) "<volume type='gridvolume' name='S'><string name='filename' value='s.vol'/>" more "</volume>"

static void test_invalid_flakes_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *type, *sigma_t, *phase, *why;
	} cases[] = {
		{"homogeneous", "", FLAKES(""), "needs a volume `S`"},
		{"homogeneous", "", FLAKES("<float name='S' value='1'/>"), "`S` cannot have this type"},
		{"homogeneous", "", FLAKES(S_OF("1,1,1,0,0")), "S: needs six numbers (xx yy zz, xy xz yz)"},
		{"homogeneous", "", FLAKES(S_OF("1,1,1,0,0,0,0")), "S: needs six numbers"},
		{"homogeneous", "", FLAKES(S_OF("1,1,1,0,0,x")), "S: needs six numbers"},
		{"homogeneous", "",
		 FLAKES("<volume type='constvolume' name='S'><float name='value' value='1'/></volume>"),
		 "S: needs six numbers"},
		{"homogeneous", "", FLAKES(S_OF("1,1,1,2,0,0")), "is not positive definite"},
		{"homogeneous", "", FLAKES(S_OF("1,1,-1,0,0,0")), "is not positive definite"},
		{"homogeneous", "", FLAKES(S_OF("0,0,0,0,1,0")), "is not positive definite"},
		{"homogeneous", "", FLAKES(S_OF("1e13,1,1,0,0,0")), "S: 1e+13 is outside [-1e+12, 1e+12]"},
		{"homogeneous", "", FLAKES(FILE_OF("")), "S varies in space: needs a heterogeneous medium"},
		{"heterogeneous",
		 "<volume type='gridvolume' name='sigma_t'><string name='filename' value='d.vol'/></volume>",
		 FLAKES(FILE_OF("")), "the grids of sigma_t and of S must have the same size"},
		{"heterogeneous", "", FLAKES(FILE_OF("<string name='wrap_mode' value='repeat'/>")),
		 "must have the same"},
		{"heterogeneous", "",
		 FLAKES("<volume type='gridvolume' name='S'><string name='filename' value='d.vol'/></volume>"),
		 "supported are version 3, types 1 (floats) and 3 (bytes), 6 channels"},
		{"homogeneous", "",
		 "<phase type='blendphase'>" FLAKES(S_OF(ONE)) "<phase name='b' type='isotropic'/></phase>",
		 "microflakes are not supported inside another phase function"},
		{"homogeneous",
		 "<volume type='constvolume' name='sigma_t'><string name='value' value='1,1,1'/></volume>", "",
		 "value: "},
	};
	vol_make(&matrices, (const uint32_t[3]){4, 3, 5}, 6, matrix_at);
	vol_make(&density, (const uint32_t[3]){4, 3, 4}, 1, density_at);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		world_check_files_refused(make_scene_files("3.0.0", cases[i].type, cases[i].sigma_t, cases[i].phase),
					  cases[i].why);
	world_check_files_refused(
		make_scene_files("0.6.0", "homogeneous", "<float name='sigma_t' value='1'/>", FLAKES("")),
		"a scene of 0.6 has no \"sggx\"");
	matrices.value[6 * 7 + 2] = -1;
	vol_write(&matrices);
	world_check_files_refused(make_scene_files("3.0.0", "heterogeneous", "", FLAKES(FILE_OF(""))),
				  "is not positive definite");
	matrices.value[6 * 7 + 2] = 1e13F;
	vol_write(&matrices);
	world_check_files_refused(make_scene_files("3.0.0", "heterogeneous", "", FLAKES(FILE_OF(""))),
				  "S: its values go from ");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_depths_through_grids_are_exact),
		cmocka_unit_test(test_matrices_are_in_world_axes),
		cmocka_unit_test(test_constant_matrices_agree),
		cmocka_unit_test(test_invalid_flakes_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
