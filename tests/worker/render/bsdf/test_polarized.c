/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Materials with Mueller matrices: a constant table is a Lambertian reflectance; tables of angles are compared with
 * Rusinkiewicz's angles, computed here by rotations; wavelengths, colours, values that were not measured, and damaged
 * files.
 */
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/nodes.h"
#include "tests/support/polarized_file.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/tensor.h"
#include "worker/render/math/mat4.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const struct wavelengths spectral_wavelengths = {.nm = {440, 510, 575, 700}};
static const struct wavelengths rgb_wavelengths = {.is_rgb = true};

struct made_bsdf {
	struct memory_file files[2];
	struct asset_source assets;
	struct arena arena;
	struct bsdf b;
	struct error e;
};

static int try_bytes(struct made_bsdf *m, const void *bytes, size_t size, const char *more)
{
	char text[100];
	*m = (struct made_bsdf){.files = {{"m.pbsdf", bytes, size}, {0}}};
	m->assets = memory_assets(m->files);
	const struct bsdf_build build = {.arena = &m->arena, .is_dialect_3 = true, .assets = &m->assets};
	snprintf(text, sizeof text, "measured_polarized filename=m.pbsdf%s", more);
	return bsdf_create(&m->b, node_make_bsdf(&m->arena, text), &build, &m->e);
}

static void make_or_fail(struct made_bsdf *m, polarized_function *f, int phis, int thetas, const char *more)
{
	size_t size;
	unsigned char *bytes = polarized_file_make(f, phis, thetas, &size);
	if (try_bytes(m, bytes, size, more))
		fail_msg("%s", m->e.text);
	free(bytes);
}

static spectrum value_of(const struct made_bsdf *m, vec3 camera, vec3 light, const struct wavelengths *w)
{
	const struct bsdf_point p = {.wavelengths = w, .transport = TRANSPORT_RADIANCE};
	return m->b.ops->eval(&m->b, &p, camera, light);
}

static vec3 direction_above(struct dice *d)
{
	vec3 w = dice_direction(d);
	w.z = fabs(w.z);
	return w;
}

/* ---- values ---- */

static double lambertian_value(double phi_d, double theta_d, double theta_h, double at)
{
	(void)phi_d, (void)theta_d, (void)theta_h, (void)at;
	return 0.5 / M_PI;
}

static void constant_table_is_lambertian(void **state)
{
	(void)state;
	struct made_bsdf m;
	struct dice d = dice_for_test("a constant table");
	const struct bsdf_point p = {.wavelengths = &spectral_wavelengths, .transport = TRANSPORT_RADIANCE};
	size_t samples = dice_scaled_count(40000);
	double sum = 0, square = 0;
	make_or_fail(&m, lambertian_value, 3, 3, " alpha_sample=0.3");
	for (int i = 0; i < 1000; i++) {
		vec3 a = direction_above(&d), b = direction_above(&d);
		spectrum f = value_of(&m, a, b, &spectral_wavelengths), g = value_of(&m, a, b, &rgb_wavelengths);
		for (int l = 0; l < SPECTRUM_LANES; l++)
			assert_true(fabs(f.v[l] / (0.5 / M_PI) - 1) < 1e-6 && fabs(g.v[l] / (0.5 / M_PI) - 1) < 1e-6);
		b.z = -b.z;
		assert_true(spectrum_is_zero(value_of(&m, a, b, &spectral_wavelengths)));
	}
	/* The reflected share of all light. */
	for (size_t i = 0; i < samples; i++) {
		const double u[] = {dice_uniform(&d), dice_uniform(&d), dice_uniform(&d)};
		struct bsdf_sample s;
		double weight = m.b.ops->sample(&m.b, &p, (vec3){0.6, 0, 0.8}, u, &s) ? s.f.v[0] * s.wi.z / s.pdf : 0;
		sum += weight;
		square += weight * weight;
	}
	double mean = sum / (double)samples, error = sqrt((square / (double)samples - mean * mean) / (double)samples);
	print_message("reflects %.4f +- %.4f\n", mean, error);
	assert_true(fabs(mean - 0.5) < 4.5 * error);
	arena_fini(&m.arena);
}

/* The values are linear along each axis, so the table is exact. */
static double linear_in_theta_h(double phi_d, double theta_d, double theta_h, double at)
{
	(void)phi_d, (void)theta_d, (void)at;
	return theta_h;
}

static double linear_in_theta_d(double phi_d, double theta_d, double theta_h, double at)
{
	(void)phi_d, (void)theta_h, (void)at;
	return theta_d;
}

static double linear_in_phi_d(double phi_d, double theta_d, double theta_h, double at)
{
	(void)theta_d, (void)theta_h, (void)at;
	return phi_d + 4;
}

static double linear_in_wavelength(double phi_d, double theta_d, double theta_h, double at)
{
	(void)phi_d, (void)theta_d, (void)theta_h;
	return at;
}

/* Rusinkiewicz 1998: h is turned about z to azimuth 0, then about y to the pole; the direction to the light with it.
 * There, +x is the tangent that points down along the meridian. */
static void rusinkiewicz(vec3 light, vec3 camera, double angle[3])
{
	vec3 h = vec3_normalize(vec3_add(light, camera));
	double theta = acos(h.z), phi = atan2(h.y, h.x), degrees = 180 / M_PI;
	mat4 turn =
		mat4_mul(mat4_rotate((vec3){0, 1, 0}, -theta * degrees), mat4_rotate((vec3){0, 0, 1}, -phi * degrees));
	vec3 d = mat4_vector(&turn, light);
	angle[0] = atan2(d.y, d.x);
	angle[1] = acos(d.z);
	angle[2] = theta;
}

static void tables_are_read_at_rusinkiewicz_angles(void **state)
{
	(void)state;
	static polarized_function *const tables[] = {linear_in_phi_d, linear_in_theta_d, linear_in_theta_h};
	for (int k = 0; k < 3; k++) {
		struct made_bsdf m;
		struct dice d = dice_for_test("angles of a table");
		make_or_fail(&m, tables[k], 13, 7, "");
		for (int i = 0; i < 1000; i++) {
			vec3 light = direction_above(&d), camera = direction_above(&d);
			double angle[3];
			rusinkiewicz(light, camera, angle);
			double wanted = tables[k](angle[0], angle[1], angle[2], 0);
			spectrum f = value_of(&m, camera, light, &spectral_wavelengths);
			assert_true(fabs(f.v[0] - wanted) < 1e-5);
			/* From a light, with the directions exchanged. */
			const struct bsdf_point p = {.wavelengths = &spectral_wavelengths,
						     .transport = TRANSPORT_IMPORTANCE};
			assert_true(m.b.ops->eval(&m.b, &p, light, camera).v[0] == f.v[0]);
		}
		/* Directions for which angles are undefined: h along the normal, and the light at the camera. */
		vec3 up = {0, 0, 1}, aside = {0.6, 0, 0.8};
		assert_true(isfinite(value_of(&m, up, up, &spectral_wavelengths).v[0]));
		assert_true(isfinite(value_of(&m, aside, aside, &spectral_wavelengths).v[0]));
		assert_true(isfinite(value_of(&m, aside, (vec3){-0.6, 0, 0.8}, &spectral_wavelengths).v[0]));
		arena_fini(&m.arena);
	}
}

static void values_are_linear_in_wavelength(void **state)
{
	(void)state;
	struct made_bsdf m;
	vec3 a = {0.6, 0, 0.8}, b = {0, 0.28, 0.96};
	const double wanted[SPECTRUM_LANES] = {450, 510, 575, 650};
	make_or_fail(&m, linear_in_wavelength, 3, 3, "");
	spectrum f = value_of(&m, a, b, &spectral_wavelengths), colour = value_of(&m, a, b, &rgb_wavelengths);
	for (int l = 0; l < SPECTRUM_LANES; l++)
		assert_true(fabs(f.v[l] / wanted[l] - 1) < 1e-6);
	assert_true(colour.v[0] > colour.v[1] && colour.v[1] > colour.v[2]);
	assert_true(m.b.color_kind == COLOR_KIND_OTHER);
	arena_fini(&m.arena);
	static const struct {
		const char *more;
		double value;
	} single[] = {{" wavelength=520", 520}, {" wavelength=100", 450}, {" wavelength=5000", 650}};
	for (size_t i = 0; i < sizeof single / sizeof *single; i++) {
		make_or_fail(&m, linear_in_wavelength, 3, 3, single[i].more);
		f = value_of(&m, a, b, &spectral_wavelengths);
		colour = value_of(&m, a, b, &rgb_wavelengths);
		for (int l = 0; l < SPECTRUM_LANES; l++)
			assert_true(fabs(f.v[l] / single[i].value - 1) < 1e-6 && colour.v[l] == f.v[l]);
		assert_true(m.b.color_kind == COLOR_KIND_CONSTANT);
		arena_fini(&m.arena);
	}
}

/* Negative values among others, and values that were not measured. */
static double value_with_holes(double phi_d, double theta_d, double theta_h, double at)
{
	(void)phi_d, (void)theta_d;
	return theta_h > 1 ? NAN : at > 600 ? -1 : at > 550 ? 1 : 2;
}

static double green_value(double phi_d, double theta_d, double theta_h, double at)
{
	(void)phi_d, (void)theta_d, (void)theta_h;
	return at < 480 || at > 620 ? NAN : 1;
}

static void negative_and_missing_values_are_black(void **state)
{
	(void)state;
	struct made_bsdf m;
	const struct wavelengths w = {.nm = {500, 600, 620, 640}};
	vec3 up = {0, 0, 1}, low = {1, 0, 1e-3};
	make_or_fail(&m, value_with_holes, 3, 9, "");
	spectrum f = value_of(&m, up, up, &w);
	assert_true(fabs(f.v[0] - 2) < 1e-6 && fabs(f.v[1] - 1) < 1e-6 && fabs(f.v[2] - 0.2) < 1e-6 && f.v[3] == 0);
	low = vec3_normalize(low);
	assert_true(spectrum_is_zero(value_of(&m, low, low, &w)));
	/* Between a measured value and one that is not. */
	assert_true(spectrum_is_zero(value_of(&m, (vec3){sin(1), 0, cos(1)}, (vec3){sin(1), 0, cos(1)}, &w)));
	arena_fini(&m.arena);
	make_or_fail(&m, green_value, 3, 3, "");
	f = value_of(&m, up, up, &(struct wavelengths){.nm = {480, 510, 590, 610}});
	assert_true(f.v[0] == 0 && f.v[1] == 1 && f.v[2] == 1 && f.v[3] == 0);
	arena_fini(&m.arena);
}

/* ---- broken files ---- */

static void truncated_or_damaged_files_are_refused(void **state)
{
	(void)state;
	size_t size;
	unsigned char *bytes = polarized_file_make(lambertian_value, 3, 2, &size), *copy = malloc(size);
	for (size_t end = 0; end < size; end += end < 400 ? 1 : 37) {
		struct made_bsdf m;
		unsigned char *part = malloc(end ? end : 1); /* so that a sanitizer detects reads beyond its end */
		memcpy(part, bytes, end);
		assert_int_equal(try_bytes(&m, part, end, ""), -EINVAL);
		arena_fini(&m.arena);
		free(part);
	}
	int refused = 0;
	for (size_t i = 0; i < 300; i++)
		for (unsigned bit = 0; bit < 8; bit++) {
			struct made_bsdf m;
			memcpy(copy, bytes, size);
			copy[i] ^= (unsigned char)(1U << bit);
			int code = try_bytes(&m, copy, size, "");
			assert_true(code == 0 || code == -EINVAL || code == -ENOTSUP);
			refused += code != 0;
			arena_fini(&m.arena);
		}
	assert_true(refused > 1000);
	free(copy);
	free(bytes);
}

/* A byte of the description of an array, after its name, is changed. */
static void changed_array_descriptions_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *array;
		size_t at;
		unsigned char byte;
		const char *what;
	} cases[] = {
		{"phi_d", 11 + 8, 2, "M has other sizes than phi_d, theta_d, theta_h and wvls"},
		{"theta_h", 11 + 8, 1, "M has other sizes"},
		{"wvls", 11, 4, "M has other sizes"},
		{"wvls", 2, 10, "wvls has the wrong type"},
		{"theta_d", 0, 1, "theta_d has the wrong type or number of dimensions"},
		{"theta_d", 11, 2, "theta_d has more than one row"},
		{"theta_d", 11, 0, "theta_d has a side of 0"},
	};
	size_t size;
	unsigned char *bytes = polarized_file_make(lambertian_value, 3, 2, &size), *copy = malloc(size);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct made_bsdf m;
		memcpy(copy, bytes, size);
		size_t at = 18, length = strlen(cases[i].array);
		while (memcmp(copy + at, cases[i].array, length) != 0)
			at++;
		copy[at + length + cases[i].at] = cases[i].byte;
		assert_int_equal(try_bytes(&m, copy, size, ""), -EINVAL);
		if (!strstr(m.e.text, cases[i].what))
			fail_msg("%s: %s, not %s", cases[i].array, m.e.text, cases[i].what);
		arena_fini(&m.arena);
	}
	/* Three by four numbers instead of matrices. */
	struct tensor t;
	struct made_bsdf m;
	memcpy(copy, bytes, size);
	assert_int_equal(tensor_find(copy, size, "M", &t), 0);
	size_t at = 18;
	while (!(copy[at] == 1 && copy[at + 1] == 0 && copy[at + 2] == 'M'))
		at++;
	copy[at + 3 + 11 + 8 * 4] = 3;
	assert_int_equal(try_bytes(&m, copy, size, ""), -EINVAL);
	assert_non_null(strstr(m.e.text, "M needs matrices of 4 x 4"));
	arena_fini(&m.arena);
	/* Axes that are not ascending, or not finite. */
	static const unsigned char large[4] = {0, 0, 0x80, 0x40}, signals[4] = {1, 0, 0x80, 0x7f};
	for (int k = 0; k < 2; k++) {
		memcpy(copy, bytes, size);
		assert_int_equal(tensor_find(copy, size, "phi_d", &t), 0);
		memcpy(copy + (t.bytes - copy), k ? signals : large, 4);
		assert_int_equal(try_bytes(&m, copy, size, ""), -EINVAL);
		assert_non_null(strstr(m.e.text, k ? "phi_d has a number beyond 1e30" : "phi_d must ascend"));
		arena_fini(&m.arena);
	}
	free(copy);
	free(bytes);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(constant_table_is_lambertian),
		cmocka_unit_test(tables_are_read_at_rusinkiewicz_angles),
		cmocka_unit_test(values_are_linear_in_wavelength),
		cmocka_unit_test(negative_and_missing_values_are_black),
		cmocka_unit_test(truncated_or_damaged_files_are_refused),
		cmocka_unit_test(changed_array_descriptions_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
