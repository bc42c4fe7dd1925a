/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Surfaces of grids: the field at vertices is 0, by another way of interpolating; the mesh is closed, faces the
 * direction in which the field grows, and has the volume and normals of the body that the field describes.
 */
#include "tests/support/built_shape.h"
#include "tests/support/dice.h"
#include "tests/support/scene_tables.h"
#include "tests/support/vol.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double pi = 3.14159265358979323846;

static void fill(struct vol *v, uint32_t nx, uint32_t ny, uint32_t nz, vol_field *f)
{
	vol_make(v, (const uint32_t[3]){nx, ny, nz}, 1, f);
}

static struct built_shape build_grid(const char *content, const struct vol *v)
{
	char xml[512];
	snprintf(xml, sizeof xml,
		 "<scene version='3.0.0'>\n<shape type='sdfgrid'><string name='filename' value='m'/>%s</shape></scene>",
		 content);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"m", v->bytes, v->size}, {0}};
	return built_shape_make(files, scene_tables());
}

static double interpolate(double t, double a, double b)
{
	return a + t * (b - a);
}

/* Returns the field at a point of the unit cube, by interpolating along one axis after the other. */
static double interpolated_value(const struct vol *v, const double p[3])
{
	uint32_t at[3];
	double t[3], along[2][2];
	for (int i = 0; i < 3; i++) {
		double x = p[i] * (v->side[i] - 1);
		at[i] = (uint32_t)fmin(floor(fmax(x, 0)), v->side[i] - 2);
		t[i] = x - at[i];
	}
	for (uint32_t y = 0; y < 2; y++)
		for (uint32_t z = 0; z < 2; z++) {
			const float *a = &v->value[((size_t)(at[2] + z) * v->side[1] + at[1] + y) * v->side[0] + at[0]];
			along[y][z] = interpolate(t[0], (double)a[0], (double)a[1]);
		}
	return interpolate(t[2], interpolate(t[1], along[0][0], along[1][0]),
			   interpolate(t[1], along[0][1], along[1][1]));
}

static int compare_edges(const void *a, const void *b)
{
	const uint64_t *x = a, *y = b;
	return *x < *y ? -1 : *x > *y;
}

/* Every edge occurs once in each direction; with holes, at most once. Since degenerate triangles have been dropped,
 * this holds only if no value is 0. */
static void check_edges(const struct mesh *m, bool closed)
{
	size_t count = 3 * (size_t)m->triangle_count;
	uint64_t *edges = calloc(count, sizeof *edges);
	assert_non_null(edges);
	for (size_t i = 0; i < count; i++) {
		const uint32_t *t = m->index[i / 3];
		edges[i] = (uint64_t)t[i % 3] << 32 | t[(i + 1) % 3];
	}
	qsort(edges, count, sizeof *edges, compare_edges);
	for (size_t i = 0; i < count; i++) {
		uint64_t back = edges[i] << 32 | edges[i] >> 32;
		assert_true(i == 0 || edges[i] != edges[i - 1]);
		if (closed && !bsearch(&back, edges, count, sizeof *edges, compare_edges))
			fail_msg("an edge from vertex %llu to %llu has one side", (unsigned long long)(edges[i] >> 32),
				 (unsigned long long)(edges[i] & UINT32_MAX));
	}
	free(edges);
}

static double ball_field(double x, double y, double z, uint32_t channel)
{
	(void)channel;
	x -= 0.51, y -= 0.48, z -= 0.5;
	return sqrt(x * x + y * y + z * z) - 0.37;
}

static double ring_field(double x, double y, double z, uint32_t channel)
{
	(void)channel;
	x -= 0.51, y -= 0.48, z -= 0.5;
	return hypot(hypot(x, y) - 0.29, z) - 0.131;
}

static vec3 field_gradient(vol_field *f, vec3 p)
{
	const double h = 1e-6;
	return vec3_unit_or_zero((vec3){f(p.x + h, p.y, p.z, 0) - f(p.x - h, p.y, p.z, 0),
					f(p.x, p.y + h, p.z, 0) - f(p.x, p.y - h, p.z, 0),
					f(p.x, p.y, p.z + h, 0) - f(p.x, p.y, p.z - h, 0)});
}

static void check_body(const struct vol *v, vol_field *f, double volume, double max_degrees)
{
	struct built_shape b = build_grid("", v), flat = build_grid("<string name='normals' value='analytic'/>", v);
	if (b.result || flat.result)
		fail_msg("%s%s", b.error.text, flat.error.text);
	const struct mesh *m = &b.geometry.mesh;
	check_edges(m, true);
	double sum = built_shape_volume(m);
	for (uint32_t t = 0; t < m->triangle_count; t++) {
		vec3 a = built_shape_corner(&flat.geometry.mesh, t, 0),
		     n = vec3_cross(vec3_sub(built_shape_corner(&flat.geometry.mesh, t, 1), a),
				    vec3_sub(built_shape_corner(&flat.geometry.mesh, t, 2), a));
		assert_true(vec3_dot(n, field_gradient(f, a)) > 0);
	}
	if (!(fabs(sum / volume - 1) < 0.03))
		fail_msg("a volume of %g instead of %g", sum, volume);
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		double value = interpolated_value(v, m->position[i]),
		       angle = vec3_angle(vec3_load(m->normal[i]), field_gradient(f, vec3_load(m->position[i])));
		if (!(fabs(value) < 1e-9))
			fail_msg("vertex %u: the field is %g", i, value);
		if (!(angle * 180 / pi < max_degrees))
			fail_msg("vertex %u: its normal is off by %g degrees", i, angle * 180 / pi);
	}
	assert_null(flat.geometry.mesh.normal);
	assert_null(m->uv);
	built_shape_fini(&b);
	built_shape_fini(&flat);
}

static void test_bodies_are_closed_and_on_the_surface(void **state)
{
	(void)state;
	static struct vol v;
	fill(&v, 24, 24, 24, ball_field);
	check_body(&v, ball_field, 4 * pi / 3 * 0.37 * 0.37 * 0.37, 1.5);
	fill(&v, 24, 17, 13, ball_field);
	check_body(&v, ball_field, 4 * pi / 3 * 0.37 * 0.37 * 0.37, 3);
	fill(&v, 23, 24, 24, ring_field);
	check_body(&v, ring_field, 2 * pi * pi * 0.29 * 0.131 * 0.131, 5);
}

static double slope_field(double x, double y, double z, uint32_t channel)
{
	(void)channel;
	return 2 * x + y - z - 0.613;
}

/* Interpolation is exact for a plane, which ends where it leaves the cube. */
static void test_plane_is_exact_and_ends_at_the_cube(void **state)
{
	(void)state;
	static struct vol v;
	fill(&v, 2, 5, 9, slope_field);
	struct built_shape b = build_grid("", &v);
	assert_int_equal(b.result, 0);
	const struct mesh *m = &b.geometry.mesh;
	const vec3 normal = vec3_normalize((vec3){2, 1, -1});
	check_edges(m, false);
	/* Its projection onto y, z is the part with 0 <= x = (0.613 - y + z) / 2 <= 1: all but the corner y > z +
	 * 0.613. */
	assert_true(fabs(built_shape_area(m) * normal.x - (1 - 0.5 * 0.387 * 0.387)) < 1e-6);
	for (uint32_t i = 0; i < m->vertex_count; i++)
		assert_true(vec3_length(vec3_sub(vec3_load(m->normal[i]), normal)) < 1e-6);
	built_shape_fini(&b);
}

/* Any field gives a closed mesh if it is positive at the faces of the cube, with vertices on the surface. Flat, because
 * normals, which are meaningless for noise, would reverse triangles. */
static void test_noise_gives_a_closed_mesh(void **state)
{
	(void)state;
	static struct vol v;
	struct dice d = dice_for_test("noise in grids");
	for (int round = 0; round < 40; round++) {
		fill(&v, 3 + (uint32_t)dice_below(&d, 6), 3 + (uint32_t)dice_below(&d, 6),
		     3 + (uint32_t)dice_below(&d, 6), ball_field);
		size_t at = 0;
		for (uint32_t k = 0; k < v.side[2]; k++)
			for (uint32_t j = 0; j < v.side[1]; j++)
				for (uint32_t i = 0; i < v.side[0]; i++, at++) {
					bool face = i == 0 || j == 0 || k == 0 || i == v.side[0] - 1 ||
						    j == v.side[1] - 1 || k == v.side[2] - 1;
					double value = 0.01 + dice_uniform(&d);
					v.value[at] = (float)(face || dice_below(&d, 2) ? value : -value);
				}
		vol_write(&v);
		struct built_shape b = build_grid("<string name='normals' value='analytic'/>", &v);
		if (b.result) {
			assert_non_null(strstr(b.error.text, "there is no surface"));
		} else {
			check_edges(&b.geometry.mesh, true);
			for (uint32_t i = 0; i < b.geometry.mesh.vertex_count; i++)
				assert_true(fabs(interpolated_value(&v, b.geometry.mesh.position[i])) < 1e-6);
		}
		built_shape_fini(&b);
	}
}

static void expect_refused(const struct vol *v, const char *text)
{
	struct built_shape b = build_grid("", v);
	if (b.result >= 0 || !strstr(b.error.text, text))
		fail_msg("%d: %s\n not: %s", b.result, b.error.text, text);
	built_shape_fini(&b);
}

static void test_invalid_grids_are_refused(void **state)
{
	(void)state;
	static struct vol good, v;
	static const struct {
		size_t at;
		uint32_t value;
		const char *text;
	} bad[] = {
		{0, 0, "m: this is not a grid of numbers (.vol)"},
		{4, 2,
		 "m: version 3, type 2, 1 channels; supported are version 3, types 1 (floats) and 3 (bytes), 1 channel"},
		{20, 3, "type 1, 3 channels"},
		{8, 1, "m: 1 values along x; 2 to 1024 are supported"},
		{12, 1025, "m: 1025 values along y"},
		{16, 0xffffffff, "m: 4294967295 values along z"},
		{16, 1000, "m: too short for 16000 values"},
		{VOL_HEADER_BYTES, 0x7fc00000, "m: value 0 is not finite"},
		{VOL_HEADER_BYTES + 4, 0x7f800000, "m: value 1 is not finite"},
	};
	fill(&good, 4, 4, 4, ball_field);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		v = good;
		vol_put32(&v, bad[i].at, bad[i].value);
		expect_refused(&v, bad[i].text);
	}
	for (size_t size = 0; size < good.size; size++) {
		v = good;
		v.size = size;
		expect_refused(&v, size < VOL_HEADER_BYTES ? "this is not a grid" : "too short for 64 values");
	}
	v = good;
	for (size_t i = 0; i < 64; i++)
		v.value[i] = 1;
	vol_write(&v);
	expect_refused(&v, "m: its values do not change their sign: there is no surface");
	/* Zeros and numbers of any size give a mesh, or an error. */
	static const float numbers[] = {0, -0.0f, 1, -1, 3e38f, -3e38f, 1e-45f, -1e-45f, 1e-20f, -1e-20f};
	struct dice d = dice_for_test("extreme grids");
	for (int round = 0; round < 500; round++) {
		for (size_t i = 0; i < 64; i++)
			v.value[i] = numbers[dice_below(&d, sizeof numbers / sizeof *numbers)];
		vol_write(&v);
		struct built_shape b = build_grid("", &v);
		assert_true(b.result <= 0);
		for (uint32_t i = 0; b.result == 0 && i < b.geometry.mesh.vertex_count; i++)
			for (int k = 0; k < 3; k++)
				assert_true(b.geometry.mesh.position[i][k] >= 0 && b.geometry.mesh.position[i][k] <= 1);
		built_shape_fini(&b);
	}
}

static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	static struct vol v;
	fill(&v, 6, 6, 6, ball_field);
	struct built_shape b = build_grid("", &v);
	const struct memory_file files[] = {{"m", v.bytes, v.size}, {0}};
	built_shape_check_out_of_memory(&b.scene, files, 6);
	built_shape_fini(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_bodies_are_closed_and_on_the_surface),
		cmocka_unit_test(test_plane_is_exact_and_ends_at_the_cube),
		cmocka_unit_test(test_noise_gives_a_closed_mesh),
		cmocka_unit_test(test_invalid_grids_are_refused),
		cmocka_unit_test(test_failed_allocations_are_reported),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
