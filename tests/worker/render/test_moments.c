/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Results of leases other than pixels. Classes of paths: every technique that makes a path gives it the same class;
 * path, bdpt, and the chains of pssmlt and hslt find the same energy in each class. Moments: the sums of a tile equal
 * those of the film.
 *
 * Level of the comparisons: 1e-6 for each class that holds 1 % of the energy or more, by Student's t between 16
 * groups. Power: the smallest difference that is found with 95 % probability, among classes that hold 10 % or more,
 * is printed; it must be at most 15 % between path and bdpt, 25 % for chains. HSLT_TEST_SCALE: smaller samples, no
 * requirement on the power. FULL=1: also chains in a prism. About 30 s of CPU time.
 */
#include "common/estimate/merge.h"
#include "tests/support/dice.h"
#include "tests/support/leases.h"
#include "tests/support/test_length.h"
#include "tests/support/rooms.h"
#include "tests/support/starts.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/render.h"
#include "worker/render/path/classes.h"
#include "worker/render/path/ensemble.h"
#include "worker/render/path/integrator.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define LEVEL 1e-6
enum { GROUPS = 16 };
/* t at level 1e-6 with 15 degrees of freedom, plus the 95 % quantile for the power. */
#define DETECTABLE_T 9.4

/* ---- one path, many techniques ---- */

static bool same_place(const struct path_vertex *a, const struct path_vertex *b)
{
	return a->x.p.x == b->x.p.x && a->x.p.y == b->x.p.y && a->x.p.z == b->x.p.z;
}

/* Returns whether technique s, from the sub-paths in c, makes x. */
static bool is_made_by_technique(const struct path_context *c, const struct full_path *x, unsigned s)
{
	unsigned k = x->edges;
	for (unsigned i = 0; s >= 2 && i < s; i++)
		if (!same_place(&c->light[i], &x->v[i]))
			return false;
	for (unsigned i = 0; i < k + 1 - s; i++)
		if (!(s == 1 && i == k) && !same_place(&c->camera[i], &x->v[k - i]))
			return false;
	return true;
}

struct seen {
	uint64_t paths, agreements;
	uint32_t techniques, classes; /* as bits */
};

/* x was made by technique `from`. Draws a pair of sub-paths around x, and compares the class with that found by each
 * other technique that makes x. */
static void check_around(struct path_context *c, struct full_path *x, unsigned from, uint64_t index, struct dice *d,
			 struct seen *seen)
{
	static struct ensemble around;
	struct sampler_random s;
	const double u[3] = {dice_uniform(d), 0, 0};
	unsigned class = full_path_class(x);
	sampler_random_init(&s, 17, RNG_CHAIN, index, 1);
	for (unsigned i = 0; i <= x->edges; i++) { /* clear the vertices of other paths */
		memset(&c->camera[i].x.p, 0, sizeof c->camera[i].x.p);
		memset(&c->light[i].x.p, 0, sizeof c->light[i].x.p);
	}
	ensemble_draw_containing(c, &s.base, x, u, &around);
	static struct path_classes classes;
	static struct path_sample unused;
	for (uint32_t i = 0; i < around.count; i++) {
		const struct candidate *a = &around.candidates[i];
		unsigned passed = a->s > 0 ? full_path_passed_count(c, x, a->s) : 0;
		if (a->edges != x->edges || a->passed_count != passed || a->s == from ||
		    !is_made_by_technique(c, x, a->s))
			continue;
		path_classes_begin(&classes, c, x->edges + 1 - a->s, a->s, &unused);
		assert_int_equal(
			path_classes_of_joint(&classes, a->s, x->edges + 1 - a->s - a->passed_count, a->passed_count),
			class);
		seen->agreements++;
		seen->techniques |= 1u << (a->s < 31 ? a->s : 31);
	}
}

static void check_techniques(const struct world *w, const char *name)
{
	static struct path_context c;
	static struct ensemble e;
	static struct path_sample sample, unused;
	static struct path_classes classes;
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct dice d = dice_for_test(name);
	struct seen seen = {0, 0, 0, 0};
	starts_init_context(&c, w, 1, STARTS_EDGES_MAX, counters);
	const struct ensemble_lengths all = ensemble_max_lengths(&c);
	for (uint64_t index = 0; index < dice_scaled_count(3000); index++) {
		struct sampler_random s;
		struct full_path x;
		sampler_random_init(&s, stats_seed(name), RNG_BOOTSTRAP, index, 0);
		path_trace_bidirectional(&c, &s.base, &sample);
		double by_class[PATH_CLASSES] = {0}, sum = 0;
		for (unsigned k = 0; k < PATH_CLASSES; k++)
			sum += sample.class_mask >> k & 1 ? sample.class_intensity[k] : 0;
		assert_true(fabs(sum - sample.intensity) <= 1e-12 * sum);
		sampler_random_init(&s, stats_seed(name), RNG_BOOTSTRAP, index, 0);
		ensemble_draw(&c, &s.base, &all, &e);
		unsigned camera = 1, light = 0;
		for (uint32_t i = 0; i < e.count; i++) {
			unsigned t = e.candidates[i].edges + 1 - e.candidates[i].s - e.candidates[i].passed_count;
			camera = t > camera ? t : camera;
			light = e.candidates[i].s > light ? e.candidates[i].s : light;
		}
		path_classes_begin(&classes, &c, camera, light > 1 ? light : 0, &unused);
		for (uint32_t i = 0; i < e.count; i++) {
			const struct candidate *a = &e.candidates[i];
			unsigned class = path_classes_of_joint(&classes, a->s, a->edges + 1 - a->s - a->passed_count,
							       a->passed_count);
			by_class[class] += a->intensity;
			if (!full_path_from_subpaths(&c, a->s, a->passed_count, a->edges, &x))
				continue; /* on the very border of the film */
			assert_int_equal(full_path_class(&x), class);
			seen.paths++;
			seen.classes |= 1u << class;
		}
		for (unsigned k = 0; k < PATH_CLASSES; k++)
			assert_true(fabs(by_class[k] - (sample.class_mask >> k & 1 ? sample.class_intensity[k] : 0)) <=
				    1e-12 * sum);
		if (e.count > 0) {
			const struct candidate *a = &e.candidates[dice_below(&d, e.count)];
			if (full_path_from_subpaths(&c, a->s, a->passed_count, a->edges, &x))
				check_around(&c, &x, a->s, index, &d, &seen);
		}
	}
	print_message("%s: %llu paths, %llu by another technique, techniques %#x, classes %#x\n", name,
		      (unsigned long long)seen.paths, (unsigned long long)seen.agreements, seen.techniques,
		      seen.classes);
	assert_true(seen.agreements > dice_scaled_count(100));
}

static void techniques_give_a_path_one_class(void **state)
{
	(void)state;
	for (const struct room *r = rooms; r->name; r++) {
		struct world *w = r->build();
		check_techniques(w, r->name);
		world_free(w);
	}
}

/* ---- energies ---- */

static struct plan make_plan(const struct world *w, const char *integrator, const char *test)
{
	const struct scene_settings *s = &w->settings;
	struct render_summary summary;
	struct plan p = {.width = s->width,
			 .height = s->height,
			 .crop_width = s->width,
			 .crop_height = s->height,
			 .border = s->border,
			 .seed = stats_seed(test),
			 .groups = GROUPS,
			 .parts = 1,
			 .bootstrap = GROUPS * dice_scaled_count(6144),
			 .epoch = 1,
			 .rounds = 1,
			 .min_depth = 1,
			 .max_depth = 10};
	snprintf(p.integrator, sizeof p.integrator, "%s", integrator);
	p.kind = render_integrator_find(integrator)->kind;
	world_summary(w, &summary);
	if (render_integrator_find(integrator)->has_mutations)
		assert_int_equal(render_canonical_mutations(NULL, &summary, p.mutations, NULL), 0);
	return p;
}

/* Stores the means of each class by group, from independent samples. */
static void sample_classes(const struct world *w, const char *integrator, const char *test,
			   double mean[PATH_CLASSES][GROUPS])
{
	struct plan p = make_plan(w, integrator, test);
	for (uint32_t g = 0; g < GROUPS; g++) {
		struct batch b = leases_run(w, &p, (struct lease_key){1, LEASE_BOOTSTRAP, g, 0, 0}, NULL);
		double sum = 0;
		for (int k = 0; k < PATH_CLASSES; k++) {
			mean[k][g] = b.classes[k] / (double)b.weight_count;
			sum += b.classes[k];
		}
		assert_true(fabs(sum - b.independent_sum) <= 1e-9 * sum);
		batch_fini(&b);
	}
}

static void check_class(const char *test, unsigned class, double share, double difference_error, double p,
			double *min_difference)
{
	/* For classes that independent samples rarely find, the means are far from normally distributed. */
	if (share >= 0.01 && p < LEVEL)
		fail_msg("%s: the energies of class '%s', share %.3g, differ (p = %g)", test, path_class_name(class),
			 share, p);
	if (share >= 0.1)
		*min_difference = fmax(*min_difference, DETECTABLE_T * difference_error);
}

static void assert_detectable_difference(const char *test, double min_difference, double max_difference)
{
	print_message("%s: finds a class that differs by %.1f %%\n", test, 100 * min_difference);
	assert_true(dice_scaled_count(1000) < 1000 || (min_difference > 0 && min_difference < max_difference));
}

static void integrators_of_samples_agree_on_class_energies(void **state)
{
	(void)state;
	static const char *const of[] = {"glass", "mirror", "prism"};
	for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
		static double a[PATH_CLASSES][GROUPS], b[PATH_CLASSES][GROUPS];
		char test[64];
		struct world *w = room_build_named(of[i]);
		double all = 0, min_difference = 0;
		snprintf(test, sizeof test, "%s, path and bdpt", of[i]);
		sample_classes(w, "path", of[i], a);
		sample_classes(w, "bdpt", test, b);
		for (int k = 0; k < PATH_CLASSES; k++)
			all += stats_mean_test(b[k], GROUPS, 0).mean;
		for (unsigned k = 0; k < PATH_CLASSES; k++) {
			double d[GROUPS], mean = stats_mean_test(b[k], GROUPS, 0).mean;
			for (int g = 0; g < GROUPS; g++)
				d[g] = a[k][g] - b[k][g];
			struct stats_mean m = stats_mean_test(d, GROUPS, 0);
			if (mean > 0)
				check_class(test, k, mean / all, m.error / mean, m.p, &min_difference);
		}
		assert_detectable_difference(test, min_difference, 0.15);
		world_free(w);
	}
}

/* Merges all leases of a plan of chains into a canvas. seen: called with each batch of chains. */
static struct canvas *run_chains(const struct world *w, const struct plan *p,
				 void (*seen)(const struct plan *, const struct batch *))
{
	struct bootstrap *s;
	struct canvas *c;
	struct error e = {""};
	uint32_t chains = p->chains / p->groups;
	uint64_t *seeds = calloc(chains, sizeof *seeds);
	assert_int_equal(bootstrap_new(&s, p, &e), 0);
	assert_int_equal(canvas_new(&c, p, -32, NULL, &e), 0);
	for (uint32_t g = 0; g < p->groups; g++) {
		struct batch b = leases_run(w, p, (struct lease_key){1, LEASE_BOOTSTRAP, g, 0, 0}, NULL);
		assert_int_equal(bootstrap_add(s, &b, &e), 0);
		batch_fini(&b);
	}
	bootstrap_add_to_canvas(s, c);
	for (uint32_t g = 0; g < p->groups; g++) {
		struct lease_input in = {.chain_count = chains, .seeds = seeds};
		bootstrap_draw_seeds(s, g, seeds);
		struct batch b = leases_run(w, p, (struct lease_key){1, LEASE_RENDER, g, 0, 0}, &in);
		if (seen)
			seen(p, &b);
		assert_int_equal(canvas_add(c, &b, &e), 0);
		batch_fini(&b);
	}
	bootstrap_free(s);
	free(seeds);
	return c;
}

static void check_chains(const char *room, const char *integrator, uint64_t steps)
{
	char test[64];
	struct world *w = room_build_named(room);
	double all = 0, min_difference = 0;
	snprintf(test, sizeof test, "%s, chains of %s", room, integrator);
	struct plan p = make_plan(w, integrator, test);
	p.chains = GROUPS * 32;
	p.epoch = dice_scaled_count(steps);
	struct canvas *c = run_chains(w, &p, NULL);
	struct canvas_image img;
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	for (int k = 0; k < PATH_CLASSES; k++)
		all += img.classes[k].bootstrap;
	for (unsigned k = 0; k < PATH_CLASSES; k++) {
		const struct path_class_energy *of = &img.classes[k];
		double t = of->difference_t, p_value = isnan(t) ? 1 : stats_student_t_p(t, GROUPS - 1);
		if (of->bootstrap > 0)
			check_class(test, k, of->bootstrap / all,
				    hypot(of->bootstrap_error, of->chains_error) / of->bootstrap, p_value,
				    &min_difference);
	}
	assert_detectable_difference(test, min_difference, 0.25);
	canvas_image_fini(&img);
	canvas_free(c);
	world_free(w);
}

static void chains_agree_on_class_energies(void **state)
{
	(void)state;
	static const char *const of[] = {"glass", "prism"};
	for (size_t i = 0; i < (test_is_full() ? 2 : 1); i++) {
		check_chains(of[i], "pssmlt", 500);
		check_chains(of[i], "hslt", 2500);
	}
}

/* ---- moments against the film ---- */

/* With a box filter of one pixel, the light of a splat lies in its own pixel, so that the sum of a tile equals its
 * first moment. */
static void check_tiles_against_film(const struct plan *p, const struct batch *b)
{
	uint32_t tiles = batch_film_tile_count(p), sequences = batch_sequence_count(p),
		 across = (p->crop_width + TILE_SIZE - 1) / TILE_SIZE, next = 0;
	double time = 0, classes = 0;
	for (uint32_t t = 0; t < tiles; t++) {
		double first = 0, film = 0, second = (double)b->moments[sequences * tiles + t];
		uint32_t x = p->crop_x + t % across * TILE_SIZE, y = p->crop_y + t / across * TILE_SIZE;
		for (uint32_t s = 0; s < sequences; s++)
			first += (double)b->moments[s * tiles + t];
		if (next < b->tile_count && b->tiles[next].x == x && b->tiles[next].y == y) {
			const struct tile *tile = &b->tiles[next++];
			for (uint32_t i = 0; i < tile->width * tile->height * 3; i++)
				film += (double)tile->xyz[i];
		}
		assert_true(fabs(first - film) <= 1e-5 * first);
		assert_true(second <= first * (1 + 1e-6) && (first == 0 || second > 0));
		/* A full path has one film point. */
		assert_true(*p->mutations == 0 || fabs(second - first) <= 1e-6 * first);
		time += first;
	}
	assert_int_equal(next, b->tile_count);
	for (int k = 0; k < PATH_CLASSES; k++)
		classes += b->classes[k];
	assert_true(fabs(classes / (double)b->counters[COUNT_SAMPLES] - 1) < 1e-9);
	assert_true(time > 0.01 * classes && time < 0.99 * classes); /* the crop is a part of the sampled area */
}

static void moments_are_those_of_the_film(void **state)
{
	(void)state;
	static const char *const integrators[] = {"pssmlt", "hslt"};
	/* clang-format off */
	struct world *w = world_from_text(200, 150,
		SENSOR("0,0.2,1.9", "0,-0.3,-1")
		"<shape type='cube'><transform name='to_world'><scale value='2'/></transform></shape>"
		"<shape type='sphere'>"
			"<point name='center' value='0,-0.6,-0.3'/>"
			"<float name='radius' value='0.8'/>"
			"<bsdf type='dielectric'/>"
		"</shape>"
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='1.6'/>"
				"<rotate x='1' angle='90'/>"
				"<translate y='1.9'/>"
			"</transform>"
			"<emitter type='area'/>"
		"</shape>");
	/* clang-format on */
	for (size_t i = 0; i < 2; i++) {
		struct canvas_image img;
		struct plan p = make_plan(w, integrators[i], "moments and film");
		p.crop_x = 21;
		p.crop_y = 10;
		p.crop_width = 130;
		p.crop_height = 100;
		p.border = 25;
		p.chains = GROUPS * 4;
		p.bootstrap = GROUPS * dice_scaled_count(4096);
		p.epoch = dice_scaled_count(2000);
		p.groups = GROUPS;
		struct world moved = *w; /* a border wider than the filter needs, so that chains leave the crop */
		moved.settings.border = p.border;
		struct canvas *c = run_chains(&moved, &p, check_tiles_against_film);
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		float sum = 0;
		for (uint32_t t = 0; t < batch_film_tile_count(&p); t++) {
			print_message("%s: tile %u: R %.3f error %.3f share %.3f\n", integrators[i], t,
				      (double)img.r_hat[t], (double)img.tile_error[t],
				      (double)img.tile_energy_share[t]);
			assert_true(img.r_hat[t] > 0.99f &&
				    img.r_hat[t] < (p.epoch < 2000 ? 2 : 1.2f)); /* short chains have mixed less */
			sum += img.tile_energy_share[t];
		}
		assert_true(fabsf(sum - 1) < 1e-5f);
		canvas_image_fini(&img);
		canvas_free(c);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(techniques_give_a_path_one_class),
		cmocka_unit_test(integrators_of_samples_agree_on_class_energies),
		cmocka_unit_test(chains_agree_on_class_energies),
		cmocka_unit_test(moments_are_those_of_the_film),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
