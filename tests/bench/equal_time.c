/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Relative errors squared times CPU seconds, one thread, pilot and bootstrap included: the default against hslt,
 * pssmlt, bdpt and path, and the breakup against its two parts unbroken, each with several seeds, with and without the
 * worst pixels.
 *
 * If the default chooses an integrator, its image has the same bits as with `--integrator`: so it is rendered once, and
 * the default is charged the pilot in addition. Otherwise the machine's load would make two times of the same samples
 * differ.
 *
 * The reference is two long renders R, S by the integrator that the default chooses, with different seeds, kept in
 * build/bench-references: the mean of (A - R)(A - S) is the squared error of A, whatever the errors of R and S are. A
 * third figure leaves out the pixels in which these two differ most.
 *
 * HSLT_BENCH_SECONDS: seconds per picture instead of 10.
 * HSLT_BENCH_REFERENCE: seconds of both references together instead of ten times that.
 * HSLT_BENCH_SEEDS: number of seeds instead of 5.
 * HSLT_BENCH_METHODS: only the first so many methods; 6, 7 and 8 add bdpt8, erpt and erpt4, which the default is not
 * compared with.
 * HSLT_BENCH_RANDOM=0-9: random scenes (tests/support/random_scene.h) instead.
 */
#include "common/base/mem.h"
#include "common/exr/image_file.h"
#include "tests/bench/bench.h"
#include "tests/bench/scenes.h"
#include "tests/support/random_scene.h"
#include "tests/support/stats.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/cli/render/local_run.h"
#include "worker/render/render.h"
#include "worker/render/choose_integrator.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { REFERENCE_FACTOR = 10, REFERENCE_FACTOR_MAX = 10000, NEIGHBOURHOOD_RADIUS = 3 /* pixels */, SEEDS_MAX = 32 };
enum { HALVES = 2, REFERENCE_SEED = 99 /* the second reference has the next seed */ };
#define TRIM_FRACTION 0.001	     /* share of the pixels that is left out, the worst ones */
#define UNKNOWN_FRACTION 0.01	     /* share left out where the references differ most, whatever the method */
enum { ALL, TRIMMED, KNOWN, KINDS }; /* which pixels count */
static const char *const kind_names[KINDS] = {"all pixels", "trimmed", "where the reference is known"};

static const struct trial_scene {
	const char *name, *file; /* a file of the project, or of the folder that HSLT_SCENES names */
	bool is_shipped;
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
	{"hall", "tests/bench/scenes/hall.xml", true, 160, 120},
	{"daylight", "tests/bench/scenes/daylight.xml", true, 160, 120},
	{"ring", "tests/bench/scenes/ring.xml", true, 160, 90},
	{"torus", "tests/bench/scenes/torus.xml", true, 160, 90},
	{"bulb", "tests/scenes/bulb/scene.xml", true, 160, 90},
	{"effects-glass", "tests/bench/scenes/effects-glass.xml", true, 160, 90},
	{"effects-box", "tests/bench/scenes/effects-box.xml", true, 160, 90},
	{"kitchen", "tests/bench/scenes/kitchen.xml", true, 160, 90},
	{"corridor", "tests/bench/scenes/corridor.xml", true, 160, 90},
	{"jewel", "tests/bench/scenes/jewel.xml", true, 160, 90},
	{"pool", "tests/bench/scenes/pool.xml", true, 160, 90},
};

static const struct method {
	const char *name, *integrator, *mutations;
} methods[] = {
	{"default", RENDER_INTEGRATOR_DEFAULT, NULL},
	{"hslt", "hslt", NULL},
	{"pssmlt", "pssmlt", NULL},
	{"bdpt", "bdpt", NULL},
	{"path", "path", NULL},
	{"bdpt8", "bdpt8", NULL},
	{"erpt", "erpt", NULL},
	{"erpt4", "erpt4", NULL},
	{"breakup", "hslt", "hslt=0.95,bidirectional=0.05"},
	{"unbroken", "hslt", "halfvec=0.475,multichain=0.475,bidirectional=0.05"},
};
enum { METHODS = sizeof methods / sizeof *methods, DEFAULT = 0, PEERS_END = 5, BREAKUP = 8, UNBROKEN = 9 };

struct shot {
	struct canvas_image image;
	double cpu_seconds, pilot_seconds; /* pilot_seconds: part of cpu_seconds */
	char integrator[16];
};

static struct plan_request make_plan_request(const struct world *w, const struct method *m, uint64_t spp, uint64_t seed)
{
	struct render_summary s;
	world_summary(w, &s);
	struct plan_request r = {.width = s.settings.width,
				 .height = s.settings.height,
				 .border = s.settings.border,
				 .min_depth = 1,
				 .max_depth = s.settings.max_depth,
				 .spp = spp,
				 .seed = seed};
	snprintf(r.integrator, sizeof r.integrator, "%s", m->integrator);
	return r;
}

/* Runs the pilot: the integrator that the default chooses, and the CPU seconds of the choice. */
static void choose_integrator(const struct world *w, struct plan_request *r, struct shot *out)
{
	struct error e;
	struct render_choice choice;
	double begin = bench_cpu_seconds();
	if (render_choose(w, r, &choice, &e))
		bench_die(&e);
	out->pilot_seconds = bench_cpu_seconds() - begin;
}

static void render_shot(const struct world *w, const struct method *m, uint64_t spp, uint64_t seed, struct shot *out)
{
	struct error e;
	struct render_summary s;
	struct plan p;
	struct plan_request r = make_plan_request(w, m, spp, seed);
	const struct integrator_properties *integrator = render_integrator_find(m->integrator);
	world_summary(w, &s);
	out->pilot_seconds = 0;
	if (!integrator) {
		choose_integrator(w, &r, out);
		integrator = render_integrator_find(r.integrator);
	} else if (integrator->has_mutations && render_canonical_mutations(m->mutations, &s, r.mixture, &e)) {
		bench_die(&e);
	}
	r.kind = integrator->kind;
	snprintf(out->integrator, sizeof out->integrator, "%s", r.integrator);
	if (plan_make(&r, &p, &e))
		bench_die(&e);
	struct local_run run = {.world = w, .plan = &p, .threads = 1};
	if (local_run(&run, &e) || canvas_image_init(run.canvas, false, &out->image, &e))
		bench_die(&e);
	out->cpu_seconds = run.cpu_seconds + out->pilot_seconds;
	canvas_free(run.canvas);
}

/* Returns the number of samples per pixel that takes about so many seconds. */
static uint64_t render_for_seconds(const struct world *w, const struct method *m, double seconds, uint64_t seed,
				   struct shot *out)
{
	for (uint64_t spp = 1;;) {
		render_shot(w, m, spp, seed, out);
		if (out->cpu_seconds > 0.85 * seconds)
			return spp;
		/* The bootstrap and the cost of a round: only a run that is not much shorter than the real one shows
		 * them. */
		double factor = fmin(seconds / out->cpu_seconds * (out->cpu_seconds < 0.1 * seconds ? 0.12 : 1), 100);
		spp = (uint64_t)fmax((double)spp + 1, round((double)spp * factor));
		canvas_image_fini(&out->image);
	}
}

/* What images are compared with; three values per pixel. */
struct reference {
	size_t pixels;
	int width, height;
	struct canvas_image halves[HALVES];
	double *squared_errors;	     /* squared errors of the mean of both references */
	double *scale, *known_scale; /* divisors of squared errors */
};

static size_t value_count(const struct canvas_image *i)
{
	return (size_t)i->width * i->height * 3;
}

/* Reads colours only, as floats in this machine's byte order. */
static bool read_reference(const char *path, struct canvas_image *i)
{
	size_t n = value_count(i);
	FILE *f = fopen(path, "rb");
	bool ok = f && fread(i->rgb, sizeof(float), n, f) == n && fgetc(f) == EOF;
	if (f)
		fclose(f);
	return ok;
}

static void write_reference(const char *path, const struct canvas_image *i)
{
	size_t n = value_count(i);
	FILE *f = fopen(path, "wb");
	if (!f || fwrite(i->rgb, sizeof(float), n, f) != n || fclose(f)) {
		perror(path);
		exit(1);
	}
}

static void make_reference_half(const struct world *w, const struct trial_scene *s, double seconds, unsigned half,
				struct canvas_image *out)
{
	const struct method *method = &methods[DEFAULT];
	struct shot shot;
	char path[256];
	mkdir("build", 0777);
	mkdir("build/bench-references", 0777);
	snprintf(path, sizeof path, "build/bench-references/%s-%ux%u-%.0fs-%u", s->name, s->width, s->height, seconds,
		 half);
	render_shot(w, method, 1, REFERENCE_SEED, &shot); /* only to get the size */
	if (!read_reference(path, &shot.image)) {
		canvas_image_fini(&shot.image);
		render_for_seconds(w, method, seconds, REFERENCE_SEED + half, &shot);
		write_reference(path, &shot.image);
	}
	*out = shot.image;
}

/* Orders by magnitude: products may be negative. */
static int descending(const void *a, const void *b)
{
	double x = fabs(*(const double *)a), y = fabs(*(const double *)b);
	return (x < y) - (x > y);
}

static double *alloc_doubles(size_t n)
{
	return bench_alloc(n, sizeof(double));
}

static double half_mean(const struct reference *m, size_t i)
{
	return 0.5 * ((double)m->halves[0].rgb[i] + (double)m->halves[1].rgb[i]);
}

/* Divisors of squared errors, as in worker/cli/image/compare.h, but from the mean of the reference around each pixel
 * instead of the pixel itself: in hard scenes the reference is noisy, and where it happens to be dark every image would
 * look wrong. */
static double *compute_scales(const struct reference *m)
{
	double mean = 0, *scale = alloc_doubles(3 * m->pixels);
	for (size_t i = 0; i < 3 * m->pixels; i++)
		mean += half_mean(m, i) / (double)(3 * m->pixels);
	for (int y = 0; y < m->height; y++)
		for (int x = 0; x < m->width; x++)
			for (int k = 0; k < 3; k++) {
				double sum = 0, n = 0;
				for (int v = y - NEIGHBOURHOOD_RADIUS; v <= y + NEIGHBOURHOOD_RADIUS; v++)
					for (int u = x - NEIGHBOURHOOD_RADIUS; u <= x + NEIGHBOURHOOD_RADIUS; u++)
						if (u >= 0 && v >= 0 && u < m->width && v < m->height) {
							sum += half_mean(m, (size_t)((v * m->width + u) * 3 + k));
							n++;
						}
				scale[(y * m->width + x) * 3 + k] = sum * sum / (n * n) + 1e-4 * mean * mean;
			}
	return scale;
}

/* Like compute_scales(), but infinite where the two references differ most. */
static double *compute_known_scales(const struct reference *m)
{
	double *pixel_errors = alloc_doubles(m->pixels), *sorted = alloc_doubles(m->pixels),
	       *known = alloc_doubles(3 * m->pixels);
	for (size_t i = 0; i < 3 * m->pixels; i++)
		pixel_errors[i / 3] += m->squared_errors[i] / m->scale[i];
	memcpy(sorted, pixel_errors, m->pixels * sizeof *pixel_errors);
	qsort(sorted, m->pixels, sizeof *sorted, descending);
	double threshold = sorted[(size_t)(UNKNOWN_FRACTION * (double)m->pixels)];
	for (size_t i = 0; i < 3 * m->pixels; i++)
		known[i] = pixel_errors[i / 3] > threshold ? INFINITY : m->scale[i];
	mem_free(pixel_errors);
	mem_free(sorted);
	return known;
}

static void reference_init(const struct world *w, const struct trial_scene *s, double seconds, struct reference *m)
{
	for (unsigned h = 0; h < HALVES; h++)
		make_reference_half(w, s, seconds / HALVES, h, &m->halves[h]);
	m->width = (int)m->halves[0].width;
	m->height = (int)m->halves[0].height;
	m->pixels = value_count(&m->halves[0]) / 3;
	m->squared_errors = alloc_doubles(3 * m->pixels);
	for (size_t i = 0; i < 3 * m->pixels; i++) {
		double d = 0.5 * ((double)m->halves[0].rgb[i] - (double)m->halves[1].rgb[i]);
		m->squared_errors[i] = d * d;
	}
	m->scale = compute_scales(m);
	m->known_scale = compute_known_scales(m);
}

static void reference_fini(struct reference *m)
{
	for (unsigned h = 0; h < HALVES; h++)
		canvas_image_fini(&m->halves[h]);
	mem_free(m->squared_errors);
	mem_free(m->scale);
	mem_free(m->known_scale);
}

/* Returns the relMSE from squares by pixel and channel, without the given share of the worst pixels. */
static double relative_mse(size_t pixels, const double *square, const double *scale, double trim)
{
	size_t trimmed = (size_t)(trim * (double)pixels);
	double *pixel_errors = alloc_doubles(pixels), sum = 0;
	for (size_t k = 0; k < 3 * pixels; k++)
		pixel_errors[k / 3] += square[k] / scale[k] / 3;
	qsort(pixel_errors, pixels, sizeof *pixel_errors, descending);
	for (size_t k = trimmed; k < pixels; k++)
		sum += pixel_errors[k];
	mem_free(pixel_errors);
	return fmax(sum, 0) / (double)(pixels - trimmed);
}

/* Returns the squared difference between image and reference, without the reference's own error. */
static double error_by_reference(const struct canvas_image *a, const struct reference *m, const double *scale,
				 double trim)
{
	double *square = alloc_doubles(3 * m->pixels);
	for (size_t i = 0; i < 3 * m->pixels; i++)
		square[i] = ((double)a->rgb[i] - (double)m->halves[0].rgb[i]) *
			    ((double)a->rgb[i] - (double)m->halves[1].rgb[i]);
	double e = relative_mse(m->pixels, square, scale, trim);
	mem_free(square);
	return e;
}

/* Returns the error from the spread of the image's independent groups. */
static double error_by_spread(const struct canvas_image *a, const struct reference *m)
{
	double *square = alloc_doubles(3 * m->pixels);
	for (size_t i = 0; i < 3 * m->pixels; i++)
		square[i] = (double)a->error[i] * (double)a->error[i];
	double e = relative_mse(m->pixels, square, m->scale, TRIM_FRACTION);
	mem_free(square);
	return e;
}

static double total_brightness(const struct canvas_image *i)
{
	double sum = 0;
	for (size_t k = 0; k < value_count(i); k++)
		sum += (double)i->rgb[k];
	return sum;
}

/* Results of one method, one for each seed: relMSE times CPU seconds. */
struct trial {
	uint64_t spp;
	double costs[KINDS][SEEDS_MAX], mean_cost[KINDS], brightness_ratios[SEEDS_MAX], spread_costs[SEEDS_MAX],
		cpu_seconds[SEEDS_MAX];
	double mean_brightness, mean_spread_cost;
	double pilot_fraction;		 /* CPU seconds of the pilot, which are part of the cost */
	char integrators[SEEDS_MAX][16]; /* names of integrators */
};

/* Adds seed k to the sums over all seeds. */
static void add_seed(struct trial *out, unsigned seeds, unsigned k)
{
	for (int t = 0; t < KINDS; t++)
		out->mean_cost[t] += out->costs[t][k] / seeds;
	out->mean_brightness += out->brightness_ratios[k] / seeds;
	out->mean_spread_cost += out->spread_costs[k] / seeds;
}

static void measure_method(const struct world *w, const struct method *m, double seconds, unsigned seeds, unsigned k,
			   const struct reference *reference, struct trial *out)
{
	struct shot shot;
	if (!out->spp)
		out->spp = render_for_seconds(w, m, seconds, 1 + k, &shot);
	else
		render_shot(w, m, out->spp, 1 + k, &shot);
	out->cpu_seconds[k] = shot.cpu_seconds;
	for (int t = 0; t < KINDS; t++)
		out->costs[t][k] =
			shot.cpu_seconds * error_by_reference(&shot.image, reference,
							      t == KNOWN ? reference->known_scale : reference->scale,
							      t == ALL ? 0 : TRIM_FRACTION);
	out->brightness_ratios[k] = 2 * total_brightness(&shot.image) /
				    (total_brightness(&reference->halves[0]) + total_brightness(&reference->halves[1]));
	out->spread_costs[k] = shot.cpu_seconds * error_by_spread(&shot.image, reference);
	add_seed(out, seeds, k);
	out->pilot_fraction += shot.pilot_seconds / shot.cpu_seconds / seeds;
	snprintf(out->integrators[k], sizeof out->integrators[k], "%s", shot.integrator);
	canvas_image_fini(&shot.image);
}

/* Takes the default's result for seed k, after all methods have run: the result of the chosen method plus the pilot, or
 * a render of its own. */
static void measure_default(const struct world *w, double seconds, unsigned seeds, unsigned k, size_t count,
			    const struct reference *reference, struct trial *trials)
{
	struct trial *out = &trials[DEFAULT];
	struct shot shot;
	for (size_t i = DEFAULT + 1; i < count && i < BREAKUP; i++) {
		struct plan_request r = make_plan_request(w, &methods[DEFAULT], trials[i].spp, 1 + k);
		choose_integrator(w, &r, &shot);
		if (strcmp(r.integrator, methods[i].integrator) != 0)
			continue;
		double factor = (trials[i].cpu_seconds[k] + shot.pilot_seconds) / trials[i].cpu_seconds[k];
		for (int t = 0; t < KINDS; t++)
			out->costs[t][k] = trials[i].costs[t][k] * factor;
		out->brightness_ratios[k] = trials[i].brightness_ratios[k];
		out->spread_costs[k] = trials[i].spread_costs[k] * factor;
		add_seed(out, seeds, k);
		out->pilot_fraction += shot.pilot_seconds / (trials[i].cpu_seconds[k] + shot.pilot_seconds) / seeds;
		snprintf(out->integrators[k], sizeof out->integrators[k], "%s", r.integrator);
		return;
	}
	measure_method(w, &methods[DEFAULT], seconds, seeds, k, reference, out);
}

/* Returns the value that |t| exceeds with a probability of 5 %. */
static double student_95(double degrees)
{
	double low = 0, high = 1000;
	for (int i = 0; i < 60; i++) {
		double middle = 0.5 * (low + high);
		*(stats_student_t_p(middle, degrees) > 0.05 ? &low : &high) = middle;
	}
	return high;
}

/* Prints the ratio of both means with a 95 % interval: that of the ratio's logarithm, from the spread between seeds.
 * Both methods are rendered with the same seeds, and each seed within the same minute. */
static void print_ratio(const char *label, const struct trial *a, const struct trial *b, int t, unsigned seeds)
{
	double ratio = a->mean_cost[t] / b->mean_cost[t], square = 0;
	if (!(a->mean_cost[t] > 0 && b->mean_cost[t] > 0)) { /* the reference's errors are larger */
		printf("  %s: not known, the reference is too noisy\n", label);
		return;
	}
	for (unsigned k = 0; k < seeds; k++) {
		double x = a->costs[t][k] / a->mean_cost[t] - 1, y = b->costs[t][k] / b->mean_cost[t] - 1;
		square += (x - y) * (x - y) / seeds / (seeds - 1);
	}
	double half_width = exp(seeds > 1 ? student_95(seeds - 1) * sqrt(square) : INFINITY);
	printf("  %s: %.2f [%.2f, %.2f]\n", label, ratio, ratio / half_width, ratio * half_width);
}

static void print_trials(const struct trial *trials, size_t count, unsigned seeds)
{
	printf("  %-10s %14s %14s %14s %14s %10s\n", "relMSE x s", "all pixels", "trimmed", "where known", "by spread",
	       "mean");
	for (size_t i = 0; i < count; i++)
		printf("  %-10s %14.5g %14.5g %14.5g %14.5g %10.4f\n", methods[i].name, trials[i].mean_cost[ALL],
		       trials[i].mean_cost[TRIMMED], trials[i].mean_cost[KNOWN], trials[i].mean_spread_cost,
		       trials[i].mean_brightness);
	printf("  chosen by the default:");
	for (unsigned k = 0; k < seeds; k++)
		printf(" %s", trials[DEFAULT].integrators[k]);
	printf("; its pilot took %.1f %% of the time\n", 100 * trials[DEFAULT].pilot_fraction);
}

static void compare_methods(const struct world *w, const struct trial_scene *s, double seconds, unsigned seeds,
			    size_t count, unsigned reference_factor)
{
	struct reference reference;
	static struct trial trials[METHODS];
	size_t best[KINDS] = {1, 1, 1};
	reference_init(w, s, reference_factor * seconds, &reference);
	memset(trials, 0, sizeof trials);
	for (unsigned k = 0; k < seeds; k++) {
		for (size_t i = DEFAULT + 1; i < count; i++)
			measure_method(w, &methods[i], seconds, seeds, k, &reference, &trials[i]);
		measure_default(w, seconds, seeds, k, count, &reference, trials);
	}
	for (size_t i = DEFAULT + 1; i < count && i < PEERS_END; i++)
		for (int t = 0; t < KINDS; t++)
			best[t] = trials[i].mean_cost[t] < trials[best[t]].mean_cost[t] ? i : best[t];
	print_trials(trials, count, seeds);
	for (int t = 0; t < KINDS && count > 1; t++) {
		char label[80];
		snprintf(label, sizeof label, "default over the best, %s (%s)", kind_names[t], methods[best[t]].name);
		print_ratio(label, &trials[DEFAULT], &trials[best[t]], t, seeds);
		snprintf(label, sizeof label, "default / best, %s", kind_names[t]);
		if (trials[best[t]].mean_cost[t] > 0)
			bench_single(label, trials[DEFAULT].mean_cost[t] / trials[best[t]].mean_cost[t], "of the time",
				     BENCH_NO_TARGET, 0);
	}
	printf("  the reference's own relMSE: %.3g\n",
	       relative_mse(reference.pixels, reference.squared_errors, reference.scale, 0));
	fflush(stdout);
	reference_fini(&reference);
	for (size_t i = 0; i < count; i++)
		bench_single(methods[i].name, trials[i].mean_cost[1], "relMSE s, trimmed", BENCH_NO_TARGET, 0);
	if (count > UNBROKEN)
		bench_single("breakup / unbroken", trials[BREAKUP].mean_cost[1] / trials[UNBROKEN].mean_cost[1],
			     "of the time", BENCH_NO_TARGET, 0);
}

/* Returns a whole number from the environment, between 1 and `max`, or the default. */
static unsigned env_count(const char *name, unsigned fallback, unsigned max)
{
	const char *text = getenv(name);
	long n = text ? atol(text) : 0;
	return n < 1 ? fallback : n > (long)max ? max : (unsigned)n;
}

struct run_options {
	double seconds;
	unsigned seeds, methods, reference_factor;
};

/* Runs all methods on one scene; frees the world. */
static void run_scene(struct world *w, const struct trial_scene *s, const struct run_options *l)
{
	char description[128];
	snprintf(description, sizeof description, "%s, %ux%u, %g CPU seconds and %u seeds each", s->name, s->width,
		 s->height, l->seconds, l->seeds);
	bench_group("equal-time", description);
	if (!w) {
		bench_skip("HSLT_SCENES does not name a folder with this scene");
		return;
	}
	compare_methods(w, s, l->seconds, l->seeds, l->methods, l->reference_factor);
	world_free(w);
}

static void run_random_scenes(const char *numbers, const struct run_options *l)
{
	static struct random_scene scene;
	uint64_t number, last;
	for (random_scene_parse_range(numbers, &number, &last); number <= last; number++) {
		char name[32];
		snprintf(name, sizeof name, "random-%llu", (unsigned long long)number);
		const struct trial_scene s = {.name = name, .width = 96, .height = 72};
		random_scene_make(&scene, number, bsdf_cases, BSDF_CASES);
		run_scene(random_scene_world(&scene, s.width, s.height), &s, l);
	}
}

void bench_equal_time(const char *bin)
{
	(void)bin;
	const char *time = getenv("HSLT_BENCH_SECONDS"), *only = getenv("HSLT_BENCH_SCENE"),
		   *random = getenv("HSLT_BENCH_RANDOM");
	const struct run_options l = {time ? atof(time) : 10, env_count("HSLT_BENCH_SEEDS", 5, SEEDS_MAX),
				      env_count("HSLT_BENCH_METHODS", METHODS, METHODS),
				      env_count("HSLT_BENCH_REFERENCE", REFERENCE_FACTOR, REFERENCE_FACTOR_MAX)};
	if (random) {
		run_random_scenes(random, &l);
		return;
	}
	for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
		const struct trial_scene *s = &scenes[i];
		const struct render_options size = {.width = s->width, .height = s->height};
		if (!only || strcmp(only, s->name) == 0)
			run_scene(bench_world(s->file, s->is_shipped, &size), s, &l);
	}
}
