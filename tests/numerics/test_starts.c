/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How chains begin: in complete darkness, with light that the bootstrap did not find, and with one bootstrap sample
 * that outweighs all others. For the last case 16 films of chains that all start from that sample are compared with 16
 * films of resampled chains, quarter by quarter; level 1e-6 each.
 */
#include "worker/render/render.h"
#include "tests/numerics/rows.h"
#include "tests/support/chains.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"

#include "common/estimate/strategy.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define TO_WORLD(inner) "<transform name='to_world'>" inner "</transform>"
/* clang-format off */
#define ROOM(lamp)                                                                                                              \
	SENSOR("0,0.2,1.9", "0,-0.3,-1")                                                                                        \
	"<shape type='cube'>" TO_WORLD("<scale value='2'/>") "</shape>"                                                                  \
	"<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>"                        \
	"<bsdf type='roughdielectric'><float name='alpha' value='0.1'/></bsdf></shape>" lamp
#define LAMP(center, radius, radiance)                                                                                          \
	"<shape type='sphere'><point name='center' value='" center "'/><float name='radius' value='" radius                        \
	"'/><emitter type='area'><float name='radiance' value='" radiance "'/></emitter></shape>"
/* clang-format on */
enum { FILMS = 16, CHAINS = 16 };

static struct rows rows;

static bool is_black(const struct chains_result *r)
{
	for (int i = 0; i < 3 * 32 * 32; i++)
		if (r->xyz[i] != 0)
			return false;
	return true;
}

static void check_unlit_start(const char *name, const char *scene)
{
	struct world *w = world_from_text(32, 32, "%s", scene);
	struct chains_options options = {.min_depth = 1,
					 .max_depth = 8,
					 .chains = CHAINS,
					 .bootstrap = 2048,
					 .steps = 500,
					 .seed = stats_seed(name)};
	struct chains_result r;
	char measured[200];
	chains_run(w, &options, &r);
	snprintf(measured, sizeof measured, "bootstrap %s, film %s, %llu accepted", r.is_black ? "black" : "lit",
		 is_black(&r) ? "black" : "lit", (unsigned long long)r.counters[COUNT_ACCEPTED]);
	rows_add(&rows, "black scene", name, measured, "black; 0",
		 r.is_black && is_black(&r) && r.counters[COUNT_ACCEPTED] == 0);
	free(r.xyz);
	world_free(w);
}

/* What the program reports for a black scene, and that it ends normally. */
static void check_program(void)
{
	const char *build = getenv("BUILD");
	char folder[] = "/tmp/black-XXXXXX", path[256], command[1024], line[512], message[512] = "";
	assert_non_null(mkdtemp(folder));
	snprintf(path, sizeof path, "%s/black.xml", folder);
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	fprintf(f, "<scene version='3.0.0'>%s</scene>", ROOM(""));
	fclose(f);
	snprintf(command, sizeof command, "%s/bin/hslt-render %s -o %s/black.exr --integrator hslt --spp 4 2>&1",
		 build ? build : "build", path, folder);
	FILE *p = popen(command, "r");
	assert_non_null(p);
	while (fgets(line, sizeof line, p))
		if (strstr(line, "black"))
			snprintf(message, sizeof message, "%.*s", (int)strcspn(line, "\n"), line);
	int code = pclose(p);
	bool written = false;
	snprintf(line, sizeof line, "%s/black.exr", folder);
	written = access(line, R_OK) == 0;
	char measured[700];
	snprintf(measured, sizeof measured, "exit code %d, %s image, says '%s'", code, written ? "an" : "no", message);
	rows_add(&rows, "black scene", "hslt-render", measured, "0, an image, 'the image is black'",
		 code == 0 && written && strstr(message, "the image is black"));
	unlink(line);
	unlink(path);
	rmdir(folder);
}

/* Chains that had to find the light themselves. */
static void check_light_found_later(void)
{
	struct world *w = world_from_text(32, 32, "%s", ROOM(LAMP("0.3,0.6,-1", "0.1", "5")));
	struct chains_result r;
	bool was_black = false;
	for (uint64_t seed = 1; !was_black && seed < 100; seed++) {
		struct chains_options options = {.mutations = "independent=0.2,hslt=0.8",
						 .min_depth = 1,
						 .max_depth = 1,
						 .chains = 4,
						 .bootstrap = 4,
						 .steps = 20000 / test_scale(),
						 .seed = seed};
		chains_run(w, &options, &r);
		was_black = r.is_black;
		if (!was_black)
			free(r.xyz);
	}
	char measured[200];
	/* Each mutation after the first one that found light adds 1 to the film. */
	snprintf(measured, sizeof measured, "%.2f %% of the mutations made after light was found, %.1f %% accepted",
		 was_black ? 100 * r.mean : 0,
		 was_black ? 100 * (double)r.counters[COUNT_ACCEPTED] / (double)r.counters[COUNT_SAMPLES] : 0);
	rows_add(&rows, "start", "light that the bootstrap missed", measured, "> 50 %",
		 was_black && r.mean > 0.5 && !r.invalid_film_values);
	if (was_black)
		free(r.xyz);
	world_free(w);
}

static void check_bright_start(void)
{
	struct world *w = world_from_text(32, 32, "%s", ROOM(LAMP("0.4,1.2,0", "0.3", "5")));
	double quarter[2][4][FILMS], stuck = 0, share = 0;
	for (int side = 0; side < 2; side++)
		for (int f = 0; f < FILMS; f++) {
			struct chains_options options = {.min_depth = 1,
							 .max_depth = 8,
							 .chains = CHAINS,
							 .bootstrap = 2048,
							 .steps = 2000 / test_scale(),
							 .seed = stats_seed("one sample dominates") +
								 (uint64_t)(2 * f + side)};
			struct chains_result r;
			uint64_t same_seeds[CHAINS];
			chains_run(w,
				   &(struct chains_options){.min_depth = 1,
							    .max_depth = 8,
							    .chains = 1,
							    .bootstrap = 2048,
							    .steps = 1,
							    .seed = options.seed},
				   &r);
			share = fmax(share, r.heaviest_share);
			for (int i = 0; i < CHAINS; i++)
				same_seeds[i] = r.heaviest_index;
			free(r.xyz);
			options.seeds = side ? same_seeds : NULL;
			chains_run(w, &options, &r);
			for (int q = 0; q < 4; q++)
				quarter[side][q][f] = r.quarter_means[q] / r.mean;
			stuck = fmax(stuck, (double)r.counters[COUNT_LONGEST_STUCK]);
			free(r.xyz);
		}
	double min_p = 1, off = 0;
	for (int q = 0; q < 4; q++) {
		double change[FILMS], mean = 0;
		for (int f = 0; f < FILMS; f++) {
			change[f] = quarter[1][q][f] - quarter[0][q][f];
			mean += quarter[0][q][f] / FILMS;
		}
		struct stats_mean m = stats_mean_test(change, FILMS, 0);
		if (m.p < min_p) {
			min_p = m.p;
			off = m.mean / mean;
		}
	}
	char measured[200];
	snprintf(measured, sizeof measured,
		 "heaviest holds %.1f %%; a quarter differs by %+.2f %% (p %.2g), longest stuck %.0f", 100 * share,
		 100 * off, min_p, stuck);
	rows_add(&rows, "start", "one sample for all chains", measured, "p > 1e-6", min_p > 1e-6);
	world_free(w);
}

static void test_starts(void **state)
{
	(void)state;
	check_unlit_start("no emitter", ROOM(""));
	check_unlit_start("the lamp is outside", ROOM(LAMP("0,9,0", "1", "5")));
	check_unlit_start("a lamp of radiance 0", ROOM(LAMP("0,1,0", "0.3", "0")));
	check_program();
	check_light_found_later();
	check_bright_start();
	printf("starts: %u cases, %u failed\n", rows.cases, rows.failed);
	assert_int_equal(rows.failed, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_starts)};
	return cmocka_run_group_tests_name("starts", tests, NULL, NULL);
}
