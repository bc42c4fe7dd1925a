/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Measured materials (measured, after Dupuy and Jakob 2018). Files made from a known microfacet formula must reproduce
 * its values, symmetries, sampling and roughness, spectrally and in RGB. Truncated and damaged files, impossible sizes
 * and numbers, and other files are refused with a sentence.
 */
#include "tests/support/measured_file.h"
#include "tests/support/nodes.h"
#include "tests/support/stats.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/measured_read.h"
#include "worker/render/bsdf/tensor.h"
#include "worker/render/math/rng.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

static const struct measured_file_material fine_material = {.name = "fine.bsdf",
							    .alpha_u = 0.3,
							    .alpha_v = 0.3,
							    .azimuths = 1,
							    .symmetry = 1,
							    .elevations = 5,
							    .normal_nodes = 96,
							    .color_nodes = 24};

static const struct wavelengths spectral_wavelengths = {.nm = {380, 550, 600, 790}};
static const struct wavelengths rgb_wavelengths = {.is_rgb = true};

struct made_bsdf {
	struct memory_file files[2];
	struct asset_source assets;
	struct arena arena;
	struct bsdf b;
	struct error e;
};

/* The caller keeps the bytes. */
static int try_bytes(struct made_bsdf *m, const void *bytes, size_t size)
{
	*m = (struct made_bsdf){.files = {{"m.bsdf", bytes, size}, {0}}};
	m->assets = memory_assets(m->files);
	const struct bsdf_build build = {.arena = &m->arena, .is_dialect_3 = true, .assets = &m->assets};
	return bsdf_create(&m->b, node_make_bsdf(&m->arena, "measured filename=m.bsdf"), &build, &m->e);
}

static void make_or_fail(struct made_bsdf *m, const struct measured_file_material *k)
{
	size_t size;
	unsigned char *bytes = measured_file_make(k, &size);
	if (try_bytes(m, bytes, size))
		fail_msg("%s", m->e.text);
	free(bytes);
}

static vec3 spherical(double theta, double phi)
{
	return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

/* Pairs with wo at elevations and azimuths of the file, and half vectors as samples find them. */
static double root_mean_square(const struct made_bsdf *m, const struct measured_file_material *k, double phi,
			       double least, const struct wavelengths *w, const double tint[SPECTRUM_LANES])
{
	const struct bsdf_point p = {.wavelengths = w, .transport = TRANSPORT_RADIANCE};
	double sum = 0;
	int count = 0;
	for (int i = 0; i < k->elevations - 1; i++)
		for (uint64_t j = 0; j < 400; j++) {
			double u[4];
			struct bsdf_sample s;
			vec3 wo = spherical(measured_file_theta(k, i), phi);
			rng_uniform4(stats_seed(__func__), RNG_TEST, j, (uint64_t)i, 0, u);
			if (!m->b.ops->sample(&m->b, &p, wo, u, &s) || !(s.wi.z > least))
				continue;
			spectrum f = m->b.ops->eval(&m->b, &p, wo, s.wi);
			for (int l = 0; l < SPECTRUM_LANES; l++) {
				double wanted = measured_file_reflected(k, tint[l], wo, s.wi);
				double off = f.v[l] * s.wi.z / wanted - 1;
				sum += off * off;
				count++;
			}
		}
	assert_true(count > 1000);
	return sqrt(sum / count);
}

static void tints_of(const struct wavelengths *w, double tint[SPECTRUM_LANES])
{
	for (int l = 0; l < SPECTRUM_LANES; l++)
		tint[l] = measured_file_tint(w->nm[l]);
}

/* Tables of normals are bilinear, and so are colours as functions of the warped numbers: a fine file has small
 * errors. */
static void test_agrees_with_its_formula(void **state)
{
	(void)state;
	struct made_bsdf m;
	double tint[SPECTRUM_LANES];
	tints_of(&spectral_wavelengths, tint);
	make_or_fail(&m, &fine_material);
	double off = root_mean_square(&m, &fine_material, 0.7, 0.2, &spectral_wavelengths, tint);
	print_message("isotropic: off by %.4f\n", off);
	assert_true(off < 0.02);
	arena_fini(&m.arena);
}

/* The values of a quarter or a half of the azimuths are repeated for the others. */
static void test_anisotropic_symmetries(void **state)
{
	(void)state;
	static const struct {
		int symmetry, azimuths;
	} ways[] = {{1, 9}, {2, 5}, {4, 3}};
	double tint[SPECTRUM_LANES];
	tints_of(&spectral_wavelengths, tint);
	for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
		struct measured_file_material k = fine_material;
		struct made_bsdf m;
		k.alpha_v = 0.5;
		k.azimuths = ways[i].azimuths;
		k.symmetry = ways[i].symmetry;
		k.rotation = k.symmetry == 4 ? 0 : 0.4; /* so that one half is not the mirror image of the other */
		k.elevations = 4;
		k.normal_nodes = 64;
		k.color_nodes = 16;
		make_or_fail(&m, &k);
		assert_true(m.b.uses_tangents);
		for (int q = -3; q <= 4; q++) {
			double off = root_mean_square(&m, &k, q * PI / 4 + 1e-9, 0.3, &spectral_wavelengths, tint);
			if (!(off < 0.03))
				fail_msg("symmetry %d, azimuth %d pi/4: off by %g", k.symmetry, q, off);
		}
		arena_fini(&m.arena);
	}
}

/* An isotropic material looks the same from all azimuths, and if rotated by any angle. */
static void isotropic_material_is_the_same_when_rotated(void **state)
{
	(void)state;
	struct made_bsdf m;
	make_or_fail(&m, &fine_material);
	const struct bsdf_point p = {.wavelengths = &spectral_wavelengths, .transport = TRANSPORT_RADIANCE};
	spectrum a = m.b.ops->eval(&m.b, &p, spherical(0.8, 0.3), spherical(0.6, 3));
	for (int i = 1; i < 12; i++) {
		spectrum b = m.b.ops->eval(&m.b, &p, spherical(0.8, 0.3 + i), spherical(0.6, 3 + i));
		assert_true(fabs(b.v[0] / a.v[0] - 1) < 1e-9);
	}
	assert_false(m.b.uses_tangents);
	arena_fini(&m.arena);
}

/* If all light is reflected, the weight of a sample is the colour over the luminance with which it was chosen, whatever
 * the distribution of facets: this is the purpose of the warps. */
static void test_samples_follow_the_facets(void **state)
{
	(void)state;
	struct measured_file_material k = fine_material;
	struct made_bsdf m;
	k.is_white = true;
	k.alpha_u = k.alpha_v = 0.1;
	make_or_fail(&m, &k);
	const struct bsdf_point p = {.wavelengths = &spectral_wavelengths, .transport = TRANSPORT_RADIANCE};
	double mean = 0, square = 0;
	int count = 0;
	for (uint64_t j = 0; j < 4000; j++) {
		double u[4];
		struct bsdf_sample s;
		rng_uniform4(stats_seed(__func__), RNG_TEST, j, 0, 0, u);
		if (!m.b.ops->sample(&m.b, &p, spherical(0.5, 1), u, &s))
			continue;
		double weight = s.f.v[0] * s.wi.z / s.pdf;
		mean += weight;
		square += weight * weight;
		count++;
	}
	mean /= count;
	square /= count;
	print_message("weights: mean %.4f, relative variance %.4f\n", mean, square / (mean * mean) - 1);
	assert_true(count > 3900);
	/* White facets of this roughness keep nearly all light. The variance is that of l = 0.2 + x y, which the file
	 * says luminances are: samples have the density l / 0.45, so it is 0.45 (the integral of 1 / l) - 1 = 0.24.
	 * 4,000 samples state the mean within 0.008 and the variance within 0.01. */
	assert_true(fabs(mean - 0.995) < 0.03 && square / (mean * mean) - 1 < 0.35);
	arena_fini(&m.arena);
}

/* Files with three channels, and paths that carry RGB. */
static void test_rgb(void **state)
{
	(void)state;
	enum { SAMPLES = 101 };
	struct measured_file_material k = fine_material;
	struct made_bsdf spectral, three;
	k.elevations = 3;
	make_or_fail(&spectral, &k);
	k.is_rgb = true;
	make_or_fail(&three, &k);
	const double tint[SPECTRUM_LANES] = {measured_file_tint(600), measured_file_tint(550), measured_file_tint(450),
					     measured_file_tint(550)};
	assert_true(root_mean_square(&three, &k, 0, 0.2, &rgb_wavelengths, tint) < 0.03);
	/* Spectra as RGB: as color_from_samples() converts the formula's values. */
	const struct bsdf_point p = {.wavelengths = &rgb_wavelengths}, q = {.wavelengths = &spectral_wavelengths};
	vec3 wo = spherical(measured_file_theta(&k, 1), 0), wi = spherical(0.5, 3);
	double at[SAMPLES], value[SAMPLES];
	for (int i = 0; i < SAMPLES; i++) {
		at[i] = 340 + 5 * i;
		value[i] = measured_file_reflected(&k, measured_file_tint(at[i]), wo, wi) / wi.z;
	}
	struct color wanted = color_from_samples(SAMPLES, at, value, false, true);
	spectrum a = spectral.b.ops->eval(&spectral.b, &p, wo, wi), b = three.b.ops->eval(&three.b, &p, wo, wi),
		 c = three.b.ops->eval(&three.b, &q, wo, wi), d = color_eval(&wanted, &rgb_wavelengths);
	for (int l = 0; l < SPECTRUM_LANES; l++)
		if (!(fabs(a.v[l] / d.v[l] - 1) < 0.02))
			fail_msg("lane %d: %g, wanted %g", l, a.v[l], d.v[l]);
	/* RGB as spectra: upsampled like images. */
	double largest = fmax(1, fmax(b.v[0], fmax(b.v[1], b.v[2])));
	const double unit[3] = {b.v[0] / largest, b.v[1] / largest, b.v[2] / largest};
	d = color_eval_rgb_reflectance(unit, &spectral_wavelengths);
	for (int l = 0; l < SPECTRUM_LANES; l++)
		if (!(fabs(c.v[l] / (d.v[l] * largest) - 1) < 0.1))
			fail_msg("lane %d: %g, wanted %g", l, c.v[l], d.v[l] * largest);
	arena_fini(&spectral.arena);
	arena_fini(&three.arena);
}

/* A constant spectrum is white, whatever its wavelengths are. */
static void test_white_is_white(void **state)
{
	(void)state;
	struct measured_file_material k = fine_material;
	struct made_bsdf m;
	k.elevations = 3;
	k.is_white = k.is_absolute = true;
	make_or_fail(&m, &k);
	const struct bsdf_point p = {.wavelengths = &rgb_wavelengths};
	vec3 wo = spherical(measured_file_theta(&k, 1), 0), wi = spherical(0.5, 3);
	spectrum f = m.b.ops->eval(&m.b, &p, wo, wi);
	double wanted = measured_file_reflected(&k, 1, wo, wi) / wi.z;
	for (int l = 0; l < 3; l++)
		if (!(fabs(f.v[l] / f.v[0] - 1) < 1e-5 && fabs(f.v[l] / wanted - 1) < 0.03))
			fail_msg("%.9g %.9g %.9g, wanted %g", f.v[0], f.v[1], f.v[2], wanted);
	arena_fini(&m.arena);
}

/* The roughness that determines the step sizes of chains is that of GGX, up to the resolution of the grid. */
static void test_roughness(void **state)
{
	(void)state;
	struct made_bsdf m;
	make_or_fail(&m, &fine_material);
	assert_true(fabs(m.b.min_alpha / 0.3 - 1) < 0.02 && m.b.mean_alpha == m.b.min_alpha);
	arena_fini(&m.arena);
}

/* ---- broken files ---- */

/* Every truncated file is refused, unless nothing that is used is missing. */
static void truncated_files_are_refused(void **state)
{
	(void)state;
	const struct memory_file *f = measured_file_all();
	size_t step = 1;
	for (size_t size = 0; size < f->size; size += step) {
		struct made_bsdf m;
		unsigned char *copy = malloc(size ? size : 1); /* so that a sanitizer detects reads beyond its end */
		memcpy(copy, f->bytes, size);
		struct tensor t; /* the last array */
		assert_int_equal(tensor_find(copy, size, "spectra", &t), -EINVAL);
		assert_int_equal(try_bytes(&m, copy, size), -EINVAL);
		arena_fini(&m.arena);
		free(copy);
		step = size < 600 ? 1 : 997;
	}
}

/* Flips each bit of the header: the file is refused with a reason, or read. */
static void damaged_headers_are_refused_or_read(void **state)
{
	(void)state;
	const struct memory_file *f = measured_file_all();
	unsigned char *copy = malloc(f->size);
	int refused = 0;
	for (size_t i = 0; i < 500; i++)
		for (unsigned bit = 0; bit < 8; bit++) {
			struct made_bsdf m;
			memcpy(copy, f->bytes, f->size);
			copy[i] ^= (unsigned char)(1U << bit);
			int code = try_bytes(&m, copy, f->size);
			assert_true(code == 0 || code == -EINVAL || code == -ENOTSUP);
			refused += code != 0;
			arena_fini(&m.arena);
		}
	assert_true(refused > 2000);
	free(copy);
}

static void check_replaced_number(const char *array, size_t i, const unsigned char number[4], const char *what)
{
	const struct memory_file *f = measured_file_all();
	unsigned char *copy = malloc(f->size);
	struct tensor t;
	struct made_bsdf m;
	memcpy(copy, f->bytes, f->size);
	assert_int_equal(tensor_find(copy, f->size, array, &t), 0);
	memcpy(copy + (t.bytes - copy) + 4 * i, number, 4);
	assert_int_equal(try_bytes(&m, copy, f->size), -EINVAL);
	if (!strstr(m.e.text, array) || !strstr(m.e.text, what))
		fail_msg("%s: %s", array, m.e.text);
	arena_fini(&m.arena);
	free(copy);
}

static void invalid_numbers_are_refused(void **state)
{
	(void)state;
	static const char *const arrays[] = {"phi_i", "theta_i",   "ndf",     "sigma",
					     "vndf",  "luminance", "spectra", "wavelengths"};
	static const unsigned char bad[][4] = {
		{0, 0, 0x80, 0x7f}, {1, 0, 0x80, 0x7f}, {0, 0, 0xc0, 0xff}, {0, 0, 0, 0x7f}};
	for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
		for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
			check_replaced_number(arrays[i], 0, bad[k], "finite");
	static const unsigned char minus[4] = {0, 0, 0x80, 0xbf};
	check_replaced_number("ndf", 5, minus, "negative");
	check_replaced_number("sigma", 5, minus, "negative");
	check_replaced_number("vndf", 5, minus, "negative");
	check_replaced_number("luminance", 5, minus, "negative");
	check_replaced_number("theta_i", 3, minus, "ascend");
	check_replaced_number("wavelengths", 3, minus, "ascend");
}

/* Makes a side shorter by one: the arrays disagree, which the error says, although all of them are within the file. */
static void arrays_of_different_sizes_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *array;
		unsigned side;
		const char *what;
	} cases[] = {
		{"theta_i", 0, "vndf has other sizes than phi_i and theta_i"},
		{"vndf", 1, "vndf has other sizes"},
		{"luminance", 1, "luminance has other sizes"},
		{"luminance", 3, "spectra has other sizes than luminance"},
		{"luminance", 2, "spectra has other sizes than luminance"},
		{"spectra", 1, "spectra has other sizes"},
		{"spectra", 2, "needs one entry for each of the wavelengths"},
		{"spectra", 4, "no square"},
		{"wavelengths", 0, "needs one entry for each of the wavelengths"},
		{"jacobian", 0, "a side of 0"},
	};
	const struct memory_file *f = measured_file_all();
	unsigned char *copy = malloc(f->size);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct made_bsdf m;
		memcpy(copy, f->bytes, f->size);
		size_t at = 18, length = strlen(cases[i].array);
		while (memcmp(copy + at, cases[i].array, length) != 0)
			at++;
		copy[at + length + 11 + 8 * (size_t)cases[i].side]--;
		assert_int_equal(try_bytes(&m, copy, f->size), -EINVAL);
		if (!strstr(m.e.text, cases[i].what))
			fail_msg("%s, side %u: %s", cases[i].array, cases[i].side, m.e.text);
		arena_fini(&m.arena);
	}
	free(copy);
}

/* A file that is not a tensor file, one of another version, and one without an array. */
static void files_of_other_formats_are_refused(void **state)
{
	(void)state;
	const struct memory_file *f = measured_file_all();
	unsigned char *copy = malloc(f->size);
	struct made_bsdf m;
	assert_int_equal(try_bytes(&m, "ply\n", 4), -EINVAL);
	assert_non_null(strstr(m.e.text, "this is not a tensor file (.bsdf)"));
	arena_fini(&m.arena);
	memcpy(copy, f->bytes, f->size);
	copy[12] = 2;
	assert_int_equal(try_bytes(&m, copy, f->size), -ENOTSUP);
	arena_fini(&m.arena);
	copy[12] = 1;
	size_t at = 18;
	while (memcmp(copy + at, "sigma", 5) != 0)
		at++;
	copy[at] = 'S';
	assert_int_equal(try_bytes(&m, copy, f->size), -EINVAL);
	assert_non_null(strstr(m.e.text, "sigma is missing"));
	arena_fini(&m.arena);
	free(copy);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_agrees_with_its_formula),
		cmocka_unit_test(test_anisotropic_symmetries),
		cmocka_unit_test(isotropic_material_is_the_same_when_rotated),
		cmocka_unit_test(test_samples_follow_the_facets),
		cmocka_unit_test(test_rgb),
		cmocka_unit_test(test_white_is_white),
		cmocka_unit_test(test_roughness),
		cmocka_unit_test(truncated_files_are_refused),
		cmocka_unit_test(damaged_headers_are_refused_or_read),
		cmocka_unit_test(invalid_numbers_are_refused),
		cmocka_unit_test(arrays_of_different_sizes_are_refused),
		cmocka_unit_test(files_of_other_formats_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
