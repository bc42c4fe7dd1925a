/* SPDX-License-Identifier: Apache-2.0 */
/*
 * make calibration: is the error that an image states its true error? Small renders of scenes of three kinds
 * (calibration_scenes.h), by each integrator, at three lengths, which differ only in their seeds, are compared with
 * references made with other seeds. Writes the table of README.md to stdout; the exit code is 1 if the stated intervals
 * contain the true relMSE in less than 90 % of the renders of a length, or in more than 99 % of a hundred or more.
 *
 * The reference's own variance is subtracted from each comparison; a case whose reference has more than a tenth of the
 * renders' relMSE is left out, with a message. All scenes at the shortest length come first. SIGTERM ends the program
 * after the present case, with the verdict on the cases so far.
 */
#include "tests/image/calibration_scenes.h"
#include "common/base/program.h"
#include "tests/support/repeats.h"
#include "worker/render/world/build.h"

#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIZE = 16, VALUES = SIZE * SIZE * 3, PARTS = 4, INTEGRATORS = 7, LENGTHS = 3, PILOT_SPP = 64 };
enum { KINDS = 3, SCENES_MAX = 32 };

static const struct {
	const char *name;
	uint64_t spp; /* samples or mutations per pixel of the shortest renders */
} integrators[INTEGRATORS] = {{"path", 128}, {"bdpt8", 128},  {"bdpt", 64}, {"erpt", 64},
			      {"erpt4", 96}, {"pssmlt", 128}, {"hslt", 128}};
/* times: samples relative to the shortest length; time_fraction: the part of a scene's seconds that its reference
 * takes. */
static const struct {
	uint64_t times;
	double time_fraction;
} lengths[LENGTHS] = {{1, 0.25}, {4, 0.25}, {16, 1}};
static const char *const kinds[KINDS] = {"tree", "public", "made"};

static volatile sig_atomic_t is_interrupted;

static void on_sigterm(int signal)
{
	(void)signal;
	is_interrupted = 1;
}

struct reference {
	double time_fraction;			    /* part of the scene's seconds; 0: there is no reference yet */
	double rgb[VALUES], variance, floor_square; /* variance: relMSE of the reference */
};

/* A pilot determines how many samples the seconds allow. */
static void make_reference(const struct calibration_scene *s, const struct world *w, double time_fraction,
			   double time_factor, struct reference *r)
{
	if (r->time_fraction >= time_fraction)
		return;
	struct repeats parts;
	char test[96];
	snprintf(test, sizeof test, "%s pilot", s->name);
	struct repeats_options options = {
		.integrator = s->reference_integrator, .test = test, .count = 2, .spp = PILOT_SPP};
	repeats_run(w, &options, NULL, NULL, &parts);
	options.spp = (uint64_t)(time_fraction * time_factor * s->reference_seconds / PARTS * 2 * PILOT_SPP /
				 parts.cpu_seconds) +
		      PILOT_SPP;
	repeats_fini(&parts);
	snprintf(test, sizeof test, "%s reference", s->name);
	options.count = PARTS;
	repeats_run(w, &options, NULL, NULL, &parts);
	*r = (struct reference){.time_fraction = time_fraction};
	double mean = 0;
	for (uint32_t p = 0; p < PARTS; p++) {
		r->variance += parts.images[p].rel_mse / PARTS / PARTS;
		for (uint32_t i = 0; i < VALUES; i++)
			r->rgb[i] += (double)parts.images[p].rgb[i] / PARTS;
	}
	repeats_fini(&parts);
	for (uint32_t i = 0; i < VALUES; i++)
		mean += r->rgb[i] / VALUES;
	r->floor_square = 1e-4 * mean * mean;
}

static double realised_error(const struct reference *r, const struct canvas_image *img)
{
	double sum = 0;
	for (uint32_t i = 0; i < VALUES; i++)
		sum += pow((double)img->rgb[i] - r->rgb[i], 2) / (r->rgb[i] * r->rgb[i] + r->floor_square);
	return sum / VALUES - r->variance;
}

struct figures {
	int renders, stated, covered;
	double realised_sum, estimated_sum; /* sums of relMSE: realised, estimated */
	double far_values, values;	    /* channels of pixels: further from the truth than three errors; all */
};

static void add_image(const struct reference *r, const struct canvas_image *img, struct figures *f)
{
	double x = realised_error(r, img);
	f->renders++;
	f->realised_sum += x;
	f->estimated_sum += img->rel_mse;
	if (img->rel_mse_doubt == ERROR_DOUBT_NONE) {
		f->stated++;
		f->covered += img->rel_mse_interval_95[0] <= x && x <= img->rel_mse_interval_95[1];
	}
	for (uint32_t i = 0; i < VALUES; i++)
		f->far_values += fabs((double)img->rgb[i] - r->rgb[i]) > 3 * (double)img->error[i];
	f->values += VALUES;
}

/* What to measure, and the results: figures[kind][integrator][length], of cases whose references are good enough. */
struct calibration {
	uint32_t renders;
	int last;
	const char *seeds, *scene, *integrator;
	double times; /* factor on the time of all references */
	struct reference references[SCENES_MAX];
	struct figures figures[KINDS][INTEGRATORS][LENGTHS];
};

static int kind_index(const struct calibration_scene *s)
{
	int kind = 0;
	while (strcmp(s->kind, kinds[kind]) != 0)
		kind++;
	return kind;
}

/* Measures one row of the table. */
static void run_case(struct calibration *c, const struct calibration_scene *s, const struct world *w,
		     const struct reference *r, size_t k, int length)
{
	char test[96];
	snprintf(test, sizeof test, "stated errors of %s, length %d, seeds %s", s->name, length + 1, c->seeds);
	uint32_t renders = (c->renders >> length) + !(c->renders >> length);
	struct repeats_options options = {.integrator = integrators[k].name,
					  .test = test,
					  .count = renders,
					  .spp = integrators[k].spp * lengths[length].times};
	struct repeats run;
	struct figures f = {0};
	repeats_run(w, &options, NULL, NULL, &run);
	for (uint32_t i = 0; i < renders; i++)
		add_image(r, &run.images[i], &f);
	bool is_conclusive = r->variance <= 0.1 * f.realised_sum / renders;
	printf("| %s | %s | %s | %llu | %.1f | %.1f | %d of %d | %d%s | %.1f | %.2f |\n", s->kind, s->name,
	       options.integrator, (unsigned long long)options.spp, 100 * sqrt(fmax(0, f.realised_sum / renders)),
	       100 * sqrt(f.estimated_sum / renders), f.stated, f.renders, f.covered,
	       is_conclusive ? "" : " (reference too noisy)", 100 * f.far_values / f.values, run.cpu_seconds / renders);
	fflush(stdout);
	repeats_fini(&run);
	if (!is_conclusive)
		return;
	struct figures *totals = &c->figures[kind_index(s)][k][length];
	totals->renders += f.renders;
	totals->stated += f.stated;
	totals->covered += f.covered;
}

static bool is_selected(const struct calibration *c, size_t k)
{
	return !c->integrator || strcmp(c->integrator, integrators[k].name) == 0;
}

/* Measures all scenes at one length; returns how many were begun. */
static int run_length(struct calibration *c, int length)
{
	int scenes = 0;
	for (size_t i = 0; calibration_scenes[i].name && !is_interrupted; i++) {
		const struct calibration_scene *s = &calibration_scenes[i];
		if (strncmp(s->name, c->scene, strlen(c->scene)) != 0)
			continue;
		struct world *w = calibration_world(s, SIZE, SIZE);
		if (!w)
			continue;
		assert_true(i < SCENES_MAX);
		make_reference(s, w, lengths[length].time_fraction, c->times, &c->references[i]);
		for (size_t k = 0; k < INTEGRATORS && !is_interrupted; k++)
			if (is_selected(c, k))
				run_case(c, s, w, &c->references[i], k, length);
		world_free(w);
		scenes++;
	}
	return scenes;
}

static double coverage_percent(const struct figures *f)
{
	return f->stated ? 100.0 * f->covered / f->stated : 100;
}

static void print_figures(const struct figures *f)
{
	if (f->stated)
		printf(" %d of %d (%d) |", f->covered, f->stated, f->renders);
	else
		printf(" - (%d) |", f->renders);
}

/* Returns one row: one integrator at one length, for scenes of each kind and for all. */
static struct figures judge_integrator(const struct calibration *c, size_t k, int length)
{
	struct figures sum = {0};
	printf("| %d | %s |", length + 1, integrators[k].name);
	for (int kind = 0; kind < KINDS; kind++) {
		const struct figures *f = &c->figures[kind][k][length];
		print_figures(f);
		sum.renders += f->renders;
		sum.stated += f->stated;
		sum.covered += f->covered;
	}
	print_figures(&sum);
	printf(" %.1f |\n", coverage_percent(&sum));
	return sum;
}

static bool judge_length(const struct calibration *c, int length)
{
	struct figures sum = {0};
	for (size_t k = 0; k < INTEGRATORS; k++) {
		if (!is_selected(c, k))
			continue;
		struct figures f = judge_integrator(c, k, length);
		sum.renders += f.renders;
		sum.stated += f.stated;
		sum.covered += f.covered;
	}
	printf("| %d | all | | | |", length + 1);
	print_figures(&sum);
	printf(" %.1f |\n", coverage_percent(&sum));
	return coverage_percent(&sum) >= 90 && (sum.stated < 100 || coverage_percent(&sum) <= 99);
}

#define OF struct calibration
static const char *integrator_name(size_t i)
{
	return i < INTEGRATORS ? integrators[i].name : NULL;
}

static const struct option_row rows[] = {
	{"renders", 'r', "N", "Renders of each case, half as many of each next length",
	 OPTION_COUNT(OF, renders, 1, 1 << 20), .default_value = "20"},
	{"lengths", 'l', "N", "Only the shortest N lengths", OPTION_COUNT(OF, last, 1, LENGTHS), .default_value = "3"},
	{"seeds", 's', "WORD", "Makes the seeds; another word makes others", OPTION_TEXT(OF, seeds),
	 .default_value = "1"},
	{"scene", 0, "NAME", "Only scenes whose names begin with it", OPTION_TEXT(OF, scene), .default_value = ""},
	{"reference", 0, "TIMES", "References so many times as long", OPTION_NUMBER(OF, times, 0, 1e6),
	 .excludes_min = true, .default_value = "1"},
	{"integrator", 'i', "NAME", "Only this one", OPTION_TEXT(OF, integrator), .values = integrator_name},
	{0}};
#undef OF

static const struct program program = {
	.name = "calibration",
	.summary = "Are the errors that images state their errors? Writes a table.",
	.examples = "calibration --renders 8 --lengths 2 --seeds second --integrator erpt",
	.exit_codes = "0 they are, 1 too few or too many intervals hold, 2 usage",
	.options = {(const struct option_group[]){{NULL, rows}, {0}}, NULL},
};

int main(int argc, char **argv)
{
	static struct calibration c;
	program_parse_options(&program, argc, argv, &c);
	int scenes[LENGTHS] = {0};
	signal(SIGTERM, on_sigterm);
	printf("| kind | scene | integrator | a pixel | true %% | stated %% | intervals | held | beyond 3 errors %% | CPU s |\n"
	       "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
	for (int length = 0; length < c.last; length++)
		scenes[length] = run_length(&c, length);
	printf("\nHeld of stated (of rendered), where the reference can tell:\n\n"
	       "| length | integrator | tree | public | made | all | %% |\n| --- | --- | --- | --- | --- | --- | --- |\n");
	bool passed = true;
	for (int length = 0; length < c.last; length++)
		passed &= judge_length(&c, length);
	printf("\n");
	for (int length = 0; length < c.last; length++)
		printf("Length %d: %d scenes. ", length + 1, scenes[length]);
	printf("%s\n", is_interrupted ? "Ended by a signal: the last scene is not complete." : "");
	return passed ? 0 : 1;
}
