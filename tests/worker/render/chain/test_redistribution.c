/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Energy redistribution. The image remains that of bdpt, whatever the share of light that chains spread: all of it,
 * or the part above a threshold. Both images are made of the same samples, so that they differ only by the noise of
 * the chains; test_integrators.c shows against `path` that bdpt, and with it erpt, is right. Statistics as in
 * tests/support/agreement.h.
 */
#include "worker/render/chain/redistribution.h"
#include "worker/render/film/sums.h"

#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/path/integrate_bdpt.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 32, GROUPS = 32, MAP_SAMPLES = 1 << 12 };

#define DEPTH "<integrator type='path'><integer name='max_depth' value='6'/></integrator>"
#define AT(inner) "<transform name='to_world'>" inner "</transform>"
/* clang-format off */
#define ROOM                                                                                                                    \
	SENSOR("0,0.2,1.9", "0,-0.3,-1")                                                                                        \
	"<shape type='cube'>" AT("<scale value='2'/>")                                                                          \
	"<bsdf type='diffuse'><rgb name='reflectance' value='0.5,0.45,0.35'/></bsdf></shape>"
#define LAMP(size)                                                                                                              \
	"<shape type='rectangle'>" AT("<scale value='" size "'/><rotate x='1' angle='90'/><translate y='1.9'/>")              \
	"<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>"
#define BALL(center, radius, bsdf)                                                                                              \
	"<shape type='sphere'><point name='center' value='" center "'/><float name='radius' value='" radius "'/>" bsdf "</shape>"
/* clang-format on */
#define GLASS "<bsdf type='dielectric'/>"
#define METAL(alpha) "<bsdf type='roughconductor'><float name='alpha' value='" alpha "'/></bsdf>"

static struct world *room_of_balls(void)
{
	return world_from_text(SIDE, SIDE,
			       DEPTH ROOM LAMP("1.6") BALL("-0.7,-1.2,-0.6", "0.7", GLASS)
				       BALL("0.8,-1.3,0", "0.6", METAL("0.2")));
}

/* Dark regions beside bright ones: light that moved between them in one direction only would be visible at once. */
static struct world *lamp_over_ground(void)
{
	return world_from_text(
		SIDE, SIDE,
		DEPTH SENSOR("0,1.5,5", "0,0,0") "<shape type='rectangle'>" AT(
			"<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1.5'/>") "<bsdf type='diffuse'/></shape>" LAMP("1.6")
			BALL("0.8,0.3,0", "0.6", "<bsdf type='diffuse'/>"));
}

/* A render of samples anywhere on the film. */
struct trial {
	const struct world *w;
	struct plan plan;
	struct path_context context;
	struct path_sample sample;
	struct brightness map;
	struct film_sums film, unspread;
	struct redistribution *redistribution;
	uint64_t counters[BATCH_COUNTERS];
	double intensity; /* of all samples, including the part taken for chains */
	double redistributed, classes[PATH_CLASSES];
};

static void trial_begin(struct trial *t, const struct world *w, const struct redistribution_rule *rule,
			uint32_t light_every, uint64_t seed)
{
	struct error e;
	memset(t, 0, sizeof *t);
	t->w = w;
	t->plan = (struct plan){.width = SIDE, .height = SIDE, .crop_width = SIDE, .crop_height = SIDE};
	t->context = (struct path_context){.w = w,
					   .window = film_window_from_plan(&t->plan),
					   .min_depth = 1,
					   .max_depth = w->settings.max_depth,
					   .max_survival = PATH_SURVIVAL_MAX,
					   .skips_classes = true,
					   .counters = t->counters,
					   .refract = halfvec_refract};
	assert_int_equal(brightness_init_from_samples(&t->map, &t->context, path_trace_bidirectional, seed,
						      RNG_BRIGHTNESS, 0, MAP_SAMPLES, &e),
			 0);
	assert_int_equal(film_sums_init(&t->film, &t->plan, &w->settings, &e), 0);
	assert_int_equal(film_sums_init(&t->unspread, &t->plan, &w->settings, &e), 0);
	memset(t->counters, 0, sizeof t->counters);
	t->context.light_subpath_interval = light_every;
	assert_int_equal(redistribution_new(&t->redistribution, rule, &t->context, &t->map, seed, &t->film.target,
					    t->classes, &e),
			 0);
}

static void trial_end(struct trial *t)
{
	redistribution_free(t->redistribution);
	film_sums_fini(&t->film);
	film_sums_fini(&t->unspread);
	brightness_fini(&t->map);
}

static void evaluate(struct trial *t, uint64_t seed, uint64_t index, struct path_split *split, struct film_sums *film)
{
	struct sampler_random s;
	sampler_random_init(&s, seed, RNG_ERPT, index, 0);
	t->context.split = split;
	path_trace_bidirectional(&t->context, &s.base, &t->sample);
	for (uint32_t k = 0; k < t->sample.splat_count; k++)
		film_sums_splat(film, &t->sample.splats[k], 1.0 / (SIDE * SIDE));
}

static void trial_sample(struct trial *t, uint64_t seed, uint64_t index)
{
	evaluate(t, seed, index, redistribution_begin(t->redistribution, index, 0), &t->film);
	t->intensity += t->sample.intensity + redistribution_taken_intensity(t->redistribution);
	t->redistributed += redistribution_taken_intensity(t->redistribution);
}

/* Evaluates the same sample as bdpt does, and returns its intensity. */
static double trial_sample_unspread(struct trial *t, uint64_t seed, uint64_t index)
{
	evaluate(t, seed, index, NULL, &t->unspread);
	return t->sample.intensity;
}

/* Stores the means of the blocks of the film and of the whole film. */
static void store_block_means(const struct film_sums *f, uint64_t spp, double mean[AGREEMENT_CELLS + 1])
{
	double sum[AGREEMENT_CELLS + 1] = {0};
	for (unsigned y = 0; y < SIDE; y++)
		for (unsigned x = 0; x < SIDE; x++) {
			const double *p = &f->xyz[((size_t)y * SIDE + x) * 3];
			unsigned cell = y * AGREEMENT_BLOCKS / SIDE * AGREEMENT_BLOCKS + x * AGREEMENT_BLOCKS / SIDE;
			sum[cell] += p[0] + p[1] + p[2];
			sum[AGREEMENT_CELLS] += p[0] + p[1] + p[2];
		}
	for (int c = 0; c <= AGREEMENT_CELLS; c++)
		mean[c] = sum[c] / (double)spp / (SIDE * SIDE) * (c < AGREEMENT_CELLS ? AGREEMENT_CELLS : 1);
}

/* Stores for each group and cell 1 + the difference of the two images, divided by bdpt's mean in the cell. Returns
 * the number of mutations per sample. */
static double compare_with_bdpt(const char *test, const struct world *w, const struct redistribution_rule *rule,
				uint32_t light_every, uint64_t spp, struct agreement_image *out)
{
	static struct trial t;
	double mutations = 0, unspread[GROUPS][AGREEMENT_CELLS + 1], all[AGREEMENT_CELLS + 1] = {0};
	memset(out, 0, sizeof *out);
	out->groups = GROUPS;
	for (uint32_t g = 0; g < GROUPS; g++) {
		uint64_t seed = stats_seed(test) + g;
		trial_begin(&t, w, rule, light_every, seed);
		for (uint64_t i = 0; i < spp * SIDE * SIDE; i++) {
			trial_sample(&t, seed, i);
			trial_sample_unspread(&t, seed, i);
		}
		store_block_means(&t.film, spp, out->mean[g]);
		store_block_means(&t.unspread, spp, unspread[g]);
		for (int c = 0; c <= AGREEMENT_CELLS; c++)
			all[c] += unspread[g][c] / GROUPS;
		mutations += (double)t.counters[COUNT_REDISTRIBUTION_MUTATIONS] / (double)(spp * SIDE * SIDE * GROUPS);
		trial_end(&t);
	}
	for (uint32_t g = 0; g < GROUPS; g++)
		for (int c = 0; c <= AGREEMENT_CELLS; c++)
			out->mean[g][c] = 1 + (out->mean[g][c] - unspread[g][c]) / all[c];
	return mutations;
}

static void assert_same_image(const char *test, struct world *w, const struct redistribution_rule *rule,
			      uint32_t light_every, uint64_t spp)
{
	static struct agreement_image image;
	assert_true(compare_with_bdpt(test, w, rule, light_every, test_is_scaled() ? spp / 8 : spp, &image) > 1);
	agreement_check_constant(test, &image, 1);
	world_free(w);
}

static void all_light_by_chains_is_the_same_image(void **state)
{
	(void)state;
	const struct redistribution_rule all = {.threshold = 1e-6, .mutations_per_unit = 8, .chain_length = 2};
	assert_same_image(__func__, lamp_over_ground(), &all, 1, 16);
}

static const struct redistribution_rule threshold_rule = {.threshold = 0.5, .mutations_per_unit = 8, .chain_length = 2};

/* Most paths lie near the threshold, where the number of chains varies. */
static void some_light_by_chains_is_the_same_image(void **state)
{
	(void)state;
	assert_same_image(__func__, room_of_balls(), &threshold_rule, 1, 8);
}

/* Contributions that need a light sub-path are weighted by four, so more of them lie above the threshold. */
static void a_light_sub_path_in_one_of_four_samples_is_the_same_image(void **state)
{
	(void)state;
	assert_same_image(__func__, room_of_balls(), &threshold_rule, 4, 12);
}

/* Without roulette, the contribution of a light sub-path to the film is at most T times the brightness at its
 * position, to rounding, however rare light sub-paths are. */
static void no_splat_is_brighter_than_the_threshold(void **state)
{
	(void)state;
	const struct redistribution_rule rule = {.threshold = 0.5, .mutations_per_unit = 1, .chain_length = 1};
	static struct trial t;
	struct world *w = room_of_balls();
	for (uint32_t light_every = 1; light_every <= 4; light_every *= 4) {
		double max_ratio = 0;
		trial_begin(&t, w, &rule, light_every, stats_seed(__func__));
		t.context.max_survival = 0;
		for (uint64_t i = 0; i < 4096; i++) {
			trial_sample(&t, stats_seed(__func__), i);
			for (uint32_t k = 1; k < t.sample.splat_count; k++) {
				const struct splat *s = &t.sample.splats[k];
				max_ratio = fmax(max_ratio, (s->xyz[0] + s->xyz[1] + s->xyz[2]) *
								    brightness_inverse_at(&t.map, s->x, s->y));
			}
		}
		print_message("a light sub-path in one of %u: %.9f\n", light_every, max_ratio);
		assert_true(fabs(max_ratio - 0.5) < 1e-6);
		trial_end(&t);
	}
	world_free(w);
}

/* Chains from a bright path are as long as any others; only their number grows, up to a bound. */
static void chains_of_the_brightest_paths_are_bounded(void **state)
{
	(void)state;
	const struct redistribution_rule endless = {.threshold = 0.5, .mutations_per_unit = 1e12, .chain_length = 3};
	static struct trial t;
	struct world *w = room_of_balls();
	trial_begin(&t, w, &endless, 1, stats_seed(__func__));
	for (uint64_t i = 0; i < 256; i++)
		trial_sample(&t, stats_seed(__func__), i);
	assert_true(t.counters[COUNT_REDISTRIBUTED] > 16);
	assert_int_equal(t.counters[COUNT_REDISTRIBUTION_MUTATIONS],
			 t.counters[COUNT_REDISTRIBUTED] * 3 * REDISTRIBUTION_CHAINS_MAX);
	trial_end(&t);
	world_free(w);
}

/* The sum from which b is estimated is that of bdpt with the same random numbers. The part of it taken for chains is
 * divided into classes, from full paths; no class may have more than in bdpt's samples, where classes are found from
 * sub-paths. */
static void redistribution_keeps_the_sum_of_intensities(void **state)
{
	(void)state;
	const struct redistribution_rule half = {.threshold = 0.1, .mutations_per_unit = 0.1, .chain_length = 2};
	static struct trial t;
	struct world *w = room_of_balls();
	trial_begin(&t, w, &half, 1, stats_seed(__func__));
	t.context.skips_classes = false;
	double whole = 0, of_class[PATH_CLASSES] = {0}, taken = 0;
	uint64_t rays = 0;
	for (uint64_t i = 0; i < 1024; i++) {
		trial_sample(&t, stats_seed(__func__), i);
		rays += batch_ray_count(t.counters);
		whole += trial_sample_unspread(&t, stats_seed(__func__), i);
		for (int k = 0; k < PATH_CLASSES; k++)
			of_class[k] += t.sample.class_intensity[k];
	}
	for (int k = 0; k < PATH_CLASSES; k++) {
		assert_true(t.classes[k] <= of_class[k] * (1 + 1e-9));
		taken += t.classes[k];
	}
	assert_true(taken > 0.5 * whole && fabs(taken - t.redistributed) < 1e-9 * taken);
	assert_true(t.counters[COUNT_REDISTRIBUTION_RAYS] > 100 && t.counters[COUNT_REDISTRIBUTION_RAYS] < rays);
	assert_true(t.counters[COUNT_REDISTRIBUTED] > 100);
	assert_true(fabs(t.intensity - whole) < 1e-9 * whole);
	trial_end(&t);
	world_free(w);
}

/* A lamp in view is the same in all samples, also when seen by way of mirrors and glass, so chains need not spread
 * it. */
static void what_is_seen_directly_is_not_spread(void **state)
{
	(void)state;
	const struct redistribution_rule all = {.threshold = 1e-6, .mutations_per_unit = 1, .chain_length = 1};
	static struct trial t;
	/* clang-format off */
	struct world *w = world_from_text(SIDE, SIDE,
		DEPTH
		SENSOR("0,0,5", "0,0,0")
		"<emitter type='constant'><rgb name='radiance' value='1'/></emitter>"
		BALL("0,0,0", "1", GLASS));
	/* clang-format on */
	trial_begin(&t, w, &all, 1, stats_seed(__func__));
	for (uint64_t i = 0; i < 4096; i++)
		trial_sample(&t, stats_seed(__func__), i);
	assert_true(t.intensity > 0);
	assert_int_equal(t.counters[COUNT_REDISTRIBUTED], 0);
	trial_end(&t);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(all_light_by_chains_is_the_same_image),
		cmocka_unit_test(some_light_by_chains_is_the_same_image),
		cmocka_unit_test(a_light_sub_path_in_one_of_four_samples_is_the_same_image),
		cmocka_unit_test(no_splat_is_brighter_than_the_threshold),
		cmocka_unit_test(chains_of_the_brightest_paths_are_bounded),
		cmocka_unit_test(redistribution_keeps_the_sum_of_intensities),
		cmocka_unit_test(what_is_seen_directly_is_not_spread),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
