/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Emitters at infinity: sampling compared with the density, the density with the radiance, and the orientation.
 *
 * Level: 1e-7 per test, about 20 tests. Power: exchanging cells of the density, or shifting them by half a cell, is
 * found with certainty (a separate test shifts them).
 */
#include "tests/support/nodes.h"
#include "tests/support/pictures.h"
#include "tests/support/stats.h"
#include "worker/render/emitter/emitter.h"
#include "worker/render/math/rng.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846
#define LEVEL 1e-7

enum { WIDTH = 8, HEIGHT = 6, COLUMNS = 2 * WIDTH, CELLS = 2 * HEIGHT * COLUMNS, SAMPLES = 100000 };

/* In 3.x the outer rows are at the poles; otherwise they are half a pixel away from them. */
static bool dialect_3;
static int row_count(void)
{
	return 2 * (dialect_3 ? HEIGHT - 1 : HEIGHT);
}

static const struct wavelengths colour = {.nm = {450, 550, 600, 700}}, grey = {.is_grey = true};
static const char *const emitter_texts[] = {
	"constant",	      "constant radiance=rgb(0.3,0.5,2)",
	"envmap filename=p0", "envmap filename=p1 scale=3",
	"envmap filename=p2", "envmap filename=p3",
};
enum { CASES = sizeof emitter_texts / sizeof *emitter_texts };

struct fixture {
	struct arena arena;
	struct pictures pictures;
	struct asset_source source;
};

/* p0: many colours; p1: black except for one pixel; p2: one pixel; p3: a sun in the upper row; p4: black. */
static int setup(void **state)
{
	static struct fixture f;
	double rgb[WIDTH * HEIGHT * 3], dark[WIDTH * HEIGHT * 3] = {0};
	const double white[3] = {2, 2, 2};
	for (int i = 0; i < WIDTH * HEIGHT; i++) {
		double level = ldexp(1, i * 7 % 11 - 5);
		memcpy(rgb + 3 * i, (double[]){level, level * 0.5, level * (i % 2 ? 0.25 : 1)}, 3 * sizeof *rgb);
	}
	f = (struct fixture){.arena = {0}};
	pictures_add(&f.pictures, WIDTH, HEIGHT, rgb);
	memcpy(dark + 3 * (3 * WIDTH + 2), white, sizeof white);
	pictures_add(&f.pictures, WIDTH, HEIGHT, dark);
	pictures_add(&f.pictures, 1, 1, white);
	memcpy(rgb + 3 * 5, (double[]){0x1p20, 0x1p20, 0x1p20}, 3 * sizeof *rgb);
	pictures_add(&f.pictures, WIDTH, HEIGHT, rgb);
	memset(dark, 0, sizeof dark);
	pictures_add(&f.pictures, WIDTH, HEIGHT, dark);
	f.source = pictures_source(&f.pictures);
	*state = &f;
	return 0;
}

static int teardown(void **state)
{
	struct fixture *f = *state;
	pictures_fini(&f->pictures);
	arena_fini(&f->arena);
	return 0;
}

static int try_emitter_text(struct fixture *f, const char *text, const mat4 *to_world, struct emitter *em,
			    struct error *e)
{
	struct scene_node *n = node_make(&f->arena, PLUGIN_EMITTER, text);
	const struct emitter_build build = {.assets = &f->source, .arena = &f->arena, .is_dialect_3 = dialect_3};
	if (to_world)
		node_add_transform(&f->arena, n, "to_world", *to_world);
	return emitter_create(em, n, &build, e);
}

static struct emitter make_emitter(struct fixture *f, const char *text, const mat4 *to_world)
{
	struct emitter em;
	struct error e;
	if (try_emitter_text(f, text, to_world, &em, &e))
		fail_msg("%s: %s", text, e.text);
	return em;
}

static vec3 map_direction(double u, double v)
{
	double phi = 2 * PI * u, theta = PI * v;
	return (vec3){sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi)};
}

static double pdf_at(const struct emitter *em, vec3 d)
{
	const struct emitter_point x = {.p = d, .is_infinite = true};
	return em->ops->pdf_point(em, &x);
}

static spectrum radiance_at(const struct emitter *em, vec3 d, const struct wavelengths *w)
{
	const struct emitter_point x = {.p = d, .is_infinite = true};
	return em->ops->radiance(em, &x, vec3_neg(d), w);
}

/* Cells of half a pixel in both directions, in which a density that is constant between pixel centres is constant.
 * shift: in columns. */
static double expected_counts(const struct emitter *em, double shift, double *cells)
{
	double total = 0;
	for (int i = 0; i < row_count() * COLUMNS; i++) {
		int row = i / COLUMNS, column = i % COLUMNS;
		double angle = 2 * PI / COLUMNS * (cos(PI * row / row_count()) - cos(PI * (row + 1) / row_count()));
		double p =
			angle * pdf_at(em, map_direction((column + 0.5 + shift) / COLUMNS, (row + 0.5) / row_count()));
		cells[i] = p * SAMPLES;
		total += p;
	}
	return total;
}

static void check_sample(const struct emitter *em, const double u[2], const struct emitter_point *x, double pdf)
{
	const vec3 ref = {1, 2, 3};
	struct emitter_point y;
	double pdf_toward;
	assert_true(x->is_infinite && fabs(vec3_length(x->p) - 1) < 1e-14 && pdf > 0 && isfinite(pdf));
	assert_true(em->ops->pdf_point(em, x) == pdf && emitter_pdf_toward(em, ref, x) == pdf);
	assert_true(emitter_sample_toward(em, ref, u, &y, &pdf_toward));
	assert_true(y.p.x == x->p.x && y.p.y == x->p.y && y.p.z == x->p.z && pdf_toward == pdf);
}

static double chi_square(const struct emitter *em, double shift, uint64_t seed)
{
	static double expected[CELLS];
	static uint64_t observed[CELLS];
	memset(observed, 0, sizeof observed);
	assert_true(fabs(expected_counts(em, shift, expected) - 1) < 1e-9);
	for (uint64_t i = 0; i < SAMPLES; i++) {
		double u[4], pdf;
		struct emitter_point x;
		rng_uniform4(seed, RNG_TEST, i, 0, 0, u);
		assert_true(em->ops->sample_point(em, u, &x, &pdf));
		check_sample(em, u, &x, pdf);
		double turn = atan2(x.p.x, -x.p.z) / (2 * PI);
		int column = (int)(COLUMNS * (turn - floor(turn))), row = (int)(row_count() * acos(x.p.y) / PI);
		column = column == COLUMNS ? 0 : column;
		observed[(row == row_count() ? row - 1 : row) * COLUMNS + column]++;
	}
	return stats_counts_p(observed, expected, (size_t)row_count() * COLUMNS);
}

static void test_samples_follow_the_density(void **state)
{
	for (int k = 0; k < CASES; k++) {
		struct emitter em = make_emitter(*state, emitter_texts[k], NULL);
		assert_true(em.is_infinite && em.power > 0 && isfinite(em.power));
		double p = chi_square(&em, 0, stats_seed(emitter_texts[k]));
		print_message("%s: p = %.2e\n", emitter_texts[k], p);
		assert_true(p > LEVEL);
	}
	struct emitter em = make_emitter(*state, emitter_texts[2], NULL);
	assert_true(chi_square(&em, 1, stats_seed(__func__)) < LEVEL);
}

/* Computes the integral of the radiance in two ways; the density is positive wherever there is light. */
static void test_radiance_over_density_integrates_alike(void **state)
{
	enum { GROUPS = 16, STEPS = 400 };
	for (int k = 0; k < CASES; k++) {
		struct emitter em = make_emitter(*state, emitter_texts[k], NULL);
		double sum = 0, means[GROUPS] = {0};
		for (int i = 0; i < STEPS * 2 * STEPS; i++) {
			double v = (i / (2 * STEPS) + 0.5) / STEPS, u = (i % (2 * STEPS) + 0.5) / (2 * STEPS);
			vec3 d = map_direction(u, v);
			double l = radiance_at(&em, d, &colour).v[1];
			sum += l * sin(PI * v) * PI * PI / (STEPS * STEPS);
			assert_true(l == 0 || pdf_at(&em, d) > 0);
		}
		for (uint64_t i = 0; i < SAMPLES; i++) {
			double u[4], pdf;
			struct emitter_point x;
			rng_uniform4(stats_seed(emitter_texts[k]), RNG_TEST, i, 1, 0, u);
			if (em.ops->sample_point(&em, u, &x, &pdf))
				means[i % GROUPS] += radiance_at(&em, x.p, &colour).v[1] / pdf / (SAMPLES / GROUPS);
		}
		struct stats_mean m = stats_mean_test(means, GROUPS, sum);
		print_message("%s: %.6g +- %.2g, by quadrature %.6g\n", emitter_texts[k], m.mean, m.error, sum);
		assert_true(fabs(m.mean - sum) < 8 * m.error + 1e-4 * sum && m.error < 0.005 * sum);
	}
}

static void test_map_has_its_orientation(void **state)
{
	struct emitter em = make_emitter(*state, "envmap filename=p1 scale=3", NULL);
	/* The pixel (2, 3) of 8 x 6. */
	vec3 d = map_direction(2.5 / 8, dialect_3 ? 3.0 / 5 : 3.5 / 6);
	assert_true(d.x > 0 && d.y < 0 && d.z > 0);
	assert_true(fabs(radiance_at(&em, d, &grey).v[0] - 6) < 1e-9);
	assert_true(fabs(radiance_at(&em, d, &colour).v[1] - 6 * color_d65(550)) < 1e-9);
	assert_true(radiance_at(&em, vec3_neg(d), &grey).v[0] == 0);
	assert_int_equal(em.color_kind, COLOR_KIND_D65);

	/* A rotation by 90 degrees about y moves +z to +x; a scale has no effect; the density rotates with the map. */
	const mat4 turn = {{{0, 0, 2, 0}, {0, 2, 0, 0}, {-2, 0, 0, 0}, {0, 0, 0, 1}}};
	struct emitter turned = make_emitter(*state, "envmap filename=p1 scale=3", &turn);
	vec3 e = {d.z, d.y, -d.x};
	assert_true(fabs(radiance_at(&turned, e, &grey).v[0] - 6) < 1e-9);
	assert_true(fabs(pdf_at(&turned, e) / pdf_at(&em, d) - 1) < 1e-9);
	double u[2] = {0.3, 0.6}, pdf, pdf_turned;
	struct emitter_point x, y;
	assert_true(em.ops->sample_point(&em, u, &x, &pdf) && turned.ops->sample_point(&turned, u, &y, &pdf_turned));
	assert_true(fabs(y.p.x - x.p.z) < 1e-14 && fabs(y.p.z + x.p.x) < 1e-14 && fabs(pdf / pdf_turned - 1) < 1e-9);
}

/* Directions at which the red of p0 is seen; not exactly at the poles of 3.x, where all columns meet. */
static void test_pixel_centres_have_their_colours(void **state)
{
	struct emitter em = make_emitter(*state, "envmap filename=p0", NULL);
	const struct wavelengths red = {.is_rgb = true};
	for (int i = 0; i < WIDTH * HEIGHT; i++) {
		double row = i / WIDTH, v = dialect_3 ? row / (HEIGHT - 1) : (row + 0.5) / HEIGHT;
		vec3 d = map_direction((i % WIDTH + 0.5) / WIDTH, fmin(fmax(v, 1e-9), 1 - 1e-9));
		double is = radiance_at(&em, d, &red).v[0], want = ldexp(1, i * 7 % 11 - 5);
		if (fabs(is - want) > 1e-6)
			fail_msg("pixel %d: %.9g, expected %.9g", i, is, want);
	}
}

static void test_poles_and_ends_are_valid(void **state)
{
	for (int k = 0; k < CASES; k++) {
		struct emitter em = make_emitter(*state, emitter_texts[k], NULL);
		const vec3 poles[] = {{0, 1, 0}, {0, -1, 0}, {0, 0, -1}, {-0.0, 0, -1}, {1e-300, 1, 0}};
		for (int i = 0; i < 5; i++) {
			assert_true(isfinite(pdf_at(&em, poles[i])));
			assert_true(spectrum_is_valid(radiance_at(&em, poles[i], &colour)));
		}
		const double ends[] = {0, 0x1p-53, 0.5, 1 - 0x1p-53};
		for (int i = 0; i < 16; i++) {
			double u[2] = {ends[i % 4], ends[i / 4]}, pdf;
			struct emitter_point x;
			if (em.ops->sample_point(&em, u, &x, &pdf))
				check_sample(&em, u, &x, pdf);
		}
	}
}

/* Uneven scales, with shear and reflection; an exchange of two axes with a stretch along one. */
static const mat4 stretches[] = {
	{{{1, 0, 0, 0}, {0, 3, 0, 0}, {0, 0, 0.5, 0}, {0, 0, 0, 1}}},
	{{{1, 0.5, 0, 9}, {0.25, -2, 0, 0}, {0, 1, 1, 0}, {0, 0, 0, 1}}},
	{{{0, 0, 1e9, 0}, {0, 2e8, 0, 0}, {1e9, 0, 0, 0}, {0, 0, 0, 1}}},
};
enum { STRETCHES = sizeof stretches / sizeof *stretches };

/* A direction l of the image is seen in the direction M l. */
static void check_stretched_directions(struct fixture *f, const char *text, const mat4 *m, const struct emitter *em)
{
	struct emitter plain = make_emitter(f, text, NULL);
	for (int i = 0; i < 2000; i++) {
		vec3 l = map_direction((i % 50 + 0.37) / 50, (i / 50 + 0.41) / 40),
		     d = vec3_normalize(mat4_vector(m, l));
		double is = radiance_at(em, d, &colour).v[1], want = radiance_at(&plain, l, &colour).v[1];
		if (fabs(is - want) > 1e-9 * (want + 1e-3 * plain.brightness_bound))
			fail_msg("%s: %.9g at %d, not %.9g", text, is, i, want);
	}
}

/* Compares counts of samples in cells of the world with the integral of the density over these, by quadrature; the mean
 * of radiance over density with the integral of the radiance; and point_inverse with sample_point. */
static void check_stretched(const struct emitter *em, uint64_t seed)
{
	enum { ROWS = 10, SIDES = 20, FINE = 100, GROUPS = 16 };
	static double expected[ROWS * SIDES];
	static uint64_t observed[ROWS * SIDES];
	double total = 0, light = 0, means[GROUPS] = {0};
	memset(observed, 0, sizeof observed);
	memset(expected, 0, sizeof expected);
	for (int i = 0; i < ROWS * SIDES * FINE * FINE; i++) {
		int y = i / (SIDES * FINE), x = i % (SIDES * FINE);
		/* Points are shifted from column to column, because the density jumps along whole rows. */
		double v = (y + fmod(0.5 + 0.6180339887 * x, 1)) / (ROWS * FINE);
		vec3 d = map_direction((x + 0.5) / (SIDES * FINE), v);
		double angle = sin(PI * v) * 2 * PI * PI / (ROWS * SIDES * FINE * FINE), p = angle * pdf_at(em, d);
		total += p;
		light += angle * radiance_at(em, d, &colour).v[1];
		expected[y / FINE * SIDES + x / FINE] += p * SAMPLES;
	}
	if (fabs(total - 1) > 3e-3)
		fail_msg("the density's integral is %g", total);
	for (uint64_t i = 0; i < SAMPLES; i++) {
		double u[4], back[2], pdf;
		struct emitter_point x;
		rng_uniform4(seed, RNG_TEST, i, 2, 0, u);
		assert_true(em->ops->sample_point(em, u, &x, &pdf));
		check_sample(em, u, &x, pdf);
		em->ops->point_inverse(em, &x, back);
		assert_true(fabs(back[0] - u[0]) < 1e-6 && fabs(back[1] - u[1]) < 1e-6);
		double turn = atan2(x.p.x, -x.p.z) / (2 * PI);
		int column = (int)(SIDES * (turn - floor(turn))) % SIDES, row = (int)(ROWS * acos(x.p.y) / PI);
		observed[(row == ROWS ? row - 1 : row) * SIDES + column]++;
		means[i % GROUPS] += radiance_at(em, x.p, &colour).v[1] / pdf / (SAMPLES / GROUPS);
	}
	for (int i = 0; i < ROWS * SIDES; i++)
		expected[i] /= total;
	assert_true(stats_counts_p(observed, expected, ROWS * SIDES) > LEVEL);
	struct stats_mean m = stats_mean_test(means, GROUPS, light);
	print_message("%.6g +- %.2g, by quadrature %.6g\n", m.mean, m.error, light);
	assert_true(fabs(m.mean - light) < 8 * m.error + 3e-3 * light && m.error < 0.02 * light);
}

static void test_stretched_maps_follow_their_density(void **state)
{
	static const char *const images[] = {"envmap filename=p0", "envmap filename=p2", "envmap filename=p3"};
	for (int k = 0; k < 3; k++)
		for (int s = 0; s < STRETCHES; s++) {
			struct emitter em = make_emitter(*state, images[k], &stretches[s]);
			check_stretched_directions(*state, images[k], &stretches[s], &em);
			check_stretched(&em, stats_seed(images[k]) + (uint64_t)s);
		}
}

static void test_black_or_invalid_maps_are_refused(void **state)
{
	struct emitter em = make_emitter(*state, "envmap filename=p4", NULL);
	struct emitter_point x;
	struct error e = {{0}};
	double pdf;
	assert_true(em.power == 0 && !em.ops->sample_point(&em, (double[]){0.5, 0.5}, &x, &pdf));
	assert_true(pdf_at(&em, (vec3){0, 0, 1}) == 0);

	const mat4 flat = {{{1, 0.5, 0, 0}, {0, 0, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
	assert_true(try_emitter_text(*state, "envmap filename=p0", &flat, &em, &e) < 0 && strstr(e.text, "flat"));
	assert_true(try_emitter_text(*state, "sky", &stretches[0], &em, &e) < 0 &&
		    strstr(e.text, "a sky can only rotate"));
	assert_true(try_emitter_text(*state, "envmap", NULL, &em, &e) < 0 && strstr(e.text, "filename"));
	assert_true(try_emitter_text(*state, "moon", NULL, &em, &e) < 0 && strstr(e.text, "moon"));
	assert_true(try_emitter_text(*state, "area", NULL, &em, &e) < 0 && strstr(e.text, "shape"));
}

static int setup_dialect_3(void **state)
{
	dialect_3 = true;
	return setup(state);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_samples_follow_the_density),
		cmocka_unit_test(test_radiance_over_density_integrates_alike),
		cmocka_unit_test(test_map_has_its_orientation),
		cmocka_unit_test(test_pixel_centres_have_their_colours),
		cmocka_unit_test(test_poles_and_ends_are_valid),
		cmocka_unit_test(test_stretched_maps_follow_their_density),
		cmocka_unit_test(test_black_or_invalid_maps_are_refused),
	};
	return cmocka_run_group_tests_name("0.6", tests, setup, teardown) +
	       cmocka_run_group_tests_name("3.x", tests, setup_dialect_3, teardown);
}
