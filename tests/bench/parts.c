/* SPDX-License-Identifier: Apache-2.0 */
/* Nanoseconds taken by parts of the renderer, to see which parts are worth optimising: random blocks, spectra, the
 * film, each BSDF. */
#include "common/base/arena.h"
#include "tests/bench/bench.h"
#include "tests/support/nodes.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/chain/pss.h"
#include "worker/render/film/sums.h"

#include <stdio.h>
#include <string.h>

enum { CALLS = 1 << 14, POINTS = 1 << 10 };

struct part_inputs {
	struct wavelengths wl[POINTS];
	double u[POINTS][4];
	vec3 wo[POINTS], wi[POINTS]; /* in the upper hemisphere */
	const void *subject;
	void *film;
};

static void fill_inputs(struct part_inputs *s)
{
	for (uint64_t i = 0; i < POINTS; i++) {
		double a[4];
		rng_uniform4(0, RNG_TEST, i, 0, 0, s->u[i]);
		rng_uniform4(0, RNG_TEST, i, 1, 0, a);
		s->wl[i] = wavelengths_sample(s->u[i][3]);
		double r = sqrt(a[0]), t = sqrt(a[2]);
		s->wo[i] = (vec3){r * cos(2 * M_PI * a[1]), r * sin(2 * M_PI * a[1]), sqrt(1 - a[0]) + 1e-9};
		s->wi[i] = (vec3){t * cos(2 * M_PI * a[3]), t * sin(2 * M_PI * a[3]), sqrt(1 - a[2]) + 1e-9};
	}
}

static void time_part(const char *name, const struct part_inputs *s,
		      double (*part)(const struct part_inputs *s, unsigned i))
{
	struct series ns = {0};
	for (int r = 0; r < 2 + BENCH_REPEATS; r++) {
		double sum = 0, begin = bench_cpu_seconds();
		for (unsigned i = 0; i < CALLS; i++)
			sum += part(s, i % POINTS);
		double seconds = bench_cpu_seconds() - begin;
		bench_sink += sum;
		if (r >= 2)
			series_add(&ns, 1e9 * seconds / CALLS);
	}
	bench_row(name, &ns, "ns", BENCH_NO_TARGET, 0);
}

static double random_block(const struct part_inputs *s, unsigned i)
{
	(void)s;
	double out[SAMPLER_BLOCK_SIZE];
	sampler_fill_block(7, RNG_PATH, i, 3, SIDE_CAMERA, 2, out);
	return out[0] + out[7];
}

static double small_step(const struct part_inputs *s, unsigned i)
{
	return pss_small_step(s->u[i][0], s->u[i][1]);
}

static double reflectance(const struct part_inputs *s, unsigned i)
{
	return color_eval(s->subject, &s->wl[i]).v[1];
}

static double texture_rgb(const struct part_inputs *s, unsigned i)
{
	return color_eval_rgb_reflectance(s->u[i], &s->wl[i]).v[1];
}

static double to_xyz(const struct part_inputs *s, unsigned i)
{
	double xyz[3];
	spectrum_to_xyz(spectrum_constant(s->u[i][0]), &s->wl[i], xyz);
	return xyz[1];
}

static double splat_on_film(const struct part_inputs *s, unsigned i)
{
	struct splat at = {64 * s->u[i][0], 64 * s->u[i][1], {1, 1, 1}};
	film_sums_splat(s->film, &at, 1);
	return 0;
}

static struct bsdf_point make_bsdf_point(const struct part_inputs *s, unsigned i)
{
	return (struct bsdf_point){.texture_point = {.u = s->u[i][0], .v = s->u[i][1]}, .wavelengths = &s->wl[i]};
}

static double bsdf_eval(const struct part_inputs *s, unsigned i)
{
	const struct bsdf *b = s->subject;
	struct bsdf_point p = make_bsdf_point(s, i);
	return b->ops->eval(b, &p, s->wo[i], s->wi[i]).v[0];
}

static double bsdf_pdf(const struct part_inputs *s, unsigned i)
{
	const struct bsdf *b = s->subject;
	struct bsdf_point p = make_bsdf_point(s, i);
	return b->ops->pdf_solid(b, &p, s->wo[i], s->wi[i]);
}

static double bsdf_sample_pdf(const struct part_inputs *s, unsigned i)
{
	const struct bsdf *b = s->subject;
	struct bsdf_point p = make_bsdf_point(s, i);
	struct bsdf_sample out;
	return b->ops->sample(b, &p, s->wo[i], s->u[i], &out) ? out.pdf : 0;
}

static void time_film(struct part_inputs *s, const char *name, enum filter_kind kind, double radius)
{
	struct plan p = {.width = 64, .height = 64, .crop_width = 64, .crop_height = 64};
	struct scene_settings set = {.filter = kind, .filter_radius = radius, .filter_stddev = 0.5};
	struct film_sums sums;
	struct error e;
	if (film_sums_init(&sums, &p, &set, &e))
		bench_die(&e);
	s->film = &sums;
	time_part(name, s, splat_on_film);
	film_sums_fini(&sums);
}

static void time_color(struct part_inputs *s)
{
	struct error e;
	struct color c;
	const double rgb[3] = {0.3, 0.6, 0.2};
	if (color_from_rgb(rgb, COLOR_REFLECTANCE, &c)) {
		error_set(&e, EINVAL, "a colour does not fit");
		bench_die(&e);
	}
	s->subject = &c;
	time_part("reflectance of a fixed rgb", s, reflectance);
	if (color_from_rgb(rgb, COLOR_ILLUMINANT, &c) == 0)
		time_part("emitter's rgb x D65", s, reflectance);
	time_part("reflectance of a texel's rgb", s, texture_rgb);
	time_part("spectrum to XYZ", s, to_xyz);
}

static void time_bsdf(struct part_inputs *s, const char *text)
{
	struct arena arena = {.limit = 1 << 20};
	struct bsdf_build build = {.arena = &arena, .is_dialect_3 = true};
	struct bsdf b;
	struct error e;
	char name[96];
	if (bsdf_create(&b, node_make(&arena, PLUGIN_BSDF, text), &build, &e))
		bench_die(&e);
	s->subject = &b;
	snprintf(name, sizeof name, "%.36s: eval", text);
	time_part(name, s, bsdf_eval);
	snprintf(name, sizeof name, "%.36s: pdf", text);
	time_part(name, s, bsdf_pdf);
	snprintf(name, sizeof name, "%.36s: sample", text);
	time_part(name, s, bsdf_sample_pdf);
	arena_fini(&arena);
}

void bench_parts(const char *bin)
{
	(void)bin;
	static struct part_inputs s;
	fill_inputs(&s);
	bench_group("parts", "nanoseconds a call, inputs in cache");
	time_part("block of 8 random numbers", &s, random_block);
	time_part("small step of one number", &s, small_step);
	time_color(&s);
	time_film(&s, "splat, box", FILTER_BOX, 0.5);
	time_film(&s, "splat, tent", FILTER_TENT, 1);
	time_film(&s, "splat, gaussian", FILTER_GAUSSIAN, 2);
	time_bsdf(&s, "diffuse reflectance=rgb(0.8,0.2,0.1)");
	time_bsdf(&s, "conductor material=Au");
	time_bsdf(&s, "roughconductor material=Au distribution=ggx");
	time_bsdf(&s, "roughconductor material=Au");
	time_bsdf(&s, "dielectric");
	time_bsdf(&s, "roughdielectric distribution=ggx");
	time_bsdf(&s, "roughdielectric");
	time_bsdf(&s, "phong");
}
