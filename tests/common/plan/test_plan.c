/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What plan_make decides: how long rounds, bootstrap, leases and epochs are, for jobs that end by samples, time or
 * error and with the measurements of a pilot; how seeds are drawn; which numbers are refused. Texts of plans are in
 * test_plan_text.c, mixtures of mutations in test_plan_mixture.c.
 */
#include "common/plan/plan.h"
#include "common/plan/plan_text.h"
#include "common/plan/resample.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static struct plan_request make_request(enum plan_kind kind, const char *mixture)
{
	struct plan_request r = {
		.integrator = "hslt", .kind = kind, .width = 64, .height = 32, .max_depth = 8, .spp = 16};
	strncpy(r.mixture, mixture, sizeof r.mixture - 1);
	return r;
}

/* A round has 32 mutations per pixel of the crop, but no lease has more than 2^18 or fewer than 2^13; a limit on
 * mutations has its own rule. */
static void unbounded_rounds_follow_the_film_size(void **state)
{
	(void)state;
	static const struct {
		uint32_t width, height;
		uint64_t lease;
	} cases[] = {{8, 8, 1 << 13},	  {128, 128, 1 << 13},	{256, 256, 1 << 15},
		     {512, 512, 1 << 17}, {1024, 512, 1 << 18}, {4096, 4096, 1 << 18}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		for (int by_time = 0; by_time < 2; by_time++) {
			struct plan_request r = make_request(PLAN_CHAINS, "");
			struct plan p;
			struct error e;
			r.width = cases[i].width;
			r.height = cases[i].height;
			r.spp = 0;
			r.seconds = by_time ? 5 : 0;
			r.target_error = by_time ? 0 : 0.02;
			assert_int_equal(plan_make(&r, &p, &e), 0);
			assert_int_equal(plan_round_mutations(&p), cases[i].lease * p.groups * p.parts);
			assert_true(p.rounds == UINT64_MAX);
			r.spp = 16;
			assert_int_equal(plan_make(&r, &p, &e), 0);
			assert_true(p.rounds <= 64 &&
				    p.rounds * plan_round_mutations(&p) >= 16 * (uint64_t)r.width * r.height);
		}
}

static struct plan make_plan(const struct plan_request *r)
{
	struct plan p;
	struct error e = {""};
	if (plan_make(r, &p, &e))
		fail_msg("%s", e.text);
	return p;
}

static bool epoch_text_has(const struct plan_request *r, const char *words)
{
	struct plan p = make_plan(r);
	char text[PLAN_TEXT_MAX];
	plan_describe_epoch(r, &p, text, sizeof text);
	return *words ? strstr(text, words) != NULL : !*text;
}

static uint64_t round_mutations(struct plan p)
{
	return plan_round_mutations(&p);
}

static uint64_t lease_work(const struct plan *p)
{
	return plan_round_mutations(p) / (p->groups * p->parts);
}

/* Limits are checked after rounds: a job with a time limit or a target error only needs rounds short enough for the
 * check to be in time, and the shorter, the less it asks for. */
static void rounds_of_samples_are_short_enough_for_their_limit(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_SAMPLES, "");
	r.width = 32;
	r.height = 27;
	r.spp = 0;
	r.seconds = 1e6;
	uint64_t longest = make_plan(&r).epoch;
	assert_true(epoch_text_has(&r, "size of the film"));
	uint64_t before = 0;
	for (double seconds = 0.1; seconds < 1e5; seconds *= 1.7) {
		r.seconds = seconds;
		uint64_t epoch = make_plan(&r).epoch, round = epoch * 16 * 32 * 27;
		assert_true(epoch >= before && epoch <= longest);
		assert_true(epoch == 1 || (double)round <= 50000 * seconds / 8);
		before = epoch;
	}
	assert_int_equal(before, longest);
	r.seconds = 20;
	assert_true(make_plan(&r).epoch > 1 && epoch_text_has(&r, "for the requested time or error"));
	r.seconds = 0;
	r.target_error = 0.5;
	assert_int_equal(make_plan(&r).epoch, 1);
	r.target_error = 0.02; /* 2,500 samples per pixel in 8 rounds of 16 groups */
	assert_int_equal(make_plan(&r).epoch, 19);
	r.seconds = 1; /* the limit that is met first decides */
	assert_int_equal(make_plan(&r).epoch, 1);
	r.spp = 1 << 20; /* a number of samples that does not fit into the time changes nothing */
	assert_int_equal(make_plan(&r).epoch, 1);
	r.seconds = 1e6; /* a number that does fit has its own rule, whatever error is asked for */
	assert_true(make_plan(&r).epoch > 400 && epoch_text_has(&r, "in a lease"));
}

/* With chains: a round is as long as without the number of samples, or as an eighth of the time allows. */
static void time_limit_also_bounds_rounds_of_counted_samples(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS, "");
	r.spp = 0;
	r.seconds = 2;
	uint64_t open = round_mutations(make_plan(&r));
	r.spp = 1 << 20;
	assert_int_equal(round_mutations(make_plan(&r)), open);
	assert_true(epoch_text_has(&r, "size of the film"));
	r.seconds = 2000;
	uint64_t longer = round_mutations(make_plan(&r));
	assert_true(longer > open && (double)longer <= 50000.0 * r.seconds / 8);
	assert_true(epoch_text_has(&r, "requested time"));
	r.seconds = 1e6;
	assert_true(epoch_text_has(&r, "in a lease"));
	r.spp = 16;
	assert_true(epoch_text_has(&r, "for 8 rounds"));
}

/* The bootstrap of a short render takes only a part of its time. */
static void bootstrap_shrinks_with_the_time_limit(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS, "");
	r.spp = 0;
	r.seconds = 5;
	assert_int_equal(make_plan(&r).bootstrap, 31296); /* 5 x 50,000 / 8, rounded to equal leases */
	r.seconds = 0.1;
	assert_int_equal(make_plan(&r).bootstrap, 16384);
	r.seconds = 3600;
	assert_int_equal(make_plan(&r).bootstrap, 1000000);
	r.seconds = 0;
	r.target_error = 0.02;
	assert_int_equal(make_plan(&r).bootstrap, 1000000);
	r.spp = 1 << 20;
	r.seconds = 5;
	assert_int_equal(make_plan(&r).bootstrap, 31296);
}

/* The plan for a scene whose samples take many rays. */
static struct plan make_slow_plan(enum plan_kind kind, double seconds, double bootstrap_rays, double step_rays)
{
	struct plan_request r = make_request(kind, "");
	r.width = 64;
	r.height = 64;
	r.spp = 0;
	r.seconds = seconds;
	r.target_error = seconds > 0 ? 0 : 0.02;
	r.rays = (struct plan_rays){bootstrap_rays, step_rays};
	return make_plan(&r);
}

/* At two million rays a second: a quarter of the time for the bootstrap and an eighth for the starts of chains, but at
 * least the minimum of both. Plans of usual scenes are unchanged. */
static void slow_bootstrap_has_fewer_samples(void **state)
{
	(void)state;
	for (double rays = 1; rays < 1e6; rays *= 1.9)
		for (double seconds = 0.25; seconds < 1e5; seconds *= 2.3) {
			struct plan p = make_slow_plan(PLAN_CHAINS, seconds, rays, 1),
				    usual = make_slow_plan(PLAN_CHAINS, seconds, 0, 0);
			double room = 2e6 * seconds / rays;
			assert_true((double)p.bootstrap <= fmax(256, room / 4 + p.groups * p.parts));
			assert_true((double)p.chains <= fmax(16, room / 8));
			assert_true(p.bootstrap >= 256 && p.chains >= 16);
			assert_true(p.bootstrap <= usual.bootstrap && p.chains <= usual.chains);
			assert_true(room / 4 < (double)usual.bootstrap || p.bootstrap == usual.bootstrap);
			assert_true(room / 8 < (double)usual.chains || p.chains == usual.chains);
			struct plan samples = make_slow_plan(PLAN_SAMPLES, seconds, rays, 1);
			assert_true((double)samples.bootstrap <= fmax(256, room / 4 + 64) && samples.bootstrap >= 256);
		}
	assert_int_equal(make_slow_plan(PLAN_CHAINS, 0, 1e4, 1).bootstrap, 64 * 4000); /* 20 s per lease */
	assert_int_equal(make_slow_plan(PLAN_CHAINS, 0, 1, 1).bootstrap, 1000000);
	struct plan_request r = make_request(PLAN_CHAINS, "");
	r.seconds = 2;
	r.rays = (struct plan_rays){1e5, 1};
	r.bootstrap = 64000; /* values that were asked for stay */
	r.chains = 512;
	assert_int_equal(make_plan(&r).bootstrap, 64000);
	assert_int_equal(make_plan(&r).chains, 512);
	assert_int_equal(plan_affordable_bootstrap(&r, 100), 2000);
	assert_int_equal(plan_affordable_bootstrap(&r, 1), 256);
}

/* Rounds of chains shorten in proportion to the rays of a mutation, eight of which are usual; rounds of samples are
 * limited by the time. */
static void rounds_shrink_with_the_rays_of_a_mutation(void **state)
{
	(void)state;
	uint64_t usual = round_mutations(make_slow_plan(PLAN_CHAINS, 2, 1, 8));
	assert_int_equal(usual, round_mutations(make_slow_plan(PLAN_CHAINS, 2, 0, 0)));
	for (double rays = 8; rays < 2000; rays *= 1.7) {
		struct plan p = make_slow_plan(PLAN_CHAINS, 2, 1, rays);
		double round = (double)plan_round_mutations(&p);
		assert_true(round * rays <= 8 * (double)usual && (round + p.chains) * rays > 8 * (double)usual);
	}
	uint64_t many = make_slow_plan(PLAN_SAMPLES, 1000, 1, 8).epoch;
	assert_true(many >= 80);
	assert_int_equal(make_slow_plan(PLAN_SAMPLES, 1000, 1, 80).epoch, many / 10);
}

/* If two threads cannot compute a round of sixteen samples per pixel within the time limit, the round has fewer groups
 * and as many leases. */
static void slow_round_has_fewer_groups(void **state)
{
	(void)state;
	struct plan usual = make_slow_plan(PLAN_SAMPLES, 2, 1, 10), p = make_slow_plan(PLAN_SAMPLES, 2, 1, 200);
	assert_int_equal(usual.groups, 16);
	assert_int_equal(usual.parts, 4);
	assert_int_equal(p.groups, 9); /* 40,000 samples, 4,096 pixels */
	assert_int_equal(p.parts, 7);
	assert_int_equal(make_slow_plan(PLAN_SAMPLES, 2, 1, 1e5).groups, 4);
	assert_int_equal(make_slow_plan(PLAN_SAMPLES, 2, 1, 1e5).parts, 16);
	assert_int_equal(make_slow_plan(PLAN_SAMPLES, 0, 1, 1e5).groups, 16);
	assert_int_equal(make_slow_plan(PLAN_CHAINS, 2, 1, 1e5).groups, 16);
	struct plan_request r = make_request(PLAN_SAMPLES, "");
	char text[PLAN_TEXT_MAX];
	r.spp = 0;
	r.seconds = 2;
	r.rays = (struct plan_rays){1, 1e5};
	p = make_plan(&r);
	plan_print_options(&p, 1, text, sizeof text);
	assert_non_null(strstr(text, " --groups 4 --parts 16 "));
	r.groups = 12;
	assert_int_equal(make_plan(&r).groups, 12);
	assert_int_equal(make_plan(&r).parts, 4);
}

/* Rays are counted only where a time limit or a target error ends the job and the plan leaves something to be decided.
 */
static void rays_are_measured_only_where_the_plan_depends_on_them(void **state)
{
	(void)state;
	for (int kind = PLAN_SAMPLES; kind <= PLAN_CHAINS; kind++) {
		struct plan_request r = make_request((enum plan_kind)kind, "");
		assert_false(plan_needs_ray_count(&r));
		r.seconds = 1;
		assert_true(plan_needs_ray_count(&r));
		r.seconds = 0;
		r.target_error = 0.1;
		assert_true(plan_needs_ray_count(&r));
		r.bootstrap = r.epoch = 64;
		assert_int_equal(plan_needs_ray_count(&r), kind == PLAN_CHAINS);
		r.chains = 64;
		assert_false(plan_needs_ray_count(&r));
		r.target_error = 0;
		r.spp = r.bootstrap = 0;
		assert_true(plan_needs_ray_count(&r)); /* those of an estimate */
	}
}

/* More leases for more threads: the same chains, divided finer. Numbers of parts that cannot be had are refused;
 * defaults are not mentioned. */
static void requested_parts_are_used_or_refused(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS, "");
	struct plan p;
	struct error e;
	char text[PLAN_TEXT_MAX];
	r.width = r.height = 1024;
	p = make_plan(&r);
	assert_int_equal(p.parts, 4);
	plan_print_options(&p, 1, text, sizeof text);
	assert_null(strstr(text, "--parts"));
	r.parts = 64;
	p = make_plan(&r);
	assert_int_equal(p.groups * p.parts, 1024);
	assert_int_equal(p.chains, 1024);
	plan_print_options(&p, 1, text, sizeof text);
	assert_non_null(strstr(text, " --groups 16 --parts 64 "));
	r.chains = 1024;
	r.parts = 48;
	assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	r.chains = 0; /* the default number of chains may be larger */
	p = make_plan(&r);
	assert_int_equal(p.chains % (16 * 48), 0);
	r.parts = 65;
	assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	/* A lease with more chains than a message can carry is refused, and the sentence says what to do. */
	r.chains = PLAN_CHAINS_MAX;
	r.parts = 64;
	r.groups = 1;
	assert_int_equal(make_plan(&r).chains, PLAN_CHAINS_MAX);
	r.parts = 32;
	assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	assert_non_null(strstr(e.text, "32768 per lease, of at most 16384: choose more groups or parts"));
	r = make_request(PLAN_SAMPLES, "");
	r.parts = 33;
	assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	r.parts = 32;
	assert_int_equal(make_plan(&r).parts, 32);
	r.parts = 5; /* of 34 rows one part has 7 */
	r.border = 1;
	r.epoch = 3;
	p = make_plan(&r);
	assert_int_equal(plan_lease_mutations(&p), 7 * 66 * 3);
}

/* A pilot's speed limits a lease to about 20 s of one thread, and noise of a tenth in the speed rarely changes the
 * plan. */
static void leases_take_twenty_seconds(void **state)
{
	(void)state;
	for (int kind = PLAN_SAMPLES; kind <= PLAN_CHAINS; kind++)
		for (double speed = 1000; speed < 2e7; speed *= 3.1) {
			struct plan_request r = make_request((enum plan_kind)kind, "");
			r.width = 1280;
			r.height = 720;
			r.spp = 1 << 24;
			struct plan p = make_plan(&r);
			assert_true(plan_needs_speed(&r, &p));
			r.speed = speed;
			p = make_plan(&r);
			double seconds = (double)lease_work(&p) / speed;
			assert_int_equal(plan_lease_mutations(&p), lease_work(&p)); /* 720 rows in 4 parts */
			bool is_min_epoch = p.epoch == 1; /* a strip cannot be divided further */
			assert_true(seconds < 20 * 1.4143 || is_min_epoch);
			assert_true(seconds > 20 / 1.4143 - 1e-9);
			assert_true((p.epoch & (p.epoch - 1)) == 0);
			assert_true(epoch_text_has(&r, "20 s for a thread"));
			assert_false(plan_needs_speed(&r, &p));
		}
	struct plan_request r = make_request(PLAN_CHAINS, "");
	r.width = r.height = 1024;
	r.spp = 1 << 20;
	uint32_t differ = 0;
	for (int i = 0; i < 100; i++) {
		r.speed = 20000 * exp(0.07 * i);
		uint64_t epoch = make_plan(&r).epoch;
		r.speed *= 1.1;
		differ += make_plan(&r).epoch != epoch;
	}
	assert_true(differ > 0 && differ < 25); /* log2 1.1 = 0.14 of all plans */
}

/* Short jobs keep their plan, so that hslt-render and the farm agree without a pilot; so do jobs with --epoch. */
static void short_jobs_ask_for_no_pilot(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS, "");
	r.width = 320;
	r.height = 180;
	struct plan p = make_plan(&r), q;
	assert_false(plan_needs_speed(&r, &p));
	assert_true(epoch_text_has(&r, "for 8 rounds"));
	struct plan_request one = make_request(PLAN_SAMPLES, "");
	assert_int_equal(make_plan(&one).rounds, 1);
	assert_true(epoch_text_has(&one, "for at most 8 rounds"));
	r.speed = 5000;
	q = make_plan(&r);
	assert_memory_equal(&p, &q, sizeof p);
	r.spp = 0;
	r.target_error = 0.02;
	p = make_plan(&r);
	r.speed = 100; /* so slow that the rule by film size no longer applies */
	assert_true(make_plan(&r).epoch < p.epoch);
	r.speed = 1e6;
	assert_int_equal(make_plan(&r).epoch, p.epoch);
	assert_true(epoch_text_has(&r, "size of the film"));
	r.epoch = 77;
	p = make_plan(&r);
	assert_int_equal(p.epoch, 77);
	assert_false(plan_needs_speed(&r, &p));
	assert_true(epoch_text_has(&r, ""));
}

/* 11 MB of tiles per lease: at 0.1 MB/s per thread an epoch lasts 110 s or more; at 10 MB/s it stays at 20 s. */
static void low_bandwidth_lengthens_epochs(void **state)
{
	(void)state;
	for (int kind = PLAN_SAMPLES; kind <= PLAN_CHAINS; kind++) {
		struct plan_request r = make_request((enum plan_kind)kind, "");
		r.width = 1280;
		r.height = 720;
		r.spp = 1 << 20;
		r.speed = kind == PLAN_CHAINS ? 30000 : 300000;
		uint64_t free = make_plan(&r).epoch;
		r.bandwidth = 10e6;
		assert_int_equal(make_plan(&r).epoch, free);
		r.bandwidth = 1e5 / (kind == PLAN_CHAINS ? 1 : 4);
		struct plan p = make_plan(&r);
		double seconds = (double)lease_work(&p) / r.speed;
		assert_true(seconds >= 12 * 1280 * 720 / 1e5 && seconds < 2.2 * 12 * 1280 * 720 / 1e5);
		assert_true(epoch_text_has(&r, "MB of tiles per lease"));
		r.spp = 32; /* not longer than the job */
		assert_true(make_plan(&r).rounds == 1);
		r.speed = 0; /* the speed is unknown: a default is assumed */
		r.spp = 1 << 20;
		uint64_t assumed = make_plan(&r).epoch;
		r.bandwidth = 0;
		assert_true(make_plan(&r).epoch < assumed);
	}
}

/* Systematic resampling by hand: with 4 seeds and a total of 4, the marks are at u, 1 + u, 2 + u and 3 + u. */
static void seeds_are_resampled_systematically(void **state)
{
	(void)state;
	struct plan p = {.groups = 2, .parts = 1, .bootstrap = 8};
	static const float rare[4] = {0, 1, 0, 3}, even[4] = {1, 1, 1, 1};
	static const struct {
		const float *weight;
		double u;
		uint64_t index[4];
	} cases[] = {
		{rare, 0.5, {5, 7, 7, 7}}, {rare, 0, {5, 7, 7, 7}}, {even, 0, {4, 5, 6, 7}}, {even, 0.9, {4, 5, 6, 7}}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		uint64_t index[4];
		assert_true(plan_resample(&p, 1, cases[i].weight, 4, cases[i].u, 4, index));
		assert_memory_equal(index, cases[i].index, sizeof index);
	}
	uint64_t two[2];
	assert_true(plan_resample(&p, 0, even, 4, 0.6, 2, two)); /* marks at 1.2 and 3.2 of 4 */
	assert_true(two[0] == 1 && two[1] == 3);
}

static void smallest_bound_counts_in_whole_rounds(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS, "");
	struct plan p;
	struct error e;
	r.chains = 16;
	r.epoch = 10;
	r.spp = 0;
	for (uint64_t n = 159; n <= 161; n++) {
		r.mutations = n;
		assert_int_equal(plan_make(&r, &p, &e), 0);
		assert_int_equal(p.chains, 16);
		assert_int_equal(p.rounds, n <= 160 ? 1 : 2);
	}
	r.spp = 1; /* 2048 samples: 13 rounds of 160 */
	r.mutations = 1u << 20;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	assert_int_equal(p.rounds, 13);
	r.mutations = 1000;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	assert_int_equal(p.rounds, 7);
}

static void contradictory_plans_are_refused(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_SAMPLES, "");
	struct plan p, q;
	struct error e;
	r.border = 3;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	assert_int_equal(plan_round_mutations(&p), p.groups * p.epoch * (64 + 6) * (32 + 6));
	q = p;
	q.bootstrap++;
	assert_int_equal(plan_check(&q, &e), -EINVAL);
	q = p;
	q.min_depth = q.max_depth; /* paths of one length */
	assert_int_equal(plan_check(&q, &e), 0);
	q.min_depth++;
	assert_int_equal(plan_check(&q, &e), -EINVAL);
}

static void unseen_light_is_interpolated_and_checked(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_SAMPLES, "");
	struct plan p;
	struct error e;
	for (int i = 0; i < PLAN_UNSEEN_COUNT; i++)
		r.unseen.mean_squares[i] = PLAN_UNSEEN_COUNT - 1 - i;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	assert_true(plan_unseen_mean_square(&p, 1) == 11 && plan_unseen_mean_square(&p, 0.25) == 11);
	assert_true(plan_unseen_mean_square(&p, 64) == 8 && plan_unseen_mean_square(&p, 128) == 7.5);
	assert_true(plan_unseen_mean_square(&p, 0x1p22) == 0 && plan_unseen_mean_square(&p, 0x1p60) == 0);
	const double bad[] = {-1e-9, NAN, INFINITY};
	for (int i = 0; i < 3; i++) {
		r.unseen.mean_squares[5] = bad[i];
		assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(unbounded_rounds_follow_the_film_size),
		cmocka_unit_test(rounds_of_samples_are_short_enough_for_their_limit),
		cmocka_unit_test(time_limit_also_bounds_rounds_of_counted_samples),
		cmocka_unit_test(bootstrap_shrinks_with_the_time_limit),
		cmocka_unit_test(slow_bootstrap_has_fewer_samples),
		cmocka_unit_test(rounds_shrink_with_the_rays_of_a_mutation),
		cmocka_unit_test(slow_round_has_fewer_groups),
		cmocka_unit_test(rays_are_measured_only_where_the_plan_depends_on_them),
		cmocka_unit_test(requested_parts_are_used_or_refused),
		cmocka_unit_test(leases_take_twenty_seconds),
		cmocka_unit_test(short_jobs_ask_for_no_pilot),
		cmocka_unit_test(low_bandwidth_lengthens_epochs),
		cmocka_unit_test(seeds_are_resampled_systematically),
		cmocka_unit_test(smallest_bound_counts_in_whole_rounds),
		cmocka_unit_test(contradictory_plans_are_refused),
		cmocka_unit_test(unseen_light_is_interpolated_and_checked),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
