/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Each mutation alone, and each forced (b, c), leaves bdpt's distribution of paths unchanged, on paths of exactly k
 * edges (tests/support/stationary.h says what is compared, and why this is so much sharper than comparing two
 * images).
 *
 * Level: 1e-6 per case. Power: the smallest bias of a soft quarter of the image that is found with 95 % probability
 * is printed and is at most 2 %; for colours and the functions other than images it is printed only. The mean of the
 * whole image cannot change: a mutation keeps the number of edges, and the total light of all paths of one length is
 * b, which independent proposals alone estimate (tests/worker/render/path/test_full_path.c compares their densities
 * path by path, test_integrators.c images of mixtures). Independent proposals go anywhere on the film, so that no
 * noise cancels: they find 2 % with FULL=1 and k = 3 only, 10 % otherwise. At least 10 % of the accepted moves must
 * be those of the forced choice; the starts count as accepted independent proposals.
 *
 * About 70 s of CPU time; FULL=1: every (b, c) and every mutation, k = 2..4 and 6 on every scene, k = 8 on two.
 * SCENE="rough glass" runs one scene alone; HSLT_TEST_ROWS=1 prints reasons of failure as well.
 */
#include "tests/support/test_length.h"
#include "tests/support/stationary.h"
#include "tests/worker/render/mutation/scenes.h"
#include "worker/render/render.h"
#include "worker/render/mutation/mutation.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { STARTS = 120, BOOTSTRAP = 1024 };

/* Mutations to test on paths with this number of edges. */
struct length_cases {
	unsigned edges;
	const char *mutations;
};

struct scene_cases {
	const char *scene;
	struct length_cases lengths[8];
};

static const struct scene_cases scene_list[] = {
	{"diffuse", {{3, "hslt@b0 hslt@b3c0 bidirectional independent rejoin hslt"}, {2, "hslt@b2c0"}}},
	{"glossy", {{3, "hslt@b2c1 hslt@b3c0 bidirectional hslt halfvec rejoin light"}, {4, "hslt@b4c0 hslt@b3c1"}}},
	{"rough glass",
	 {{4, "hslt@b0 hslt@b1c0 hslt@b2c1 hslt@b3c0 hslt@b3c2 hslt@b4c0 hslt@b4c1 hslt@b4c2 hslt halfvec multichain"},
	  {6, "hslt@b6c2 hslt@b5c2"},
	  {8, "hslt@b8c4"}}},
	{"smooth glass", {{4, "hslt@b0 hslt@b4c0 hslt@b4c1 hslt halfvec light"}, {5, "hslt@b5c0 hslt@b5c1"}}},
	{"specular chain", {{5, "hslt@b0 hslt@b5c0 hslt@b5c1 hslt@b5c2 hslt"}, {7, "hslt@b7c1"}}},
	{"bent normals", {{3, "hslt@b3c0 hslt@b2c0"}, {4, "hslt@b4c0 hslt@b3c1 hslt"}}},
	{"environment", {{2, "hslt@b1c0"}, {3, "hslt@b1c0 hslt@b3c0 light"}, {4, "hslt@b4c1 hslt"}}},
	{"delta emitters", {{3, "hslt@b1c0 hslt@b2c0 hslt@b3c0"}, {4, "hslt@b4c0 hslt@b3c1 hslt"}}},
	{"sun", {{2, "hslt@b2c0"}, {3, "hslt@b1c0 hslt@b2c0 hslt@b3c0 hslt"}}},
	{"dispersion", {{4, "hslt@b4c0 hslt@b3c1 wavelength"}}},
	{"dispersion, smooth", {{4, "hslt@b0 hslt@b4c0 wavelength light hslt"}}},
	{"aperture", {{3, "hslt@b0 hslt@b1c0 hslt@b3c0 lens rejoin"}, {4, "hslt@b4c1 lens"}}},
};
enum { SCENES = sizeof scene_list / sizeof *scene_list };

static void print_result(const char *scene, const struct stationary_options *options, const struct stationary_result *r,
			 const char *verdict)
{
	char worst[96] = "nothing differs";
	if (r->worst_function >= 0)
		snprintf(worst, sizeof worst, "%s %+.2f %% +- %.2f %%", stationary_function_name(r->worst_function),
			 100 * r->bias[r->worst_function], 100 * r->error[r->worst_function]);
	printf("%-18s k%u %-11s accepts %4.1f %%, %4.1f %% of all; finds %.2f %% on a quarter, %.1f %% of colours, "
	       "%.1f %% of vertices; %s (p %.1g); %s\n",
	       scene, options->max_edges, options->mutation, 100 * (double)r->accepted / (double)r->proposals,
	       100 * r->accepted_share, 100 * r->detectable_block_bias, 100 * r->detectable_colour_bias,
	       100 * r->detectable_other_bias, worst, r->p, verdict);
	if (!getenv("HSLT_TEST_ROWS"))
		return;
	for (int i = 0; i < STRATEGY_COUNTERS; i++)
		printf(" %.3f", (double)r->strategy[i] / (double)r->proposals);
	printf(" %.2f s %s\n", r->cpu_seconds, r->failure);
}

struct tally {
	unsigned cases, failed;
	double max_block_error, seconds;
	uint64_t mutations;
};

/* starts: the starts shared by all mutations on paths of this length. chosen: the mutation was listed for this scene,
 * so that it must be able to move. */
static void check_mutation(const struct world *w, const char *scene, unsigned edges, const char *mutation, bool chosen,
			   struct stationary_starts *from, struct tally *t)
{
	static struct stationary_result r;
	/* Independent proposals lie anywhere on the film, so far less of the noise cancels. */
	const struct mutation_ops *ops = mutation_find(mutation, strcspn(mutation, "@"));
	bool fresh = ops && ops->is_independent, weak;
	uint32_t enough = edges == 2 ? 2 : 1, more = fresh && test_is_full() && edges == 3 ? 16 : enough;
	struct stationary_options options = {mutation,		 edges, edges, more * STARTS, more * BOOTSTRAP,
					     STATIONARY_NO_FAULT};
	if (more == enough)
		stationary_run_with_starts(w, scene, &options, from, &r);
	else
		stationary_run(w, scene, &options, &r);
	for (; (weak = !test_is_scaled() && r.detectable_block_bias > 0.02 && !fresh) && test_is_full() && more < 16;
	     more *= 2) {
		options.starts *= 2;
		options.bootstrap *= 2;
		stationary_run(w, scene, &options, &r);
	}
	/* A mutation cannot move what a scene lacks, so only mutations listed for the scene must move. */
	bool idle = chosen && !test_is_scaled() && r.accepted_share < 0.1;
	const char *verdict = !stationary_passes(&r) ? "FAILED" : weak ? "TOO WEAK" : idle ? "HARDLY MOVES" : "ok";
	print_result(scene, &options, &r, verdict);
	t->cases++;
	t->failed += strcmp(verdict, "ok") != 0;
	t->max_block_error = fmax(t->max_block_error, fresh ? 0 : r.detectable_block_bias);
	t->seconds += r.cpu_seconds;
	t->mutations += r.proposals;
}

static void check_all_mutations(const struct world *w, const char *scene, unsigned k, struct tally *t)
{
	char text[32];
	struct stationary_starts starts = {.indices = NULL};
	check_mutation(w, scene, k, "hslt@b0", false, &starts, t);
	for (unsigned b = 1; b <= k; b++)
		for (unsigned c = 0; c < b; c++) {
			if (b == k && c + 1 == k)
				continue;
			snprintf(text, sizeof text, "hslt@b%uc%u", b, c);
			check_mutation(w, scene, k, text, false, &starts, t);
		}
	for (size_t i = 0; mutation_registry[i]; i++)
		check_mutation(w, scene, k, mutation_registry[i]->name, false, &starts, t);
	stationary_starts_fini(&starts);
}

static void check_listed_mutations(const struct world *w, const char *scene, const struct length_cases *f,
				   struct tally *t)
{
	char list[256], *rest = list, *one;
	struct stationary_starts starts = {.indices = NULL};
	snprintf(list, sizeof list, "%s", f->mutations);
	while ((one = strtok_r(rest, " ", &rest)))
		check_mutation(w, scene, f->edges, one, true, &starts, t);
	stationary_starts_fini(&starts);
}

static void mutations_keep_the_distribution_of_paths(void **state)
{
	const struct scene_cases *s = *state;
	const char *only = getenv("SCENE");
	if (only && strcmp(only, s->scene) != 0)
		skip();
	struct world *w = make_test_world(s->scene);
	struct tally t = {0};
	assert_non_null(w);
	stationary_disable_roulette(w);
	if (test_is_full()) {
		for (unsigned k = 2; k <= 6; k += k < 4 ? 1 : 2)
			check_all_mutations(w, s->scene, k, &t);
		if (strcmp(s->scene, "rough glass") == 0 || strcmp(s->scene, "specular chain") == 0)
			check_all_mutations(w, s->scene, 8, &t);
	} else {
		for (const struct length_cases *f = s->lengths; f->mutations; f++)
			check_listed_mutations(w, s->scene, f, &t);
	}
	printf("%s: %u cases, %u failed, %llu mutations, finds %.2f %% on a quarter of the film, %.0f s of CPU time\n",
	       s->scene, t.cases, t.failed, (unsigned long long)t.mutations, 100 * t.max_block_error, t.seconds);
	fflush(stdout);
	world_free(w);
	assert_int_equal(t.failed, 0);
}

/* Planted faults in the acceptance probability must be found. */
static void planted_acceptance_faults_are_found(void **state)
{
	(void)state;
	static const struct {
		enum stationary_fault fault;
		const char *mutation, *what;
	} planted[] = {
		{STATIONARY_NO_TRANSFER, "hslt@b4c0", "the transfer matrix left out"},
		{STATIONARY_NO_TRANSFER, "hslt@b3c1", "the transfer matrix left out"},
		{STATIONARY_NO_DENSITY, "hslt@b4c0", "densities of steps left out"},
		{STATIONARY_NO_DENSITY, "hslt@b4c2", "densities of steps left out"},
		{STATIONARY_NO_GEOMETRY, "hslt@b1c0", "the geometry term at x_b left out"},
		{STATIONARY_NO_GEOMETRY, "hslt@b2c1", "the geometry term at x_b left out"},
	};
	static struct stationary_result r;
	struct world *w = make_test_world("rough glass");
	struct stationary_starts starts = {.indices = NULL};
	stationary_disable_roulette(w);
	for (size_t i = 0; i < sizeof planted / sizeof *planted; i++) {
		struct stationary_options options = {planted[i].mutation, 4, 4, STARTS, BOOTSTRAP, planted[i].fault};
		stationary_run_with_starts(w, "planted", &options, &starts, &r);
		printf("%s, %s: p %.1g by the %s\n", planted[i].what, options.mutation, r.p,
		       stationary_function_name(r.worst_function));
		assert_true(test_is_scaled() || !stationary_passes(&r));
	}
	stationary_starts_fini(&starts);
	world_free(w);
}

int main(void)
{
	struct CMUnitTest tests[SCENES + 1];
	static struct scene_cases at[SCENES];
	for (int i = 0; i < SCENES; i++) {
		at[i] = scene_list[i];
		tests[i] =
			(struct CMUnitTest){at[i].scene, mutations_keep_the_distribution_of_paths, NULL, NULL, &at[i]};
	}
	tests[SCENES] = (struct CMUnitTest)cmocka_unit_test(planted_acceptance_faults_are_found);
	return cmocka_run_group_tests_name("forced", tests, NULL, NULL);
}
