/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Groups are independent replicates; otherwise the error estimated from their spread would be wrong (docs/design.md,
 * rules 2). The linker puts a wrapper around the random number generator (Makefile), which records all numbers that a
 * lease asks for: no two groups ask for the same number, each starts its chains from its own part of the bootstrap,
 * and independent proposals that carry no light are counted. Everything is deterministic except the number of
 * pssmlt's independent proposals.
 */
#include "common/estimate/merge.h"
#include "common/plan/resample.h"
#include "tests/support/leases.h"
#include "tests/support/worlds.h"
#include "worker/cli/render/local_run.h"
#include "worker/render/render.h"
#include "worker/render/math/rng.h"
#include "worker/render/mutation/mixture.h"
#include "worker/render/path/sampler.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { GROUPS = 4, PARTS = 2, CHAINS = 16, BOOTSTRAP = 2048, ROUNDS = 2, SPP_EPOCH = 2, EPOCH = 150 };

/* ---- recorded numbers ---- */

struct random_block {
	uint64_t stream, index, step, block, owner;
};

static struct {
	bool is_on;
	uint64_t owner;
	struct random_block *blocks;
	size_t count, capacity;
} recorded;

static void record_block(enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block)
{
	if (!recorded.is_on)
		return;
	if (recorded.count == recorded.capacity) {
		recorded.capacity = recorded.capacity ? 2 * recorded.capacity : 1 << 16;
		recorded.blocks = realloc(recorded.blocks, recorded.capacity * sizeof *recorded.blocks);
		assert_non_null(recorded.blocks);
	}
	recorded.blocks[recorded.count++] = (struct random_block){stream, index, step, block, recorded.owner};
}

void __real_rng_uniform4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block,
			 double out[4]);
void __wrap_rng_uniform4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block,
			 double out[4]);
void __real_rng_bits4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block,
		      uint64_t out[4]);
void __wrap_rng_bits4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block,
		      uint64_t out[4]);

void __wrap_rng_uniform4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block,
			 double out[4])
{
	record_block(stream, index, step, block);
	__real_rng_uniform4(seed, stream, index, step, block, out);
}

void __wrap_rng_bits4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block,
		      uint64_t out[4])
{
	record_block(stream, index, step, block);
	__real_rng_bits4(seed, stream, index, step, block, out);
}

static void set_recording(bool on)
{
	recorded.is_on = on;
	if (!on) {
		free(recorded.blocks);
		recorded.blocks = NULL;
		recorded.count = recorded.capacity = 0;
	}
}

static int compare_blocks(const void *a, const void *b)
{
	return memcmp(a, b, sizeof(struct random_block));
}

/* ---- renders ---- */

/* About half of the paths find light. */
static struct world *lit_world(void)
{
	/* clang-format off */
	return world_from_text(24, 24,
		SENSOR("0,1,5", "0,0.5,0")
		"<shape type='rectangle'>"
			"<transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/></transform>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='0' y='.6' z='0'/>"
			"<float name='radius' value='.6'/>"
			"<bsdf type='roughdielectric'/>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='1' y='2' z='1'/>"
			"<float name='radius' value='.3'/>"
			"<emitter type='area'/>"
		"</shape>");
	/* clang-format on */
}

static struct plan plan_of(const struct world *w, const struct integrator_properties *i)
{
	bool chains = i->kind == PLAN_CHAINS;
	struct plan p = {.kind = i->kind,
			 .width = w->settings.width,
			 .height = w->settings.height,
			 .crop_width = w->settings.width,
			 .crop_height = w->settings.height,
			 .border = w->settings.border,
			 .seed = 3,
			 .groups = GROUPS,
			 .parts = PARTS,
			 .chains = chains ? CHAINS : 0,
			 .bootstrap = BOOTSTRAP,
			 .epoch = chains ? EPOCH : SPP_EPOCH,
			 .rounds = ROUNDS,
			 .min_depth = 1,
			 .max_depth = 6};
	struct render_summary summary;
	struct error e = {""};
	snprintf(p.integrator, sizeof p.integrator, "%s", i->name);
	world_summary(w, &summary);
	if (i->has_mutations && render_canonical_mutations(NULL, &summary, p.mutations, &e))
		fail_msg("%s", e.text);
	if (plan_check(&p, &e))
		fail_msg("%s", e.text);
	return p;
}

/* Runs all leases of a job, recording their numbers by group; `look_at_batch` sees each batch. The brightness map
 * belongs to the plan: all groups share it, but none of its numbers. It is recorded as one more group. */
static void run_all(const struct world *w, const struct plan *p,
		    void (*look_at_batch)(void *user, const struct batch *b), void *user)
{
	struct bootstrap *s;
	struct batch before[GROUPS * PARTS] = {{.key = {0}}};
	uint64_t seeds[GROUPS][CHAINS / GROUPS];
	struct brightness *map;
	recorded.owner = GROUPS;
	assert_int_equal(render_brightness_map_new(w, p, &map, NULL), 0);
	assert_int_equal(bootstrap_new(&s, p, NULL), 0);
	for (uint32_t i = 0; i < GROUPS * PARTS; i++) {
		recorded.owner = i / PARTS;
		struct batch b =
			leases_run(w, p, (struct lease_key){1, LEASE_BOOTSTRAP, i / PARTS, i % PARTS, 0}, NULL);
		assert_int_equal(bootstrap_add(s, &b, NULL), 0);
		look_at_batch(user, &b);
		batch_fini(&b);
	}
	for (uint32_t g = 0; g < GROUPS && p->kind == PLAN_CHAINS; g++)
		bootstrap_draw_seeds(s, g, seeds[g]);
	for (uint32_t i = 0; i < ROUNDS * GROUPS * PARTS; i++) {
		uint32_t lease = i % (GROUPS * PARTS), group = lease / PARTS, part = lease % PARTS;
		struct lease_input in = {.map = map};
		if (p->kind == PLAN_CHAINS)
			in = (struct lease_input){.chain_count = CHAINS / GROUPS / PARTS,
						  .seeds = seeds[group] + plan_chain_range(p, part).begin};
		if (before[lease].states)
			in = (struct lease_input){.chain_count = before[lease].state_count,
						  .states = before[lease].states};
		recorded.owner = group;
		struct batch b =
			leases_run(w, p, (struct lease_key){1, LEASE_RENDER, group, part, i / (GROUPS * PARTS)}, &in);
		look_at_batch(user, &b);
		batch_fini(&before[lease]);
		before[lease] = b;
	}
	for (uint32_t i = 0; i < GROUPS * PARTS; i++)
		batch_fini(&before[i]);
	render_brightness_map_free(map);
	bootstrap_free(s);
}

static void ignore_batch(void *user, const struct batch *b)
{
	(void)user;
	(void)b;
}

static void groups_share_no_random_number(void **state)
{
	(void)state;
	struct world *w = lit_world();
	for (size_t i = 0; render_integrator_at(i); i++) {
		struct plan p = plan_of(w, render_integrator_at(i));
		size_t own[GROUPS + 1] = {0};
		set_recording(true);
		run_all(w, &p, ignore_batch, NULL);
		qsort(recorded.blocks, recorded.count, sizeof *recorded.blocks, compare_blocks);
		for (size_t n = 0; n < recorded.count; n++) {
			const struct random_block *a = &recorded.blocks[n], *b = a + 1;
			own[a->owner]++;
			if (n + 1 < recorded.count && memcmp(a, b, offsetof(struct random_block, owner)) == 0 &&
			    a->owner != b->owner)
				fail_msg(
					"%s: groups %u and %u ask for the same number: stream %u, index %llu, step %llu, block %llu",
					p.integrator, (unsigned)a->owner, (unsigned)b->owner, (unsigned)a->stream,
					(unsigned long long)a->index, (unsigned long long)a->step,
					(unsigned long long)a->block);
		}
		for (uint32_t g = 0; g < GROUPS; g++)
			assert_true(own[g] > BOOTSTRAP / GROUPS + ROUNDS * EPOCH);
		set_recording(false);
	}
	world_free(w);
}

/* A render as hslt-render does it: a chain starts from a bootstrap path that is evaluated again and belongs to the
 * range of the chain's group; each group has some. */
static void chains_start_from_their_groups_bootstrap(void **state)
{
	(void)state;
	struct world *w = lit_world();
	for (size_t i = 0; render_integrator_at(i); i++) {
		if (render_integrator_at(i)->kind != PLAN_CHAINS)
			continue;
		struct plan p = plan_of(w, render_integrator_at(i));
		size_t looks[BOOTSTRAP] = {0}, started[GROUPS] = {0};
		atomic_bool stop = false;
		struct local_run r = {.world = w, .plan = &p, .threads = 1, .stop = &stop};
		struct error e = {""};
		set_recording(true);
		if (local_run(&r, &e))
			fail_msg("%s", e.text);
		canvas_free(r.canvas);
		for (size_t n = 0; n < recorded.count; n++)
			if (recorded.blocks[n].stream == RNG_BOOTSTRAP && recorded.blocks[n].block == 0 &&
			    recorded.blocks[n].step == 0)
				looks[recorded.blocks[n].index]++;
		set_recording(false);
		for (uint64_t n = 0; n < BOOTSTRAP; n++) {
			assert_true(looks[n] > 0); /* all groups together have drawn every sample */
			started[n / (BOOTSTRAP / GROUPS)] += looks[n] > 1;
		}
		for (uint32_t g = 0; g < GROUPS; g++)
			assert_true(started[g] > 0 && started[g] <= CHAINS / GROUPS);
	}
	world_free(w);
}

/* The evaluated sample is the one with the weight. */
static void chains_start_from_the_samples_that_were_chosen(void **state)
{
	(void)state;
	struct world *w = lit_world();
	for (size_t i = 0; render_integrator_at(i); i++) {
		if (render_integrator_at(i)->kind != PLAN_CHAINS)
			continue;
		struct plan p = plan_of(w, render_integrator_at(i));
		struct batch boot = leases_run(w, &p, (struct lease_key){1, LEASE_BOOTSTRAP, 1, 0, 0}, NULL);
		uint64_t first = plan_bootstrap_range(&p, 1, 0).begin, n = 0, looks = 0;
		while (!(boot.weights[n] > 0))
			n++;
		for (uint64_t k = 0; k < boot.weight_count; k++) /* no weight is negative, however small */
			if (boot.weights[k] == 0) {
				boot.weights[k] = -1e-30f;
				assert_int_equal(batch_check(&boot, &p, NULL), -EBADMSG);
				break;
			}
		batch_fini(&boot);
		const uint64_t seeds[CHAINS / GROUPS / PARTS] = {first + n, first + n};
		set_recording(true);
		boot = leases_run(w, &p, (struct lease_key){1, LEASE_RENDER, 1, 0, 0},
				  &(struct lease_input){.chain_count = CHAINS / GROUPS / PARTS, .seeds = seeds});
		batch_fini(&boot);
		for (size_t k = 0; k < recorded.count; k++) {
			looks += recorded.blocks[k].stream == RNG_BOOTSTRAP;
			assert_true(recorded.blocks[k].stream != RNG_BOOTSTRAP ||
				    recorded.blocks[k].index == first + n);
		}
		assert_true(looks > 0);
		set_recording(false);
	}
	world_free(w);
}

/* A closed room, in which sub-paths end only by Russian roulette or after 40 edges. */
static struct world *closed_room(void)
{
	/* clang-format off */
	return world_from_text(24, 24,
		SENSOR("0,0,2.5", "0,0,0")
		"<shape type='cube'>"
			"<transform name='to_world'><scale value='3'/></transform>"
			"<boolean name='flip_normals' value='true'/>"
			"<bsdf type='diffuse'><rgb name='reflectance' value='0.7'/></bsdf>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='1' y='2' z='1'/>"
			"<float name='radius' value='.3'/>"
			"<emitter type='area'/>"
		"</shape>");
	/* clang-format on */
}

/* Finds the blocks of a bootstrap sample's numbers that were asked for, and returns their number. */
enum { BLOCKS_MAX = 4096 };
static size_t blocks_of(uint64_t index, bool asked[BLOCKS_MAX])
{
	size_t count = 0;
	memset(asked, 0, BLOCKS_MAX * sizeof *asked);
	for (size_t k = 0; k < recorded.count; k++) {
		const struct random_block *n = &recorded.blocks[k];
		if (n->stream != RNG_BOOTSTRAP || n->index != index || n->step != 0)
			continue;
		assert_true(n->block < BLOCKS_MAX);
		count += !asked[n->block];
		asked[n->block] = true;
	}
	return count;
}

/* A chain of full paths starts from the very sample that had the weight, with sub-paths of the same length: it asks
 * for the same numbers, and for those that choose one of the sample's paths. */
static void chain_starts_from_the_very_bootstrap_sample(void **state)
{
	(void)state;
	enum { SAMPLES = 64 };
	static bool before[SAMPLES][BLOCKS_MAX], after[BLOCKS_MAX];
	const struct integrator_properties *hslt = NULL;
	for (size_t i = 0; render_integrator_at(i); i++)
		if (render_integrator_at(i)->has_mutations)
			hslt = render_integrator_at(i);
	assert_non_null(hslt);
	struct world *w = closed_room();
	struct plan p = plan_of(w, hslt);
	p.max_depth = 40;
	uint64_t first = plan_bootstrap_range(&p, 1, 0).begin;
	size_t longest = 0, lit = 0;
	set_recording(true);
	struct batch boot = leases_run(w, &p, (struct lease_key){1, LEASE_BOOTSTRAP, 1, 0, 0}, NULL);
	for (uint64_t n = 0; n < SAMPLES; n++) {
		size_t asked = blocks_of(first + n, before[n]);
		longest = asked > longest ? asked : longest;
	}
	set_recording(false);
	for (uint64_t n = 0; n < SAMPLES; n++) {
		if (!(boot.weights[n] > 0))
			continue;
		const uint64_t seeds[CHAINS / GROUPS / PARTS] = {first + n, first + n};
		size_t extra = 0;
		set_recording(true);
		struct batch b =
			leases_run(w, &p, (struct lease_key){1, LEASE_RENDER, 1, 0, 0},
				   &(struct lease_input){.chain_count = CHAINS / GROUPS / PARTS, .seeds = seeds});
		batch_fini(&b);
		blocks_of(first + n, after);
		set_recording(false);
		for (size_t k = 0; k < BLOCKS_MAX; k++) {
			assert_true(!before[n][k] || after[k]);
			extra += after[k] && !before[n][k];
		}
		assert_int_equal(extra, SAMPLER_BLOCK_SIZE / 4);
		lit++;
	}
	batch_fini(&boot);
	assert_true(longest > 20 && lit > SAMPLES / 2);
	world_free(w);
}

/* The random number for resampling differs between groups, too; otherwise all groups would take seeds at the same
 * quantiles. */
static void groups_resample_with_their_own_numbers(void **state)
{
	(void)state;
	struct plan p = {.seed = 3, .groups = PLAN_GROUPS_MAX};
	for (uint32_t g = 0; g < p.groups; g++)
		for (uint32_t h = 0; h < g; h++)
			assert_true(plan_resample_offset(&p, g) != plan_resample_offset(&p, h));
}

struct weight_counts {
	uint64_t weights, dark_weights, bootstrap, samples, independent, proposed;
	uint32_t strategy;
};

static void count_weights(void *user, const struct batch *b)
{
	struct weight_counts *c = user;
	for (uint64_t i = 0; i < b->weight_count; i++)
		c->dark_weights += b->weights[i] == 0;
	c->weights += b->weight_count;
	if (b->key.kind == LEASE_BOOTSTRAP) {
		c->bootstrap += b->counters[COUNT_INDEPENDENT];
		return;
	}
	if (b->state_count) /* with two chains, no run of rejections is half of all */
		assert_true(2 * b->counters[COUNT_LONGEST_STUCK] <
			    b->counters[COUNT_SAMPLES] - b->counters[COUNT_ACCEPTED]);
	c->samples += b->counters[COUNT_SAMPLES];
	c->independent += b->counters[COUNT_INDEPENDENT];
	if (b->strategy_count)
		c->proposed += b->strategies[c->strategy][STRATEGY_PROPOSED];
}

/* About half of the samples are dark (fewer if emitters are connected to the lens), and must be counted: all of them
 * by the bootstrap and by samples; all proposals by strategies; and by pssmlt 0.3 of the steps, within five standard
 * errors (without the dark ones, the share would be 6 standard errors lower). */
static void dark_samples_are_counted(void **state)
{
	(void)state;
	struct world *w = lit_world();
	for (size_t i = 0; render_integrator_at(i); i++) {
		struct plan p = plan_of(w, render_integrator_at(i));
		struct weight_counts c = {0};
		struct mixture m;
		if (p.mutations[0]) {
			assert_int_equal(mixture_parse(p.mutations, &m, NULL), 0);
			c.strategy = m.independent_index;
		}
		run_all(w, &p, count_weights, &c);
		double share = (double)c.independent / (double)c.samples;
		print_message("%s: %llu of %llu bootstrap samples dark, %.3f of %llu samples independent\n",
			      p.integrator, (unsigned long long)c.dark_weights, (unsigned long long)c.weights, share,
			      (unsigned long long)c.samples);
		assert_true(c.weights == BOOTSTRAP && c.dark_weights > BOOTSTRAP / 8 && c.dark_weights < BOOTSTRAP);
		assert_true(c.bootstrap == c.weights);
		if (p.kind == PLAN_SAMPLES)
			assert_true(c.independent == c.samples &&
				    c.samples == ROUNDS * GROUPS * SPP_EPOCH * plan_extended_pixels(&p));
		else if (p.mutations[0])
			assert_true(c.independent == c.proposed && c.independent > 0);
		else
			assert_true(fabs(share - 0.3) < 5 * sqrt(0.3 * 0.7 / (double)c.samples));
	}
	world_free(w);
}

/* The b of a group is its own sum over all of its own samples; the pooled b is that of all groups. */
static void each_group_has_its_own_b(void **state)
{
	(void)state;
	struct plan p = {.kind = PLAN_CHAINS,
			 .width = 1,
			 .height = 1,
			 .crop_width = 1,
			 .crop_height = 1,
			 .groups = GROUPS,
			 .parts = PARTS,
			 .chains = CHAINS,
			 .bootstrap = 8 * GROUPS * PARTS,
			 .epoch = 1,
			 .rounds = 1,
			 .min_depth = 1,
			 .max_depth = 4};
	struct bootstrap *s;
	struct bootstrap_result r;
	assert_int_equal(bootstrap_new(&s, &p, NULL), 0);
	for (uint32_t i = 0; i < GROUPS * PARTS; i++) {
		float weights[8] = {0};
		struct batch b = {
			.key = {1, LEASE_BOOTSTRAP, i / PARTS, i % PARTS, 0}, .weights = weights, .weight_count = 8};
		b.counters[COUNT_INDEPENDENT] = b.counters[COUNT_SAMPLES] = 8;
		weights[i / PARTS] = i % PARTS ? 0 : (float)(1 << i / PARTS); /* the second part found nothing */
		b.independent_sum = (double)weights[i / PARTS];
		assert_int_equal(bootstrap_add(s, &b, NULL), 0);
	}
	bootstrap_compute_b(s, &r);
	for (uint32_t g = 0; g < GROUPS; g++) {
		uint64_t seeds[CHAINS / GROUPS];
		assert_true(r.b[g] == (1 << g) / 16.0);
		bootstrap_draw_seeds(s, g, seeds);
		for (size_t k = 0; k < CHAINS / GROUPS; k++)
			assert_true(seeds[k] == plan_bootstrap_range(&p, g, 0).begin + g); /* the only one with light */
	}
	assert_true(r.b_pooled == 15 / 64.0);
	bootstrap_free(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(groups_share_no_random_number),
		cmocka_unit_test(chains_start_from_their_groups_bootstrap),
		cmocka_unit_test(chains_start_from_the_samples_that_were_chosen),
		cmocka_unit_test(chain_starts_from_the_very_bootstrap_sample),
		cmocka_unit_test(groups_resample_with_their_own_numbers),
		cmocka_unit_test(dark_samples_are_counted),
		cmocka_unit_test(each_group_has_its_own_b),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
