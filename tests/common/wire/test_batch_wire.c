/* SPDX-License-Identifier: Apache-2.0 */
/* Batches, grants and plans are unpacked as they were packed; those that do not fit their plan or their payload are
 * refused. */
#include "common/wire/batch_wire.h"
#include "common/base/mem.h"
#include "common/wire/frame.h"
#include "tests/support/failing_memory.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

static void assert_same_key(const struct lease_key *a, const struct lease_key *b)
{
	assert_true(a->job == b->job && a->kind == b->kind && a->group == b->group && a->part == b->part &&
		    a->epoch == b->epoch);
}

static struct plan chain_plan(void)
{
	struct plan_request r = {.integrator = "pssmlt",
				 .kind = PLAN_CHAINS,
				 .width = 200,
				 .height = 100,
				 .crop_x = 10,
				 .crop_y = 20,
				 .crop_width = 100,
				 .crop_height = 70,
				 .mutations = 100000,
				 .max_depth = 10,
				 .chains = 64,
				 .groups = 8,
				 .bootstrap = 1024,
				 .epoch = 100,
				 .mixture = "independent=0.1,hslt=0.9"};
	struct plan p;
	struct error e;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	return p;
}

static void fill_tile(struct tile *t, uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
	*t = (struct tile){x, y, width, height, mem_alloc((size_t)width * height * 3, sizeof(float))};
	for (uint32_t i = 0; i < width * height * 3; i++)
		t->xyz[i] = (float)(i * 0.37 + x - 5);
}

/* The second and the last tile of the crop, and chain states of several sizes, one of a chain that is dead. */
static struct batch chain_batch(const struct plan *p)
{
	struct batch b = {.key = {7, LEASE_RENDER, 3, 0, 2},
			  .independent_sum = 1.0 / 3,
			  .independent_square = 0.05,
			  .overlong_sum = 0,
			  .cpu_seconds = 0.25};
	uint32_t chains = p->chains / (p->groups * p->parts);
	b.counters[COUNT_SAMPLES] = chains * p->epoch;
	b.counters[COUNT_INDEPENDENT] = 3;
	b.counters[COUNT_LONGEST_STUCK] = 77;
	b.strategy_count = 2;
	for (uint64_t i = 0; i < STRATEGY_COUNTERS; i++) {
		bool fails = i >= STRATEGY_FAIL_FIRST;
		b.strategies[0][i] = fails ? 1 : 30 - i;
		b.strategies[1][i] = fails ? 2 : i > STRATEGY_ACCEPTED ? UINT64_C(1) << (50 + i) : 40 - i;
	}
	b.strategies[0][STRATEGY_ACCEPTED] = 5;
	b.strategies[1][STRATEGY_ACCEPTED] = 6;
	b.counters[COUNT_ACCEPTED] = 12;
	b.tile_count = 2;
	b.tiles = mem_alloc(2, sizeof *b.tiles);
	fill_tile(&b.tiles[0], 10 + 64, 20, 36, 64);
	fill_tile(&b.tiles[1], 10 + 64, 20 + 64, 36, 6);
	b.state_count = chains;
	b.states = mem_alloc(chains, sizeof *b.states);
	for (uint32_t i = 0; i < chains; i++) {
		b.states[i].size = 10 + i;
		b.states[i].bytes = mem_alloc(10 + i, 1);
		memset(b.states[i].bytes, (int)i + 1, 10 + i);
	}
	b.moment_count = batch_moment_count(p, LEASE_RENDER);
	b.moments = mem_alloc(b.moment_count, sizeof *b.moments);
	for (uint64_t i = 0; i < b.moment_count; i++)
		b.moments[i] = 2 - (float)i / (float)b.moment_count;
	for (int i = 0; i < PATH_CLASSES; i++)
		b.classes[i] = i / 3.0;
	return b;
}

/* Packs the batch, and takes the frame apart as a connection does. */
static void pack_and_read(const struct batch *b, const struct plan *p, struct envelope *env, struct frame_reader *r)
{
	unsigned char *frame;
	size_t size, used;
	struct error e;
	assert_int_equal(batch_pack(b, p, &frame, &size, &e), 0);
	frame_reader_init(r, (struct frame_limits){1 << 20, batch_payload_max(p)});
	assert_int_equal(frame_reader_feed(r, frame, size, &used, &e), 1);
	assert_int_equal(used, size);
	assert_int_equal(envelope_unpack(env, r->header.bytes, r->header.size, &e), 0);
	assert_int_equal(env->message->body_case, FARM__ENVELOPE__BODY_LEASE_RESULT);
	mem_free(frame);
}

static void batch_is_unpacked_as_it_was_packed(void **state)
{
	(void)state;
	struct plan p = chain_plan();
	struct batch b = chain_batch(&p), back;
	struct envelope env;
	struct frame_reader r;
	struct error e = {""};
	pack_and_read(&b, &p, &env, &r);
	int rc = batch_unpack(&back, &p, env.message->lease_result, r.payload.bytes, r.payload.size, &e);
	if (rc)
		print_message("%s\n", e.text);
	assert_int_equal(rc, 0);
	assert_same_key(&back.key, &b.key);
	assert_memory_equal(back.counters, b.counters, sizeof b.counters);
	assert_int_equal(back.strategy_count, 2);
	assert_memory_equal(back.strategies, b.strategies, sizeof b.strategies);
	assert_true(back.independent_sum == b.independent_sum && back.independent_square == b.independent_square);
	assert_int_equal(back.tile_count, 2);
	for (uint32_t i = 0; i < 2; i++) {
		assert_int_equal(back.tiles[i].x, b.tiles[i].x);
		assert_int_equal(back.tiles[i].height, b.tiles[i].height);
		assert_memory_equal(back.tiles[i].xyz, b.tiles[i].xyz,
				    b.tiles[i].width * b.tiles[i].height * 3 * sizeof(float));
	}
	assert_int_equal(back.state_count, b.state_count);
	for (uint32_t i = 0; i < b.state_count; i++) {
		assert_int_equal(back.states[i].size, b.states[i].size);
		assert_memory_equal(back.states[i].bytes, b.states[i].bytes, b.states[i].size);
	}
	assert_memory_equal(back.classes, b.classes, sizeof b.classes);
	assert_int_equal(back.moment_count, b.moment_count);
	assert_memory_equal(back.moments, b.moments, b.moment_count * sizeof *b.moments);
	batch_fini(&back);
	/* Every truncation of the payload is detected, and nothing leaks (as a sanitizer would report). */
	for (size_t n = 0; n < r.payload.size; n += 97)
		assert_int_equal(batch_unpack(&back, &p, env.message->lease_result, r.payload.bytes, n, &e), -EBADMSG);
	env.message->lease_result->state_sizes[0] = UINT32_MAX;
	assert_int_equal(batch_unpack(&back, &p, env.message->lease_result, r.payload.bytes, r.payload.size, &e),
			 -EBADMSG);
	envelope_fini(&env);
	frame_reader_fini(&r);
	batch_fini(&b);
}

static void number_of_strategies_must_match_the_plan(void **state)
{
	(void)state;
	struct plan p = chain_plan();
	struct batch b = chain_batch(&p), back;
	struct envelope env;
	struct frame_reader r;
	struct error e;
	pack_and_read(&b, &p, &env, &r);
	Farm__LeaseResult *m = env.message->lease_result;
	assert_int_equal(m->n_strategies, 2 * STRATEGY_COUNTERS);
	static const struct {
		size_t count;
		int rc;
	} cases[] = {{0, 0}, {1, -EBADMSG}, {STRATEGY_COUNTERS, -EBADMSG}, {2 * STRATEGY_COUNTERS - 1, -EBADMSG}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		m->n_strategies = cases[i].count;
		assert_int_equal(batch_unpack(&back, &p, m, r.payload.bytes, r.payload.size, &e), cases[i].rc);
		if (!cases[i].rc)
			assert_int_equal(back.strategy_count, 0);
		batch_fini(&back);
	}
	uint64_t many[(BATCH_STRATEGIES + 1) * STRATEGY_COUNTERS] = {0}, *own = m->strategies;
	for (size_t n = 3; n <= BATCH_STRATEGIES + 1; n++) {
		m->strategies = many;
		m->n_strategies = n * STRATEGY_COUNTERS;
		assert_int_equal(batch_unpack(&back, &p, m, r.payload.bytes, r.payload.size, &e), -EBADMSG);
	}
	m->strategies = own;
	m->n_strategies = 2 * STRATEGY_COUNTERS;
	envelope_fini(&env);
	frame_reader_fini(&r);
	batch_fini(&b);
}

/* The film has four tiles: a header with more is refused before any tile is read. */
static void number_of_tiles_is_checked_first(void **state)
{
	(void)state;
	struct plan p = chain_plan();
	struct batch b = chain_batch(&p), back;
	struct envelope env;
	struct frame_reader r;
	struct error e;
	pack_and_read(&b, &p, &env, &r);
	Farm__LeaseResult *m = env.message->lease_result;
	uint32_t sizes[5] = {m->tile_sizes[0], m->tile_sizes[1]}, *own = m->tile_sizes;
	m->tile_sizes = sizes;
	m->n_tile_sizes = 4;
	assert_int_equal(batch_unpack(&back, &p, m, r.payload.bytes, r.payload.size, &e), -EBADMSG);
	assert_non_null(strstr(e.text, "tile 2"));
	m->n_tile_sizes = 5;
	assert_int_equal(batch_unpack(&back, &p, m, r.payload.bytes, r.payload.size, &e), -EBADMSG);
	assert_string_equal(e.text, "a batch with 5 tiles");
	m->tile_sizes = own;
	m->n_tile_sizes = 2;
	envelope_fini(&env);
	frame_reader_fini(&r);
	batch_fini(&b);
}

static void any_failed_allocation_is_reported(void **state)
{
	(void)state;
	struct plan p = chain_plan();
	struct batch b = chain_batch(&p), back;
	struct envelope env;
	struct frame_reader r;
	struct error e;
	pack_and_read(&b, &p, &env, &r);
	int rc = -ENOMEM;
	for (long n = 0; rc; n++) {
		mem_fail_after(n);
		rc = batch_unpack(&back, &p, env.message->lease_result, r.payload.bytes, r.payload.size, &e);
		mem_fail_after(-1);
		assert_true(rc == 0 || rc == -ENOMEM);
	}
	batch_fini(&back);
	envelope_fini(&env);
	frame_reader_fini(&r);
	batch_fini(&b);
}

/* There are as many classes and moments as the plan has, and impossible values are refused. */
static void moments_must_match_the_plan(void **state)
{
	(void)state;
	struct plan p = chain_plan();
	struct batch b = chain_batch(&p), back;
	struct envelope env;
	struct frame_reader r;
	struct error e;
	uint64_t tiles = batch_film_tile_count(&p), sequences = batch_sequence_count(&p), count = b.moment_count;
	assert_int_equal(sequences, b.state_count);
	assert_int_equal(count, (sequences + 1) * tiles);
	pack_and_read(&b, &p, &env, &r);
	Farm__LeaseResult *m = env.message->lease_result;
	const uint64_t counts[] = {0, count - 1, count + 1, UINT64_MAX / 4 + 2};
	for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
		m->moment_count = counts[i];
		assert_int_equal(batch_unpack(&back, &p, m, r.payload.bytes, r.payload.size, &e), -EBADMSG);
	}
	m->moment_count = count;
	const size_t classes[] = {0, PATH_CLASSES - 1};
	for (size_t i = 0; i < 2; i++) {
		m->n_classes = classes[i];
		assert_int_equal(batch_unpack(&back, &p, m, r.payload.bytes, r.payload.size, &e), -EBADMSG);
	}
	m->n_classes = PATH_CLASSES;
	assert_int_equal(batch_unpack(&back, &p, m, r.payload.bytes, r.payload.size, &e), 0);
	batch_fini(&back);
	envelope_fini(&env);
	frame_reader_fini(&r);
	const float epoch = (float)p.epoch, bad[] = {-1e-30f, NAN, INFINITY, epoch * 1.001f};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		for (uint64_t index = 0; index < count; index += count - 1) { /* a first moment, a second one */
			float original = b.moments[index];
			b.moments[index] = bad[i];
			assert_int_equal(batch_check(&b, &p, &e), -EBADMSG);
			b.moments[index] = original;
		}
	for (uint64_t t = 0; t < tiles; t++) /* a chain's whole time, and not more */
		b.moments[t] = epoch / (float)tiles;
	assert_int_equal(batch_check(&b, &p, &e), 0);
	b.moments[0] *= 1.01f;
	assert_int_equal(batch_check(&b, &p, &e), -EBADMSG);
	/* A proposal of almost no light: its moments are rounded to multiples of 2^-149, or to 0. */
	float *second = &b.moments[sequences * tiles];
	for (uint64_t s = 0; s < sequences; s++)
		b.moments[s * tiles] = 0;
	b.moments[0] = 0x1.fp-140f;
	*second = b.moments[0] + 0x1p-149f;
	assert_int_equal(batch_check(&b, &p, &e), 0);
	b.moments[0] = 0;
	*second = 0x1p-149f;
	assert_int_equal(batch_check(&b, &p, &e), 0);
	*second = 0x1p-130f;
	assert_int_equal(batch_check(&b, &p, &e), -EBADMSG);
	*second = 0;
	const double time = (double)b.counters[COUNT_SAMPLES], classes_bad[] = {-1e-300, NAN, INFINITY, time};
	for (size_t i = 0; i < sizeof classes_bad / sizeof *classes_bad; i++) {
		b.classes[3] = classes_bad[i];
		assert_int_equal(batch_check(&b, &p, &e), -EBADMSG);
	}
	memset(b.classes, 0, sizeof b.classes);
	b.classes[PATH_CLASSES - 1] = time;
	assert_int_equal(batch_check(&b, &p, &e), 0);
	mem_free(b.moments);
	b.moments = NULL;
	b.moment_count = 0;
	assert_int_equal(batch_check(&b, &p, &e), -EBADMSG);
	batch_fini(&b);
	p.chains = 8 * (SEQUENCES_MAX / 8 + 1);
	assert_int_equal(batch_sequence_count(&p), 1);
	p.kind = PLAN_SAMPLES;
	assert_int_equal(batch_sequence_count(&p), 0);
	assert_int_equal(batch_moment_count(&p, LEASE_RENDER), 0);
}

/* No chain state is longer than that of the longest path, whatever a worker sends. */
static void size_of_a_chain_state_is_limited_by_path_length(void **state)
{
	(void)state;
	static const struct {
		uint32_t max_depth, max_size;
	} plans[] = {{1, 320}, {10, 1472}, {32, 4288}, {41, CHAIN_STATE_MAX}, {128, CHAIN_STATE_MAX}};
	struct plan p = chain_plan();
	struct batch b = chain_batch(&p);
	struct error e;
	assert_int_equal(batch_check(&b, &p, &e), 0);
	for (size_t i = 0; i < sizeof plans / sizeof *plans; i++) {
		struct chain_state *s = &b.states[1];
		p.max_depth = plans[i].max_depth;
		mem_free(s->bytes);
		*s = (struct chain_state){mem_alloc(plans[i].max_size + 1, 1), plans[i].max_size};
		assert_int_equal(batch_check(&b, &p, &e), 0);
		assert_int_equal(chain_states_max_bytes(&p), 64 * (uint64_t)(plans[i].max_size + 48));
		s->size++;
		assert_int_equal(batch_check(&b, &p, &e), -EBADMSG);
	}
	batch_fini(&b);
}

static void weights_are_unpacked_as_they_were_packed(void **state)
{
	(void)state;
	struct plan p = chain_plan();
	struct plan_range range = plan_bootstrap_range(&p, 1, 0);
	struct batch b = {.key = {7, LEASE_BOOTSTRAP, 1, 0, 0}, .classes = {0.25, 0, 0.5}}, back;
	struct envelope env;
	struct frame_reader r;
	struct error e;
	b.weight_count = range.end - range.begin;
	b.counters[COUNT_INDEPENDENT] = b.counters[COUNT_SAMPLES] = b.weight_count;
	b.weights = mem_alloc(b.weight_count, sizeof *b.weights);
	for (uint64_t i = 0; i < b.weight_count; i++)
		b.weights[i] = 1.0f / (float)(i + 1);
	for (uint64_t i = 0; i < b.weight_count; i++) {
		b.independent_sum += (double)b.weights[i];
		b.independent_square += (double)b.weights[i] * (double)b.weights[i];
	}
	pack_and_read(&b, &p, &env, &r);
	int rc = batch_unpack(&back, &p, env.message->lease_result, r.payload.bytes, r.payload.size, &e);
	if (rc)
		print_message("%s\n", e.text);
	assert_int_equal(rc, 0);
	assert_int_equal(back.weight_count, b.weight_count);
	assert_memory_equal(back.weights, b.weights, b.weight_count * sizeof *b.weights);
	assert_memory_equal(back.classes, b.classes, sizeof b.classes);
	batch_fini(&back);
	env.message->lease_result->independent_sum *= 1.001; /* not the sum of the weights */
	assert_int_equal(batch_unpack(&back, &p, env.message->lease_result, r.payload.bytes, r.payload.size, &e),
			 -EBADMSG);
	env.message->lease_result->independent_sum = b.independent_sum;
	env.message->lease_result->weight_count = UINT64_MAX / 4 + 2; /* times 4 it overflows to a small number */
	assert_int_equal(batch_unpack(&back, &p, env.message->lease_result, r.payload.bytes, r.payload.size, &e),
			 -EBADMSG);
	envelope_fini(&env);
	frame_reader_fini(&r);
	batch_fini(&b);
}

static struct grant pack_and_unpack_grant(const struct lease_key *k, const uint64_t *seeds,
					  const struct chain_state *states, uint32_t count)
{
	struct frame_reader r;
	struct envelope env;
	struct grant g;
	struct error e;
	unsigned char *frame;
	size_t size, used;
	assert_int_equal(grant_pack(k, seeds, states, count, &frame, &size, &e), 0);
	frame_reader_init(&r, (struct frame_limits){1 << 20, 1 << 20});
	assert_int_equal(frame_reader_feed(&r, frame, size, &used, &e), 1);
	assert_int_equal(envelope_unpack(&env, r.header.bytes, r.header.size, &e), 0);
	assert_int_equal(grant_unpack(&g, env.message->lease_grant, r.payload.bytes, r.payload.size, &e), 0);
	assert_same_key(&g.key, k);
	envelope_fini(&env);
	frame_reader_fini(&r);
	mem_free(frame);
	return g;
}

static void grants_are_unpacked_as_they_were_packed(void **state)
{
	(void)state;
	struct lease_key k = {1, LEASE_RENDER, 2, 3, UINT64_MAX};
	uint64_t seeds[3] = {0, UINT64_MAX, 5};
	uint8_t bytes[] = "abc";
	struct chain_state states[2] = {{NULL, 0}, {bytes, 3}};
	struct grant g = pack_and_unpack_grant(&k, seeds, NULL, 3);
	assert_true(g.chain_count == 3 && g.states == NULL && g.seeds[1] == UINT64_MAX);
	grant_fini(&g);
	g = pack_and_unpack_grant(&k, NULL, states, 2);
	assert_true(g.chain_count == 2 && g.seeds == NULL && g.states[0].size == 0 && g.states[1].size == 3);
	assert_memory_equal(g.states[1].bytes, "abc", 3);
	grant_fini(&g);
	/* Of the first frame on a connection, and of a frame without payload. */
	g = pack_and_unpack_grant(&k, NULL, (struct chain_state[2]){{NULL, 0}, {NULL, 0}}, 2);
	assert_true(g.chain_count == 2 && g.states[0].size == 0 && g.states[1].size == 0);
	grant_fini(&g);
	g = pack_and_unpack_grant(&k, NULL, NULL, 0);
	assert_true(g.chain_count == 0);
	grant_fini(&g);
}

static void plans_are_unpacked_as_they_were_packed(void **state)
{
	(void)state;
	struct plan p = chain_plan(), back;
	struct error e;
	Farm__Plan m;
	for (int unseen = 0; unseen < 2; unseen++) {
		p.unseen.mean_squares[PLAN_UNSEEN_COUNT - 1] = 1e-6 * unseen;
		plan_to_wire(&p, &m);
		assert_int_equal(m.n_unseen, unseen ? PLAN_UNSEEN_COUNT : 0);
		assert_int_equal(plan_from_wire(&m, &back, &e), 0);
		assert_memory_equal(&p, &back, sizeof p);
	}
	m.n_unseen--;
	assert_int_equal(plan_from_wire(&m, &back, &e), -EBADMSG);
	m.n_unseen++;
	m.groups = 0; /* plan_check refuses it */
	assert_true(plan_from_wire(&m, &back, &e) < 0);
	plan_to_wire(&p, &m);
	m.kind = 17;
	assert_int_equal(plan_from_wire(&m, &back, &e), -EBADMSG);
	char name[] = "a name far too long";
	plan_to_wire(&p, &m);
	m.integrator = name;
	assert_int_equal(plan_from_wire(&m, &back, &e), -EBADMSG);
	char longest[PLAN_MUTATIONS_MAX + 1] = "", control[] = "a\n";
	memset(longest, 'a', PLAN_MUTATIONS_MAX);
	char *mixtures[] = {longest, control};
	struct plan_request request = {.integrator = "hslt",
				       .kind = PLAN_CHAINS,
				       .mixture = "hslt=1",
				       .accuracy = "tolerance=1e-05",
				       .effects = "all",
				       .parts = 64,
				       .speed = 31000.5,
				       .rays = {8123.25, 88.5},
				       .unseen = {{0.5, 0.25}}},
			    unpacked_request;
	Farm__PlanRequest rm;
	plan_request_to_wire(&request, &rm);
	assert_int_equal(plan_request_from_wire(&rm, &unpacked_request, &e), 0);
	assert_memory_equal(&request, &unpacked_request, sizeof request);
	const double speeds[] = {-1, 2.1e7, NAN};
	for (int i = 0; i < 3; i++) {
		rm.speed = speeds[i];
		assert_int_equal(plan_request_from_wire(&rm, &unpacked_request, &e), -EBADMSG);
	}
	rm.speed = 0;
	for (int i = 0; i < 2; i++) {
		const double bad[] = {-1, INFINITY, NAN};
		for (int k = 0; k < 3; k++) {
			*(i ? &rm.step_rays : &rm.bootstrap_rays) = bad[k];
			assert_int_equal(plan_request_from_wire(&rm, &unpacked_request, &e), -EBADMSG);
		}
		*(i ? &rm.step_rays : &rm.bootstrap_rays) = 0;
	}
	char long_text[PLAN_ACCURACY_MAX + 1] = "";
	memset(long_text, 'a', PLAN_ACCURACY_MAX);
	plan_to_wire(&p, &m);
	m.accuracy = long_text;
	assert_int_equal(plan_from_wire(&m, &back, &e), -EBADMSG);
	plan_to_wire(&p, &m);
	m.effects = control;
	assert_int_equal(plan_from_wire(&m, &back, &e), -EBADMSG);
	for (int i = 0; i < 2; i++) {
		plan_to_wire(&p, &m);
		m.mutations = mixtures[i];
		assert_int_equal(plan_from_wire(&m, &back, &e), -EBADMSG);
		rm.mixture = mixtures[i];
		assert_int_equal(plan_request_from_wire(&rm, &unpacked_request, &e), -EBADMSG);
	}
	longest[PLAN_MUTATIONS_MAX - 1] = 0;
	plan_to_wire(&p, &m);
	m.mutations = longest;
	assert_int_equal(plan_from_wire(&m, &back, &e), 0);
}

/* The most chains that a plan allows in a lease: the longest seeds, and the sizes of chain states, fit into a header of
 * 1 MB, the limit of a coordinator. A worker accepts four times as much, and 256 MB of states: 16 KB each, more than
 * any state has. */
static void largest_lease_fits_into_its_message(void **state)
{
	(void)state;
	enum { COUNT = PLAN_LEASE_CHAINS_MAX, STATE = 1 << 9 };
	struct lease_key k = {.job = UINT64_MAX, .kind = LEASE_RENDER, .group = 63, .part = 63, .epoch = UINT64_MAX};
	uint64_t *seeds = mem_alloc(COUNT, sizeof *seeds);
	for (int i = 0; i < COUNT; i++)
		seeds[i] = UINT64_MAX;
	struct grant g = pack_and_unpack_grant(&k, seeds, NULL, COUNT);
	assert_int_equal(g.chain_count, COUNT);
	grant_fini(&g);
	mem_free(seeds);
	struct plan p = chain_plan();
	struct batch b = chain_batch(&p);
	struct envelope env;
	struct frame_reader r;
	chain_states_free(b.states, b.state_count);
	b.state_count = COUNT;
	b.states = mem_alloc(COUNT, sizeof *b.states);
	for (int i = 0; i < COUNT; i++)
		b.states[i] = (struct chain_state){mem_alloc(STATE, 1), STATE};
	p.chains = COUNT * p.groups * p.parts;
	pack_and_read(&b, &p, &env, &r);
	envelope_fini(&env);
	frame_reader_fini(&r);
	batch_fini(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(batch_is_unpacked_as_it_was_packed),
		cmocka_unit_test(number_of_tiles_is_checked_first),
		cmocka_unit_test(any_failed_allocation_is_reported),
		cmocka_unit_test(moments_must_match_the_plan),
		cmocka_unit_test(size_of_a_chain_state_is_limited_by_path_length),
		cmocka_unit_test(weights_are_unpacked_as_they_were_packed),
		cmocka_unit_test(grants_are_unpacked_as_they_were_packed),
		cmocka_unit_test(largest_lease_fits_into_its_message),
		cmocka_unit_test(plans_are_unpacked_as_they_were_packed),
		cmocka_unit_test(number_of_strategies_must_match_the_plan),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
