/* SPDX-License-Identifier: Apache-2.0 */
/*
 * make calibration: is the error that an image states its error? Small renders of scenes of three kinds
 * (calibration_scenes.h), by each integrator, at three lengths, which differ in their seeds only, against references
 * made with other seeds. Writes the table of README.md to stdout, and ends with 1 where the intervals that were stated
 * hold the true relMSE in less than 90 % of the renders of a length, or in more than 99 % of a hundred or more. The
 * reference's own variance is subtracted from each comparison; a case whose reference has more than a tenth of the
 * renders' relMSE is left out, and said so. SIGTERM ends it after the case that is being measured, with its verdict.
 *
 *   calibration [RENDERS [LENGTHS [SCENE]]]    20 renders a case, half as many of each next length; 3 lengths; scenes
 * whose names begin with SCENE
 */
#include "tests/image/calibration_scenes.h"
#include "tests/support/repeats.h"

#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIZE = 16, VALUES = SIZE * SIZE * 3, PARTS = 4, INTEGRATORS = 5, LENGTHS = 3, PILOT_SPP = 64 };

static const struct {
	const char *name;
	uint64_t spp; /* samples or mutations a pixel of the shortest renders */
} integrators[INTEGRATORS] = {{"path", 128}, {"bdpt8", 128}, {"bdpt", 64}, {"pssmlt", 128}, {"hslt", 128}};
static const uint64_t lengths[LENGTHS] = {1, 4, 16};

static volatile sig_atomic_t ended;

static void end(int signal)
{
	(void)signal;
	ended = 1;
}

struct reference {
	double rgb[VALUES], variance, floor_square; /* variance: its relMSE */
};

/* A pilot tells how many samples the scene's seconds buy. */
static void make_reference(const struct calibration_scene *s, const struct world *w, struct reference *r)
{
	struct repeats parts;
	char test[96];
	snprintf(test, sizeof test, "%s pilot", s->name);
	struct repeats_how how = {.integrator = s->reference, .test = test, .count = 2, .spp = PILOT_SPP};
	repeats_run(w, &how, NULL, NULL, &parts);
	how.spp = (uint64_t)(s->seconds / PARTS * 2 * PILOT_SPP / parts.cpu_seconds) + PILOT_SPP;
	repeats_free(&parts);
	snprintf(test, sizeof test, "%s reference", s->name);
	how.count = PARTS;
	repeats_run(w, &how, NULL, NULL, &parts);
	*r = (struct reference){.variance = 0};
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

static double realised(const struct reference *r, const struct canvas_image *img)
{
	double sum = 0;
	for (uint32_t i = 0; i < VALUES; i++)
		sum += pow((double)img->rgb[i] - r->rgb[i], 2) / (r->rgb[i] * r->rgb[i] + r->floor_square);
	return sum / VALUES - r->variance;
}

struct figures {
	int renders, stated, held;
	double own, estimate; /* sums of relMSE: realised, estimated */
	double far, values;   /* pixels' channels beyond three of their errors; all */
};

static void look(const struct reference *r, const struct canvas_image *img, struct figures *f)
{
	double x = realised(r, img);
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

/* One row of the table; into `all` where the reference can tell. */
static void run_case(const struct calibration_scene *s, const struct world *w, const struct reference *r, size_t k,
		     int length, uint32_t renders, struct figures *all)
{
	char test[96];
	snprintf(test, sizeof test, "stated errors of %s, length %d", s->name, length + 1);
	struct repeats_how how = {.integrator = integrators[k].name,
				  .test = test,
				  .count = renders,
				  .spp = integrators[k].spp * lengths[length]};
	struct repeats run;
	struct figures f = {0};
	repeats_run(w, &how, NULL, NULL, &run);
	for (uint32_t i = 0; i < renders; i++)
		look(r, &run.images[i], &f);
	bool tells = r->variance <= 0.1 * f.own / renders;
	printf("| %s | %s | %s | %llu | %.1f | %.1f | %d of %d | %d%s | %.1f | %.2f |\n", s->kind, s->name,
	       how.integrator, (unsigned long long)how.spp, 100 * sqrt(fmax(0, f.own / renders)),
	       100 * sqrt(f.estimate / renders), f.stated, f.renders, f.held, tells ? "" : " (reference too noisy)",
	       100 * f.far / f.values, run.cpu_seconds / renders);
	fflush(stdout);
	repeats_free(&run);
	if (!tells)
		return;
	all->renders += f.renders;
	all->stated += f.stated;
	all->held += f.held;
}

static void run_scene(const struct calibration_scene *s, const struct world *w, uint32_t renders, int last,
		      struct figures all[INTEGRATORS][LENGTHS])
{
	static struct reference r;
	make_reference(s, w, &r);
	for (size_t k = 0; k < INTEGRATORS; k++)
		for (int length = 0; length < last && !ended; length++)
			run_case(s, w, &r, k, length, (renders >> length) + !(renders >> length), &all[k][length]);
}

static double percent(const struct figures *f)
{
	return f->stated ? 100.0 * f->held / f->stated : 100;
}

/* A length, and its integrators one by one. */
static bool judge(struct figures all[INTEGRATORS][LENGTHS], int length)
{
	struct figures sum = {0};
	for (size_t k = 0; k < INTEGRATORS; k++) {
		sum.renders += all[k][length].renders;
		sum.stated += all[k][length].stated;
		sum.held += all[k][length].held;
	}
	printf("\nLength %d: %d of %d renders state an interval, %d of them (%.1f %%) hold the true relMSE", length + 1,
	       sum.stated, sum.renders, sum.held, percent(&sum));
	for (size_t k = 0; k < INTEGRATORS; k++) {
		const struct figures *f = &all[k][length];
		printf("%s `%s` %d of %d of %d", k ? ";" : ":", integrators[k].name, f->held, f->stated, f->renders);
	}
	printf(".\n");
	return percent(&sum) >= 90 && (sum.stated < 100 || percent(&sum) <= 99);
}

int main(int argc, char **argv)
{
	uint32_t renders = argc > 1 && atoi(argv[1]) > 0 ? (uint32_t)atoi(argv[1]) : 20;
	int last = argc > 2 && atoi(argv[2]) > 0 && atoi(argv[2]) < LENGTHS ? atoi(argv[2]) : LENGTHS, scenes = 0;
	static struct figures all[INTEGRATORS][LENGTHS];
	signal(SIGTERM, end);
	printf("| kind | scene | integrator | a pixel | true %% | stated %% | intervals | held | beyond 3 errors %% | CPU s |\n"
	       "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
	for (const struct calibration_scene *s = calibration_scenes; s->name && !ended; s++) {
		if (argc > 3 && strncmp(s->name, argv[3], strlen(argv[3])) != 0)
			continue;
		struct world *w = calibration_world(s, SIZE, SIZE);
		if (!w)
			continue;
		run_scene(s, w, renders, last, all);
		world_free(w);
		scenes++;
	}
	printf("\n%d scenes%s.\n", scenes, ended ? "; ended by a signal, the last row is of the last scene begun" : "");
	bool right = true;
	for (int length = 0; length < last; length++)
		right &= judge(all, length);
	return right ? 0 : 1;
}
