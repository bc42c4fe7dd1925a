/*
 * Errors at equal CPU time, one thread, bootstrap included: hslt, pssmlt, bdpt, path, and the breakup against its two parts
 * unbroken, against a long bdpt kept in build/bench-references (the error that it has itself is taken off, pixel by pixel).
 * HSLT_BENCH_SECONDS: other than 10 for each picture; references take ten times that.
 */
#include "common/base/mem.h"
#include "common/film/image_file.h"
#include "tests/bench/bench.h"
#include "tests/bench/scenes.h"
#include "worker/cli/local.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { REFERENCE_TIMES = 10, AROUND = 3 /* pixels */ };
#define TRIM 0.001 /* share of the pixels left out, the worst */

static const struct trial_scene {
	const char *name, *file; /* of the project, or of the folder that HSLT_SCENES names */
	bool shipped;
	uint32_t width, height;
} scenes[] = {
	{"three-spheres", "three-spheres.xml", false, 160, 90},
	{"half-sunk", "half-sunk.xml", false, 160, 90},
	{"half-sunk-rough", "half-sunk-rough.xml", false, 160, 90},
	{"cornell-box", "cornell-box/scene.xml", false, 112, 112},
	{"veach-mis", "veach-mis/scene.xml", false, 160, 90},
	{"veach-door", "veach-door/scene.xml", false, 144, 108},
	{"demo", "tests/scenes/demo/scene.xml", true, 160, 90},
	{"box", "tests/scenes/box/box.xml", true, 120, 100},
	{"displaced", "tests/scenes/displaced/scene.xml", true, 144, 96},
	{"water", "tests/scenes/displaced/water.xml", true, 160, 90},
	{"frosted", "tests/scenes/displaced/frosted.xml", true, 160, 90},
	{"pane", "tests/bench/scenes/pane.xml", true, 160, 90},
	{"window", "tests/bench/scenes/window.xml", true, 160, 90},
	{"rough-caustic", "tests/bench/scenes/rough-caustic.xml", true, 160, 90},
	{"glossy-room", "tests/bench/scenes/glossy-room.xml", true, 160, 90},
};

static const struct method {
	const char *name, *integrator, *mutations;
} methods[] = {
	{"hslt", "hslt", NULL},
	{"pssmlt", "pssmlt", NULL},
	{"bdpt", "bdpt", NULL},
	{"path", "path", NULL},
	{"breakup", "hslt", "hslt=0.95,bidirectional=0.05"},
	{"unbroken", "hslt", "halfvec=0.475,multichain=0.475,bidirectional=0.05"},
};
enum { METHODS = sizeof methods / sizeof *methods, BREAKUP = 4, UNBROKEN = 5 };

struct shot {
	struct canvas_image image;
	double cpu;
};

static void shoot(const struct world *w, const struct method *m, uint64_t spp, uint64_t seed, struct shot *out)
{
	struct error e;
	struct render_summary s;
	struct plan p;
	world_summary(w, &s);
	struct plan_request r = {.kind = render_integrator_find(m->integrator)->kind, .width = s.settings.width,
				 .height = s.settings.height, .border = s.settings.border, .min_depth = 1,
				 .max_depth = s.settings.max_depth, .spp = spp, .seed = seed};
	snprintf(r.integrator, sizeof r.integrator, "%s", m->integrator);
	if (render_integrator_find(m->integrator)->has_mutations && render_mutations(m->mutations, &s, r.mixture, &e))
		bench_die(&e);
	if (plan_make(&r, &p, &e))
		bench_die(&e);
	struct local_run run = {.world = w, .plan = &p, .threads = 1};
	if (local_run(&run, &e) || canvas_image(run.canvas, false, &out->image, &e))
		bench_die(&e);
	out->cpu = run.cpu_seconds;
	canvas_free(run.canvas);
}

/* As many samples a pixel as take about that long. */
static void shoot_for(const struct world *w, const struct method *m, double seconds, uint64_t seed, struct shot *out)
{
	for (uint64_t spp = 1;;) {
		shoot(w, m, spp, seed, out);
		if (out->cpu > 0.85 * seconds)
			return;
		/* The bootstrap and what a round costs: only a run that is not much shorter tells. */
		double factor = fmin(seconds / out->cpu * (out->cpu < 0.1 * seconds ? 0.12 : 1), 100);
		spp = (uint64_t)fmax((double)spp + 1, round((double)spp * factor));
		canvas_image_fini(&out->image);
	}
}

/* Colours and their standard errors, floats as they lie in memory. */
static size_t reference_size(const struct canvas_image *i)
{
	return (size_t)i->width * i->height * 3;
}

static bool read_reference(const char *path, struct canvas_image *i)
{
	size_t n = reference_size(i);
	FILE *f = fopen(path, "rb");
	bool ok = f && i->error && fread(i->rgb, sizeof(float), n, f) == n && fread(i->error, sizeof(float), n, f) == n && fgetc(f) == EOF;
	if (f)
		fclose(f);
	return ok;
}

static void write_reference(const char *path, const struct canvas_image *i)
{
	size_t n = reference_size(i);
	FILE *f = fopen(path, "wb");
	if (!f || fwrite(i->rgb, sizeof(float), n, f) != n || fwrite(i->error, sizeof(float), n, f) != n || fclose(f)) {
		perror(path);
		exit(1);
	}
}

static void make_reference(const struct world *w, const struct trial_scene *s, double seconds, struct shot *out)
{
	const struct method *bdpt = &methods[2];
	char path[256];
	mkdir("build", 0777);
	mkdir("build/bench-references", 0777);
	snprintf(path, sizeof path, "build/bench-references/%s-%ux%u-%.0fs", s->name, s->width, s->height, seconds);
	shoot(w, bdpt, 32, 99, out); /* for its size, with errors */
	if (read_reference(path, &out->image))
		return;
	canvas_image_fini(&out->image);
	shoot_for(w, bdpt, seconds, 99, out);
	write_reference(path, &out->image);
}

static int descending(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x < y) - (x > y);
}

static double *doubles(size_t n)
{
	double *p = mem_alloc(n, sizeof *p);
	if (!p) {
		struct error e;
		error_set(&e, ENOMEM, "out of memory");
		bench_die(&e);
	}
	return p;
}

/* What squared errors are measured by, as in worker/cli/compare.h, but for the mean of the reference around each pixel instead
 * of the pixel itself: hard scenes leave a reference noisy, and where it happens to be dark all would look wrong. */
static double *scales_of(const struct canvas_image *r)
{
	int width = (int)r->width, height = (int)r->height;
	double mean = 0, *scale = doubles(reference_size(r));
	for (size_t i = 0; i < reference_size(r); i++)
		mean += (double)r->rgb[i] / (double)reference_size(r);
	for (int y = 0; y < height; y++)
		for (int x = 0; x < width; x++)
			for (int k = 0; k < 3; k++) {
				double sum = 0, n = 0;
				for (int v = y - AROUND; v <= y + AROUND; v++)
					for (int u = x - AROUND; u <= x + AROUND; u++)
						if (u >= 0 && v >= 0 && u < width && v < height) {
							sum += (double)r->rgb[(v * width + u) * 3 + k];
							n++;
						}
				scale[(y * width + x) * 3 + k] = sum * sum / (n * n) + 1e-4 * mean * mean;
			}
	return scale;
}

/* In %, of squares by pixel and channel, without the worst pixels. */
static double relative(const struct canvas_image *i, const double *square, const double *scale)
{
	size_t pixels = (size_t)i->width * i->height, out = (size_t)(TRIM * (double)pixels);
	double *of = doubles(pixels), sum = 0;
	for (size_t k = 0; k < 3 * pixels; k++)
		of[k / 3] += square[k] / scale[k] / 3;
	qsort(of, pixels, sizeof *of, descending);
	for (size_t k = out; k < pixels; k++)
		sum += of[k];
	mem_free(of);
	return 100 * sqrt(fmax(sum, 0) / (double)(pixels - out));
}

/* By how far the image is from the reference, without the reference's own part. */
static double error_by_reference(const struct canvas_image *a, const struct canvas_image *r, const double *scale)
{
	double *square = doubles(reference_size(r));
	for (size_t i = 0; i < reference_size(r); i++) {
		double d = (double)a->rgb[i] - (double)r->rgb[i], own = (double)r->error[i];
		square[i] = d * d - own * own;
	}
	double e = relative(r, square, scale);
	mem_free(square);
	return e;
}

/* By how far the image's independent groups are from each other. */
static double error_by_spread(const struct canvas_image *a, const double *scale)
{
	double *square = doubles(reference_size(a));
	for (size_t i = 0; i < reference_size(a); i++)
		square[i] = (double)a->error[i] * (double)a->error[i];
	double e = relative(a, square, scale);
	mem_free(square);
	return e;
}

static double brightness(const struct canvas_image *i)
{
	double sum = 0;
	for (size_t k = 0; k < reference_size(i); k++)
		sum += (double)i->rgb[k];
	return sum;
}

static void compare_all(const struct world *w, const struct trial_scene *s, double seconds)
{
	struct shot reference;
	double error[METHODS];
	size_t best = 0;
	make_reference(w, s, REFERENCE_TIMES * seconds, &reference);
	double *scale = scales_of(&reference.image);
	printf("  %-10s %8s %12s %10s %10s %10s\n", "", "CPU s", "samples", "error %", "by spread", "mean");
	for (size_t i = 0; i < METHODS; i++) {
		struct shot shot;
		shoot_for(w, &methods[i], seconds, 1, &shot);
		/* To the same time, by the square root of the rest. */
		double same = sqrt(shot.cpu / seconds);
		error[i] = same * error_by_reference(&shot.image, &reference.image, scale);
		printf("  %-10s %8.2f %12llu %10.2f %10.2f %10.4f\n", methods[i].name, shot.cpu,
		       (unsigned long long)shot.image.samples, error[i], same * error_by_spread(&shot.image, scale),
		       brightness(&shot.image) / brightness(&reference.image));
		fflush(stdout);
		best = i < BREAKUP && error[i] < error[best] ? i : best;
		canvas_image_fini(&shot.image);
	}
	printf("  least: %s; the reference's own: %.2f %%\n", methods[best].name, error_by_spread(&reference.image, scale));
	canvas_image_fini(&reference.image);
	mem_free(scale);
	for (size_t i = 0; i < METHODS; i++)
		bench_single(methods[i].name, error[i], "% error", BENCH_INFORMS, 0);
	bench_single("breakup / unbroken", error[BREAKUP] / error[UNBROKEN], "of the error", BENCH_INFORMS, 0);
}

void bench_equal_time(const char *bin)
{
	(void)bin;
	const char *asked = getenv("HSLT_BENCH_SECONDS"), *only = getenv("HSLT_BENCH_SCENE");
	double seconds = asked ? atof(asked) : 10;
	for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
		const struct trial_scene *s = &scenes[i];
		const struct render_options size = {.width = s->width, .height = s->height};
		char says[128];
		if (only && strcmp(only, s->name) != 0)
			continue;
		snprintf(says, sizeof says, "%s, %ux%u, %g CPU seconds each", s->name, s->width, s->height, seconds);
		bench_group("equal-time", says);
		struct world *w = bench_world(s->file, s->shipped, &size);
		if (!w) {
			bench_skip("HSLT_SCENES does not name a folder with this scene");
			continue;
		}
		compare_all(w, s, seconds);
		world_free(w);
	}
}
