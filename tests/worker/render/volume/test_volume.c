/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Volumes in scenes of both dialects: the position of a grid and the values outside it, compared with a separate
 * implementation of the rules; colours of three channels; volumes that are refused, left out with --lenient, and
 * shared; the effects of a varying medium that can be switched off.
 */
#include "worker/render/volume/volume.h"
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"
#include "worker/render/scene/node.h"

#include <fenv.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static struct vol grid, second_grid;
static const vec3 along_z = {0, 0, 1};

static double linear_field(double x, double y, double z, uint32_t channel)
{
	return 0.3 + 0.1 * x + 0.2 * y * z + 0.05 * channel * x;
}

/* A sphere of a medium, in a scene of the given version; g.vol is `grid` and h.vol `second_grid`. */
static const struct memory_file *make_scene_files(const char *version, const char *type, const char *inner)
{
	static char xml[2048];
	static struct memory_file files[4];
	snprintf(xml, sizeof xml,
		 "<scene version='%s'>" SENSOR("0,0,9", "0,0,0") "<emitter type='constant'/><shape type='sphere'>"
								 "<bsdf type='null'/><medium type='%s' name='interior'>"
								 "%s</medium></shape></scene>",
		 version, type, inner);
	files[0] = (struct memory_file){"s.xml", xml, strlen(xml)};
	files[1] = (struct memory_file){"g.vol", grid.bytes, grid.size};
	files[2] = (struct memory_file){"h.vol", second_grid.bytes, second_grid.size};
	return files;
}

static struct world *world_with(const char *version, const char *inner)
{
	return world_from_files(8, 8, make_scene_files(version, "heterogeneous", inner));
}

#define GRID(name, params) \
	"<volume type='gridvolume' name='" name "'><string name='filename' value='g.vol'/>" params "</volume>"
#define EVEN "<float name='albedo' value='0.5'/>"

/* ---- places ---- */

static double interpolate_corners(const double f[3], const int i[3])
{
	double sum = 0;
	for (int k = 0; k < 8; k++) {
		size_t at[3];
		double w = 1;
		for (int a = 0; a < 3; a++) {
			int j = i[a] + (k >> a & 1), last = (int)grid.side[a] - 1;
			at[a] = (size_t)(j < 0 ? 0 : j > last ? last : j);
			w *= k >> a & 1 ? f[a] : 1 - f[a];
		}
		sum += w * (double)grid.value[(at[2] * grid.side[1] + at[1]) * grid.side[0] + at[0]];
	}
	return sum;
}

/* u: from 0 to 1 in the box. Mitsuba 3 has values at the centres of cells, 0.6 has the outermost ones on the faces of
 * the box. */
static double expected_value(const double u[3], bool dialect_3, bool nearest)
{
	double f[3];
	int i[3];
	for (int a = 0; a < 3; a++) {
		double n = grid.side[a], x = dialect_3 ? u[a] * n - 0.5 : u[a] * (n - 1);
		if (nearest)
			x = floor(u[a] * n);
		i[a] = (int)floor(x);
		f[a] = x - i[a];
	}
	return interpolate_corners(f, i);
}

struct grid_placement {
	const char *version, *params;
	double low[3], high[3]; /* the box in the scene */
	bool nearest;
};

static void check_placement(const struct grid_placement *t)
{
	char inner[1024];
	snprintf(inner, sizeof inner,
		 "<volume type='gridvolume' name='%s'><string name='filename' value='g.vol'/>%s</volume>"
		 "<float name='scale' value='2'/>" EVEN,
		 *t->version == '0' ? "density" : "sigma_t", t->params);
	struct world *w = world_with(t->version, inner);
	const struct wavelengths wl = wavelengths_sample(0.3);
	struct dice d = dice_for_test("places of grids");
	for (int round = 0; round < 300; round++) {
		double u[3];
		bool inside = true;
		for (int a = 0; a < 3; a++) {
			u[a] = dice_between(&d, -0.2, 1.2);
			inside = inside && u[a] >= 0 && u[a] <= 1;
		}
		vec3 p = {t->low[0] + u[0] * (t->high[0] - t->low[0]), t->low[1] + u[1] * (t->high[1] - t->low[1]),
			  t->low[2] + u[2] * (t->high[2] - t->low[2])};
		p = vec3_scale(w->scale, vec3_sub(p, w->center));
		double wanted = inside ? 2 * expected_value(u, *t->version == '3', t->nearest) : 0,
		       found = medium_extinction(&w->media[0], p, along_z, &wl).v[0] * w->scale;
		if (fabs(found - wanted) > 1e-9)
			fail_msg("%s %s: %g, not %g", t->version, t->params, found, wanted);
		assert_true(fabs(medium_scattering(&w->media[0], p, along_z, &wl).v[0] * w->scale - wanted / 2) < 1e-9);
	}
	world_free(w);
}

static void test_grids_are_placed_by_dialect(void **state)
{
	(void)state;
#define TWICE "<transform name='to_world'><scale value='2'/><translate x='-1' z='.5'/></transform>"
#define OLD_TWICE "<transform name='toWorld'><scale value='2'/><translate x='-1' z='.5'/></transform>"
	static const struct grid_placement places[] = {
		{"3.0.0", "", {0, 0, 0}, {1, 1, 1}, false},
		{"3.0.0", TWICE, {-1, 0, 0.5}, {1, 2, 2.5}, false},
		{"3.0.0", "<boolean name='use_grid_bbox' value='true'/>", {-1, -2, 0}, {3, 1, 0.5}, false},
		{"3.0.0", "<boolean name='use_grid_bbox' value='true'/>" TWICE, {-3, -4, 0.5}, {5, 2, 1.5}, false},
		{"3.0.0", "<string name='filter_type' value='nearest'/>" TWICE, {-1, 0, 0.5}, {1, 2, 2.5}, true},
		{"0.6.0", "", {-1, -2, 0}, {3, 1, 0.5}, false},
		{"0.6.0", OLD_TWICE, {-3, -4, 0.5}, {5, 2, 1.5}, false},
		{"0.6.0",
		 "<point name='min' x='0' y='1' z='2'/><point name='max' x='1' y='3' z='5'/>",
		 {0, 1, 2},
		 {1, 3, 5},
		 false},
	};
	vol_make(&grid, (const uint32_t[3]){4, 3, 5}, 1, linear_field);
	vol_set_box(&grid, (const float[3]){-1, -2, 0}, (const float[3]){3, 1, 0.5f});
	for (size_t i = 0; i < sizeof places / sizeof *places; i++)
		check_placement(&places[i]);
}

/* In 3.x the bounding box of the rotated cube has the values at the border outside the cube; in 0.6 they are 0. */
static void test_rotated_grids_follow_the_dialect(void **state)
{
	(void)state;
	vol_make(&grid, (const uint32_t[3]){4, 3, 5}, 1, linear_field);
	const double c = cos(0.5), s = sin(0.5);
	for (int old = 0; old <= 1; old++) {
		char inner[1024];
		snprintf(inner, sizeof inner,
			 "<volume type='gridvolume' name='%s'><string name='filename' value='g.vol'/><transform "
			 "name='to_world'><rotate z='1' angle='%.17g'/></transform></volume>" EVEN,
			 old ? "density" : "sigma_t", 45 / acos(0));
		struct world *w = world_with(old ? "0.6.0" : "3.0.0", inner);
		const struct wavelengths wl = wavelengths_sample(0.3);
		const struct medium_lanes lanes = medium_lanes_along(&w->media[0], along_z, &wl);
		struct dice d = dice_for_test("turned grids");
		unsigned beside = 0;
		for (int round = 0; round < 500; round++) {
			vec3 p = {dice_between(&d, -0.6, 1), dice_between(&d, -0.1, 1.5), dice_between(&d, -0.1, 1.1)};
			double u[3] = {c * p.x + s * p.y, c * p.y - s * p.x, p.z}, near[3];
			bool in_cube = true,
			     in_box = p.x >= -s && p.x <= c && p.y >= 0 && p.y <= c + s && p.z >= 0 && p.z <= 1;
			for (int a = 0; a < 3; a++) {
				in_cube = in_cube && u[a] >= 0 && u[a] <= 1;
				near[a] = fmin(fmax(u[a], 0), 1);
			}
			beside += in_box && !in_cube;
			double wanted = (old ? in_cube : in_box) ? expected_value(near, !old, false) : 0;
			vec3 here = vec3_scale(w->scale, vec3_sub(p, w->center));
			double found = medium_extinction(&w->media[0], here, along_z, &wl).v[0] * w->scale;
			if (fabs(found - wanted) > 1e-9)
				fail_msg("%d: %g at %g %g %g, not %g", old, found, p.x, p.y, p.z, wanted);
			const struct grid_ray r = {here, {0, 0, 1}, 0, 1e-7};
			if (wanted == 0 || p.z < 0.99)
				assert_true(fabs(medium_optical_depth(&lanes, &r).v[0] / r.t1 * w->scale - wanted) <
					    1e-5);
		}
		assert_true(beside > 100);
		world_free(w);
	}
}

/* The values of an albedo outside its grid. */
static void test_values_outside_the_grid_follow_the_dialect(void **state)
{
	(void)state;
	static const struct {
		const char *version, *params;
		double u, expected; /* position along x, and value, for a grid of 0.25 and 0.75 */
	} cases[] = {
		{"3.0.0", "", 3.1, 0.75},
		{"3.0.0", "", -9, 0.25},
		{"3.0.0", "<string name='wrap_mode' value='repeat'/>", 3.25, 0.25},
		{"3.0.0", "<string name='wrap_mode' value='repeat'/>", 1, 0.5},
		{"3.0.0", "<string name='wrap_mode' value='mirror'/>", 1.25, 0.75},
		{"3.0.0", "<string name='wrap_mode' value='mirror'/>", -0.75, 0.75},
		{"0.6.0", "", 1.01, 0},
		{"0.6.0", "", 0.5, 0.5},
	};
	const struct wavelengths wl = wavelengths_sample(0.3);
	vol_make(&grid, (const uint32_t[3]){2, 2, 2}, 1, linear_field);
	for (size_t i = 0; i < 8; i++)
		grid.value[i] = i % 2 ? 0.75f : 0.25f;
	vol_write(&grid);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char inner[512];
		snprintf(inner, sizeof inner, GRID("albedo", "%s") "<float name='%s' value='3'/>", cases[i].params,
			 *cases[i].version == '0' ? "density" : "sigma_t");
		const char *type = *cases[i].version == '0' ? "heterogeneous" : "homogeneous";
		struct world *w = world_from_files(8, 8, make_scene_files(cases[i].version, type, inner));
		vec3 p = vec3_scale(w->scale, vec3_sub((vec3){cases[i].u, 0.5, 0.5}, w->center));
		double found = medium_scattering(&w->media[0], p, along_z, &wl).v[0] * w->scale / 3;
		if (fabs(found - cases[i].expected) > 1e-9)
			fail_msg("case %zu: %g, not %g", i, found, cases[i].expected);
		assert_true(fabs(medium_extinction(&w->media[0], p, along_z, &wl).v[0] * w->scale - 3) < 1e-9);
		world_free(w);
	}
}

/* ---- colours ---- */

/* Grey is constant over wavelengths; with colour=rgb the channels are R, G and B; otherwise a primary has most of its
 * own colour and little of the others. */
static void test_colour_channels_become_spectra(void **state)
{
	(void)state;
	enum { WAVELENGTHS = 4000 };
	vol_make(&grid, (const uint32_t[3]){1, 1, 1}, 3, linear_field);
	const struct wavelengths rgb = {.is_rgb = true};
	for (int k = 0; k < 4; k++) {
		for (int i = 0; i < 3; i++)
			grid.value[i] = k == 3 ? 0.7f : k == i;
		vol_write(&grid);
		struct world *w = world_with("3.0.0", GRID("albedo", ""));
		const struct volume *v = &w->media[0].second;
		spectrum here = volume_eval(v, (vec3){0, 0, 0}, false, &rgb);
		for (int i = 0; i < 3; i++)
			assert_true(here.v[i] == (double)grid.value[i]);
		double xyz[3] = {0}, red, green, blue;
		for (int n = 0; n < WAVELENGTHS; n++) {
			struct wavelengths wl = wavelengths_sample((n + 0.5) / WAVELENGTHS);
			spectrum l = volume_eval(v, (vec3){0, 0, 0}, false, &wl);
			double one[3];
			for (int i = 0; i < SPECTRUM_LANES; i++) {
				assert_true(l.v[i] >= 0 && l.v[i] <= 1);
				assert_true(k != 3 || fabs(l.v[i] - (double)0.7f) < 1e-15);
				l.v[i] *= color_d65(wl.nm[i]);
			}
			spectrum_to_xyz(l, &wl, one);
			for (int i = 0; i < 3; i++)
				xyz[i] += one[i] / WAVELENGTHS;
		}
		red = 3.2404542 * xyz[0] - 1.5371385 * xyz[1] - 0.4985314 * xyz[2];
		green = -0.9692660 * xyz[0] + 1.8760108 * xyz[1] + 0.0415560 * xyz[2];
		blue = 0.0556434 * xyz[0] - 0.2040259 * xyz[1] + 1.0572252 * xyz[2];
		const double found[3] = {red, green, blue};
		for (int i = 0; i < 3; i++)
			if (fabs(found[i] - (double)grid.value[i]) > 0.06)
				fail_msg("colour %d: %g %g %g", k, red, green, blue);
		world_free(w);
	}
}

/* ---- what is stated otherwise ---- */

/* A density without a grid is limited to a cube in 3.x. */
static void test_constant_density_is_limited_to_a_cube(void **state)
{
	(void)state;
	static const struct {
		const char *version, *inner;
		double low, size; /* of the cube; 0: not limited */
	} cases[] = {
		{"3.0.0", "", 0, 1},
		{"3.0.0", "<float name='sigma_t' value='1'/>", 0, 1},
		{"3.0.0",
		 "<volume type='constvolume' name='sigma_t'><transform name='to_world'><scale value='.5'/><translate x='.1' "
		 "y='.1' z='.1'/></transform></volume>",
		 0.1, 0.5},
		{"0.6.0",
		 "<volume type='constvolume' name='density'><float name='value' value='1'/></volume>"
		 "<volume type='constvolume' name='albedo'><spectrum name='value' value='1'/></volume>",
		 0, 0},
	};
	const struct wavelengths wl = wavelengths_sample(0.3);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct world *w = world_with(cases[i].version, cases[i].inner);
		const struct medium_lanes lanes = medium_lanes_along(&w->media[0], along_z, &wl);
		double middle = cases[i].low + cases[i].size / 2;
		for (double off = -0.85; off < 1; off += 0.2) {
			bool in = cases[i].size == 0 || fabs(off) * cases[i].size < cases[i].size / 2;
			vec3 p = vec3_scale(w->scale,
					    vec3_sub((vec3){middle + off * cases[i].size, middle, middle}, w->center));
			assert_true(fabs(medium_extinction(&w->media[0], p, along_z, &wl).v[2] * w->scale - in) <
				    1e-12);
			double depth =
				medium_optical_depth(&lanes, &(struct grid_ray){p, {0, 0, 1}, 0, 9 * w->scale}).v[1];
			assert_true(fabs(depth - (cases[i].size == 0 ? 9 : in ? cases[i].size / 2 : 0)) < 1e-12);
		}
		world_free(w);
	}
}

static void check_same(const char *version, const char *a, const char *b)
{
	struct world *w[2];
	const struct wavelengths rgb = {.is_rgb = true};
	for (int i = 0; i < 2; i++)
		w[i] = world_from_files(8, 8,
					make_scene_files(version, i ? "homogeneous" : "heterogeneous", i ? b : a));
	for (int i = 0; i < 3; i++) {
		const struct medium *m[2] = {&w[0]->media[0], &w[1]->media[0]};
		vec3 p = vec3_scale(w[0]->scale, vec3_sub((vec3){0.1, 0.2, 0.3}, w[0]->center));
		assert_true(medium_extinction(m[0], p, along_z, &rgb).v[i] ==
			    medium_extinction(m[1], p, along_z, &rgb).v[i]);
		assert_true(medium_scattering(m[0], p, along_z, &rgb).v[i] ==
			    medium_scattering(m[1], p, along_z, &rgb).v[i]);
	}
	world_free(w[0]);
	world_free(w[1]);
}

static void test_constant_grids_equal_constants(void **state)
{
	(void)state;
	check_same("3.0.0", "", "");
	check_same("3.0.0",
		   "<volume type='constvolume' name='sigma_t'><rgb name='value' value='1,2,3'/></volume>"
		   "<rgb name='albedo' value='.1,.2,.3'/>",
		   "<rgb name='sigma_t' value='1,2,3'/>"
		   "<volume type='constvolume' name='albedo'><rgb name='value' value='.1,.2,.3'/></volume>");
	check_same("0.6.0",
		   "<string name='method' value='woodcock'/><volume type='constvolume' name='density'>"
		   "<float name='value' value='2'/></volume><volume type='constvolume' name='albedo'>"
		   "<spectrum name='value' value='.25'/></volume>",
		   "<float name='sigmaT' value='2'/><float name='albedo' value='.25'/>");
}

/* Bytes stand for 0 to 1. */
static void test_bytes_stand_for_zero_to_one(void **state)
{
	(void)state;
	const struct wavelengths wl = wavelengths_sample(0.3);
	vol_make(&grid, (const uint32_t[3]){2, 1, 1}, 1, linear_field);
	vol_put32(&grid, 4, 3);
	grid.bytes[VOL_HEADER_BYTES] = 51;
	grid.bytes[VOL_HEADER_BYTES + 1] = 255;
	grid.size = VOL_HEADER_BYTES + 2;
	struct world *w = world_with("3.0.0", GRID("sigma_t", "<string name='filter_type' value='nearest'/>") EVEN);
	for (int i = 0; i < 2; i++) {
		vec3 p = vec3_scale(w->scale, vec3_sub((vec3){0.25 + 0.5 * i, 0.5, 0.5}, w->center));
		double wanted = i ? 1 : 0.2;
		assert_true(fabs(medium_extinction(&w->media[0], p, along_z, &wl).v[0] * w->scale - wanted) < 1e-7);
	}
	world_free(w);
}

/* Two volumes of one file at different positions share their values; those of another file do not. */
static void test_volumes_of_one_file_share_values(void **state)
{
	(void)state;
	static const char other[] =
		"<volume type='gridvolume' name='albedo'><string name='filename' value='h.vol'/></volume>";
	vol_make(&second_grid, (const uint32_t[3]){2, 2, 2}, 1, linear_field);
	vol_make(&grid, (const uint32_t[3]){4, 3, 5}, 1, linear_field);
	struct world *w = world_with("3.0.0", GRID("sigma_t", "") GRID("albedo", TWICE));
	assert_ptr_equal(w->media[0].first.grid->value, w->media[0].second.grid->value);
	assert_ptr_equal(w->media[0].first.grid->occupied_bricks, w->media[0].second.grid->occupied_bricks);
	assert_true(w->media[0].first.grid->to_cells.m[0][0] > 1.5 * w->media[0].second.grid->to_cells.m[0][0]);
	world_free(w);
	char inner[512];
	snprintf(inner, sizeof inner, GRID("sigma_t", "") "%s", other);
	w = world_with("3.0.0", inner);
	assert_int_equal(w->media[0].first.grid->size[0], 4);
	assert_int_equal(w->media[0].second.grid->size[0], 2);
	world_free(w);
}

/* ---- errors ---- */

static void expect_refused(const char *version, const char *inner, const char *sentence)
{
	world_check_files_refused(make_scene_files(version, "heterogeneous", inner), sentence);
}

static void test_invalid_volumes_are_refused(void **state)
{
	(void)state;
	vol_make(&grid, (const uint32_t[3]){4, 3, 5}, 1, linear_field);
	world_check_files_refused(make_scene_files("3.0.0", "homogeneous", GRID("sigma_t", "")),
				  "sigma_t must not vary in space in a homogeneous medium");
	/* A rotation by 90 degrees as exporters write it. */
	struct world *upright =
		world_with("3.0.0", GRID("sigma_t", "<string name='wrap_mode' value='mirror'/><transform "
						    "name='to_world'><matrix value='6e-17 0 1 0 0 1 0 0 "
						    "-1 0 6e-17 0 0 0 0 1'/></transform>"));
	assert_false(upright->media[0].first.grid->is_world_aligned);
	world_free(upright);
	expect_refused("3.0.0",
		       GRID("sigma_t",
			    "<string name='wrap_mode' value='mirror'/><transform name='to_world'><rotate x='1' "
			    "angle='10'/></transform>"),
		       "a rotated density cannot repeat itself (wrap_mode)");
	grid.value[7] = 1.5f;
	vol_write(&grid);
	expect_refused("3.0.0", GRID("albedo", ""), "g.vol: its values go from 0.3 to 1.5; [0, 1] is supported here");
	world_free(world_with("3.0.0", GRID("sigma_t", "")));
	grid.value[7] = -0.5f;
	vol_write(&grid);
	expect_refused("3.0.0", GRID("sigma_t", ""), "g.vol: its values go from -0.5 to ");
	expect_refused("3.0.0", "<volume type='gridvolume' name='sigma_t'/>", "needs a filename");
	expect_refused("0.6.0", "<volume type='constvolume' name='density'/>" EVEN, "needs a value");
	expect_refused("3.0.0", "<texture type='bitmap' name='sigma_t'/>",
		       "`sigma_t` may be a volume, but not a texture");
	expect_refused(
		"3.0.0", "<volume type='hgridvolume' name='sigma_t'/>",
		"this volume of Mitsuba's is not supported; --lenient leaves it out (supported: constvolume, gridvolume)");
	expect_refused("3.0.0", GRID("sigma_x", ""), "`sigma_x`");
	expect_refused("3.0.0", "<volume type='constvolume' name='albedo'><float name='value' value='1.5'/></volume>",
		       "1.5");
	vol_make(&grid, (const uint32_t[3]){4, 1, 5}, 1, linear_field);
	expect_refused("0.6.0", GRID("density", "") EVEN, "its box, or its grid, is flat along y");
	vol_set_box(&grid, (const float[3]){0, 0, 1}, (const float[3]){1, 1, 1});
	expect_refused("3.0.0", GRID("sigma_t", "<boolean name='use_grid_bbox' value='true'/>"), "is flat along z");
	feclearexcept(FE_INVALID);
	vol_set_box(&grid, (const float[3]){0, NAN, -INFINITY}, (const float[3]){1, NAN, -INFINITY});
	expect_refused("3.0.0", GRID("sigma_t", "<boolean name='use_grid_bbox' value='true'/>"), "is flat along y");
	assert_false(fetestexcept(FE_INVALID)); /* renderers trap it */
	expect_refused("3.0.0", GRID("sigma_t", "<transform name='to_world'><scale x='0'/></transform>"),
		       "to_world flattens the volume");
	expect_refused("0.6.0", "<volume type='constvolume' name='density'><float name='value' value='1'/></volume>",
		       "needs a density and an albedo");
	vol_put32(&grid, 20, 6);
	expect_refused("3.0.0", GRID("sigma_t", ""),
		       "6 channels; supported are version 3, types 1 (floats) and 3 (bytes), 1 channel or 3");
}

static bool is_noted(const struct scene *s, const char *text)
{
	for (uint32_t i = 0; i < s->note_count; i++)
		if (strstr(s->notes[i], text))
			return true;
	return false;
}

static void test_media_with_unsupported_volumes_are_left_out(void **state)
{
	(void)state;
	struct error e = {""};
	struct scene s;
	struct asset_source assets = memory_assets(
		make_scene_files("3.0.0", "heterogeneous", "<volume type='hgridvolume' name='sigma_t'/>" EVEN));
	assert_int_equal(scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_true(is_noted(&s, "the plug-in `hgridvolume` is not supported and left out (lenient)"));
	assert_true(
		is_noted(&s, "<medium type=\"heterogeneous\"> is left out, because a part of it is missing (lenient)"));
	assert_null(node_ref(s.objects[s.object_count - 1], "interior"));
	scene_fini(&s);
}

/* ---- effects ---- */

static void test_switched_off_effects_change_the_extinction(void **state)
{
	(void)state;
	const struct wavelengths wl = wavelengths_sample(0.3);
	vol_make(&grid, (const uint32_t[3]){1, 1, 1}, 1, linear_field); /* 0.3 */
	static const struct {
		const char *effects;
		double remaining_share; /* remaining share of sigma_t */
	} cases[] = {{NULL, 1}, {"-scattering", 0.8}, {"-absorption", 0.2}, {"-absorption,-scattering", 0}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		worlds_effects = cases[i].effects;
		struct world *w = world_with("3.0.0", GRID("sigma_t", "") "<float name='albedo' value='0.2'/>");
		vec3 p = vec3_scale(w->scale, vec3_sub((vec3){0.4, 0.4, 0.4}, w->center));
		const struct medium_lanes lanes = medium_lanes_along(&w->media[0], along_z, &wl);
		const struct grid_ray r = {p, {0, 0, 1}, 0, 0.1 * w->scale};
		double sigma = medium_extinction(&w->media[0], p, along_z, &wl).v[1];
		assert_true(fabs(sigma * w->scale - cases[i].remaining_share * 0.3) < 1e-7);
		assert_true(fabs(medium_optical_depth(&lanes, &r).v[1] - sigma * r.t1) < 1e-12);
		world_free(w);
	}
	for (int i = 1; i <= 2; i++) {
		worlds_effects = cases[i].effects;
		expect_refused(
			"3.0.0", GRID("albedo", ""),
			"absorption and scattering can only be switched off together in this scene: it has a medium "
			"whose albedo varies from place to place");
	}
	/* A white albedo, but as a grid: nothing is absorbed, and sigma_t is unchanged. */
	worlds_effects = NULL;
	grid.value[0] = 1;
	vol_write(&grid);
	struct world *white = world_from_files(8, 8, make_scene_files("3.0.0", "homogeneous", GRID("albedo", "")));
	assert_true(fabs(medium_extinction(&white->media[0], (vec3){0, 0, 0}, along_z, &wl).v[0] * white->scale - 1) <
		    1e-12);
	world_free(white);
	worlds_effects = cases[3].effects;
	struct world *w = world_with("3.0.0", GRID("albedo", ""));
	assert_false(w->media[0].is_absorbing || w->media[0].is_scattering);
	world_free(w);
	worlds_effects = NULL;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_rotated_grids_follow_the_dialect),
		cmocka_unit_test(test_grids_are_placed_by_dialect),
		cmocka_unit_test(test_values_outside_the_grid_follow_the_dialect),
		cmocka_unit_test(test_colour_channels_become_spectra),
		cmocka_unit_test(test_constant_density_is_limited_to_a_cube),
		cmocka_unit_test(test_constant_grids_equal_constants),
		cmocka_unit_test(test_bytes_stand_for_zero_to_one),
		cmocka_unit_test(test_volumes_of_one_file_share_values),
		cmocka_unit_test(test_invalid_volumes_are_refused),
		cmocka_unit_test(test_media_with_unsupported_volumes_are_left_out),
		cmocka_unit_test(test_switched_off_effects_change_the_extinction),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
