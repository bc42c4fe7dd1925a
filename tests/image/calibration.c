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
enum { KINDS = 3, SCENES_MOST = 32 };

static const struct {
	const char *name;
	uint64_t spp; /* samples or mutations per pixel of the shortest renders */
} integrators[INTEGRATORS] = {{"path", 128}, {"bdpt8", 128},  {"bdpt", 64}, {"erpt", 64},
			      {"erpt4", 96}, {"pssmlt", 128}, {"hslt", 128}};
/* times: samples relative to the shortest length; reference: the part of a scene's seconds that its reference takes. */
static const struct {
	uint64_t times;
	double reference;
} lengths[LENGTHS] = {{1, 0.25}, {4, 0.25}, {16, 1}};
static const char *const kinds[KINDS] = {"tree", "public", "made"};

static volatile sig_atomic_t ended;

static void end(int signal)
{
	(void)signal;
	ended = 1;
}

struct reference {
	double part;				    /* part of the scene's seconds; 0: there is no reference yet */
	double rgb[VALUES], variance, floor_square; /* variance: relMSE of the reference */
};

/* A pilot determines how many samples the seconds allow. */
static void make_reference(const struct calibration_scene *s, const struct world *w, double part, double times,
			   struct reference *r)
{
	if (r->part >= part)
		return;
	struct repeats parts;
	char test[96];
	snprintf(test, sizeof test, "%s pilot", s->name);
	struct repeats_how how = {.integrator = s->reference, .test = test, .count = 2, .spp = PILOT_SPP};
	repeats_run(w, &how, NULL, NULL, &parts);
	how.spp = (uint64_t)(part * times * s->seconds / PARTS * 2 * PILOT_SPP / parts.cpu_seconds) + PILOT_SPP;
	repeats_free(&parts);
	snprintf(test, sizeof test, "%s reference", s->name);
	how.count = PARTS;
	repeats_run(w, &how, NULL, NULL, &parts);
	*r = (struct reference){.part = part};
	double mean = 0;
	for (uint32_t p = 0; p < PARTS; p++) {
		r->variance += parts.images[p].rel_mse / PARTS / PARTS;
		for (uint32_t i = 0; i < VALUES; i++)
			r->rgb[i] += (double)parts.images[p].rgb[i] / PARTS;
	}
	repeats_free(&parts);
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
	int renders, stated, held;
	double own, estimate; /* sums of relMSE: realised, estimated */
	double far, values;   /* channels of pixels: further from the truth than three errors; all */
};

static void add_image(const struct reference *r, const struct canvas_image *img, struct figures *f)
{
	double x = realised_error(r, img);
	f->renders++;
	f->own += x;
	f->estimate += img->rel_mse;
	if (img->rel_mse_doubt == ERROR_KNOWN) {
		f->stated++;
		f->held += img->rel_mse_95[0] <= x && x <= img->rel_mse_95[1];
	}
	for (uint32_t i = 0; i < VALUES; i++)
		f->far += fabs((double)img->rgb[i] - r->rgb[i]) > 3 * (double)img->error[i];
	f->values += VALUES;
}

/* What to measure, and the results: all[kind][integrator][length], of cases whose references are good enough. */
struct calibration {
	uint32_t renders;
	int last;
	const char *seeds, *scene, *integrator;
	double times; /* factor on the time of all references */
	struct reference references[SCENES_MOST];
	struct figures all[KINDS][INTEGRATORS][LENGTHS];
};

static int kind_of(const struct calibration_scene *s)
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
	struct repeats_how how = {.integrator = integrators[k].name,
				  .test = test,
				  .count = renders,
				  .spp = integrators[k].spp * lengths[length].times};
	struct repeats run;
	struct figures f = {0};
	repeats_run(w, &how, NULL, NULL, &run);
	for (uint32_t i = 0; i < renders; i++)
		add_image(r, &run.images[i], &f);
	bool tells = r->variance <= 0.1 * f.own / renders;
	printf("| %s | %s | %s | %llu | %.1f | %.1f | %d of %d | %d%s | %.1f | %.2f |\n", s->kind, s->name,
	       how.integrator, (unsigned long long)how.spp, 100 * sqrt(fmax(0, f.own / renders)),
	       100 * sqrt(f.estimate / renders), f.stated, f.renders, f.held, tells ? "" : " (reference too noisy)",
	       100 * f.far / f.values, run.cpu_seconds / renders);
	fflush(stdout);
	repeats_free(&run);
	if (!tells)
		return;
	struct figures *all = &c->all[kind_of(s)][k][length];
	all->renders += f.renders;
	all->stated += f.stated;
	all->held += f.held;
}

static bool is_asked(const struct calibration *c, size_t k)
{
	return !c->integrator || strcmp(c->integrator, integrators[k].name) == 0;
}

/* Measures all scenes at one length; returns how many were begun. */
static int run_length(struct calibration *c, int length)
{
	int scenes = 0;
	for (size_t i = 0; calibration_scenes[i].name && !ended; i++) {
		const struct calibration_scene *s = &calibration_scenes[i];
		if (strncmp(s->name, c->scene, strlen(c->scene)) != 0)
			continue;
		struct world *w = calibration_world(s, SIZE, SIZE);
		if (!w)
			continue;
		assert_true(i < SCENES_MOST);
		make_reference(s, w, lengths[length].reference, c->times, &c->references[i]);
		for (size_t k = 0; k < INTEGRATORS && !ended; k++)
			if (is_asked(c, k))
				run_case(c, s, w, &c->references[i], k, length);
		world_free(w);
		scenes++;
	}
	return scenes;
}

static double percent(const struct figures *f)
{
	return f->stated ? 100.0 * f->held / f->stated : 100;
}

static void put_figures(const struct figures *f)
{
	if (f->stated)
		printf(" %d of %d (%d) |", f->held, f->stated, f->renders);
	else
		printf(" - (%d) |", f->renders);
}

/* Returns one row: one integrator at one length, for scenes of each kind and for all. */
static struct figures judge_integrator(const struct calibration *c, size_t k, int length)
{
	struct figures sum = {0};
	printf("| %d | %s |", length + 1, integrators[k].name);
	for (int kind = 0; kind < KINDS; kind++) {
		const struct figures *f = &c->all[kind][k][length];
		put_figures(f);
		sum.renders += f->renders;
		sum.stated += f->stated;
		sum.held += f->held;
	}
	put_figures(&sum);
	printf(" %.1f |\n", percent(&sum));
	return sum;
}

static bool judge_scene(const struct calibration *c, int length)
{
	struct figures sum = {0};
	for (size_t k = 0; k < INTEGRATORS; k++) {
		if (!is_asked(c, k))
			continue;
		struct figures f = judge_integrator(c, k, length);
		sum.renders += f.renders;
		sum.stated += f.stated;
		sum.held += f.held;
	}
	printf("| %d | all | | | |", length + 1);
	put_figures(&sum);
	printf(" %.1f |\n", percent(&sum));
	return percent(&sum) >= 90 && (sum.stated < 100 || percent(&sum) <= 99);
}

#define OF struct calibration
static const char *integrator_name(size_t i)
{
	return i < INTEGRATORS ? integrators[i].name : NULL;
}

static const struct option_row rows[] = {
	{"renders", 'r', "N", "Renders of each case, half as many of each next length",
	 OPTION_COUNT(OF, renders, 1, 1 << 20), .standard = "20"},
	{"lengths", 'l', "N", "Only the shortest N lengths", OPTION_COUNT(OF, last, 1, LENGTHS), .standard = "3"},
	{"seeds", 's', "WORD", "Makes the seeds; another word makes others", OPTION_TEXT(OF, seeds), .standard = "1"},
	{"scene", 0, "NAME", "Only scenes whose names begin with it", OPTION_TEXT(OF, scene), .standard = ""},
	{"reference", 0, "TIMES", "References so many times as long", OPTION_NUMBER(OF, times, 0, 1e6), .above = true,
	 .standard = "1"},
	{"integrator", 'i', "NAME", "Only this one", OPTION_TEXT(OF, integrator), .values = integrator_name},
	{0}};
#undef OF

static const struct program program = {
	.name = "calibration",
	.summary = "Are the errors that images state their errors? Writes a table.",
	.examples = "calibration --renders 8 --lengths 2 --seeds second --integrator erpt",
	.exits = "0 they are, 1 too few or too many intervals hold, 2 usage",
	.own = {(const struct option_group[]){{NULL, rows}, {0}}, NULL},
};

int main(int argc, char **argv)
{
	static struct calibration c;
	program_options(&program, argc, argv, &c);
	int scenes[LENGTHS] = {0};
	signal(SIGTERM, end);
	printf("| kind | scene | integrator | a pixel | true %% | stated %% | intervals | held | beyond 3 errors %% | CPU s |\n"
	       "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
	for (int length = 0; length < c.last; length++)
		scenes[length] = run_length(&c, length);
	printf("\nHeld of stated (of rendered), where the reference can tell:\n\n"
	       "| length | integrator | tree | public | made | all | %% |\n| --- | --- | --- | --- | --- | --- | --- |\n");
	bool right = true;
	for (int length = 0; length < c.last; length++)
		right &= judge_scene(&c, length);
	printf("\n");
	for (int length = 0; length < c.last; length++)
		printf("Length %d: %d scenes. ", length + 1, scenes[length]);
	printf("%s\n", ended ? "Ended by a signal: the last scene is not complete." : "");
	return right ? 0 : 1;
}
