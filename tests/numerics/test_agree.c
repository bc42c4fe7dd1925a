/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numerically hard scenes by four integrators that reach the same light in different ways: an error in one of them is
 * seldom shared by the others. One row each: bdpt, pssmlt and hslt against path, 2 x 2 blocks and the mean, at the
 * level of tests/support/agreement.h. The row states the smallest bias that is found with 95 % probability: at most 2 %
 * of the mean for the table (HSLT_TEST_ROWS=1) unless the case says otherwise, and a third of that with FULL=1, which
 * takes 16 times the samples. A plain run takes a sixty-fourth of the samples and finds only gross errors.
 */
#include "worker/render/render.h"
#include "tests/numerics/rows.h"
#include "tests/support/agreement.h"
#include "tests/support/agreement_scenes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <math.h>

#include <cmocka.h>

static struct rows rows;

/* Scales a case's number of samples, and the least bias that must be found. */
static uint64_t scaled_samples(uint64_t spp)
{
	uint64_t n = test_is_full() ? 64 * spp : getenv("HSLT_TEST_ROWS") ? 4 * spp : spp / 16;
	return n < 32 ? 32 : n;
}

static bool is_table_run(void)
{
	return getenv("HSLT_TEST_ROWS") || test_is_full();
}

/* Runs for the table have as many groups as possible, because t needs less with more degrees of freedom; and enough
 * independent paths that b, which scales the whole image of chains, is known to about a fifth of a percent. */
static void render_case(const struct agreement_case *k, const char *name, const char *integrator, uint64_t spp,
			struct world *w, struct agreement_image *out)
{
	struct agreement_options side = {integrator, scaled_samples(spp), is_table_run() ? AGREEMENT_GROUPS_MAX : 16, 1,
					 k->max_depth};
	uint64_t paths = 32 * k->spp > 1 << 14 ? 32 * k->spp : 1 << 14;
	if (is_table_run())
		agreement_render_with_mutations(w, name, integrator, &side, test_is_full() ? 16 * paths : paths, NULL,
						out);
	else
		agreement_render(w, name, integrator, &side, out);
}

static double required_detectable_bias(const struct agreement_case *k)
{
	return test_is_scaled() ? INFINITY
				: k->detectable_bias * (test_is_full()		   ? 0.3
							: getenv("HSLT_TEST_ROWS") ? 1
										   : 50);
}

static void compare_integrator(const struct agreement_case *k, const char *integrator, struct world *w,
			       const struct agreement_image *reference)
{
	static struct agreement_image other;
	struct agreement_difference d;
	char name[128], measured[300], bound[80];
	snprintf(name, sizeof name, "%s, %s", k->name, integrator);
	render_case(k, name, integrator, k->spp, w, &other);
	agreement_measure(&other, reference, &d);
	snprintf(measured, sizeof measured,
		 "differs from path by %+.2f %% +- %.2f %%; finds %.1f %% of the mean, %.1f %% of a block",
		 100 * d.mean, 100 * d.error, 100 * d.detectable_bias, 100 * d.detectable_block_bias);
	snprintf(bound, sizeof bound, "the same image; finds %.2g %% of the mean", 100 * required_detectable_bias(k));
	rows_add(&rows, k->topic, name, measured, bound, d.agrees && d.detectable_bias <= required_detectable_bias(k));
}

static void run_case(const struct agreement_case *k)
{
	static struct agreement_image reference;
	const char *only = getenv("CASE");
	if (only && !strstr(k->topic, only) && !strstr(k->name, only))
		return;
	struct world *w = k->build(k);
	render_case(k, k->name, "path", k->path_spp, w, &reference);
	for (size_t i = 0; i < sizeof k->integrators / sizeof *k->integrators && k->integrators[i]; i++)
		compare_integrator(k, k->integrators[i], w, &reference);
	world_free(w);
}

static void test_agree(void **state)
{
	(void)state;
	for (const struct agreement_case *k = agreement_cases; k->topic; k++)
		run_case(k);
	printf("integrators on hard scenes: %u comparisons, %u failed\n", rows.cases, rows.failed);
	assert_int_equal(rows.failed, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_agree)};
	return cmocka_run_group_tests_name("integrators on hard scenes", tests, NULL, NULL);
}
