/* SPDX-License-Identifier: Apache-2.0 */
/* The digest of a batch covers everything that decides bits of the image, and not the time that the batch took. */
#include "coordinator/live_job/digest.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { TILES = 2, STATES = 2, WEIGHTS = 3, MOMENTS = 4 };

struct sample {
	struct batch batch;
	struct tile tiles[TILES];
	float pixels[TILES][2 * 2 * TILE_CHANNELS];
	struct chain_state states[STATES];
	uint8_t bytes[STATES][5];
	float weights[WEIGHTS], moments[MOMENTS];
};

static void sample_init(struct sample *s)
{
	memset(s, 0, sizeof *s);
	s->batch = (struct batch){.key = {7, LEASE_RENDER, 1, 2, 3},
				  .strategy_count = 2,
				  .tile_count = TILES,
				  .tiles = s->tiles,
				  .state_count = STATES,
				  .states = s->states,
				  .weight_count = WEIGHTS,
				  .weights = s->weights,
				  .moment_count = MOMENTS,
				  .moments = s->moments,
				  .cpu_seconds = 1};
	for (uint32_t i = 0; i < TILES; i++)
		s->tiles[i] = (struct tile){.x = 64 * i, .width = 2, .height = 2, .xyz = s->pixels[i]};
	for (int i = 0; i < STATES; i++)
		s->states[i] = (struct chain_state){s->bytes[i], 5};
}

static void check_digest(const struct sample *s, bool same)
{
	static struct sample plain;
	struct batch_digest a, b;
	struct error e;
	sample_init(&plain);
	assert_int_equal(digest_batch(&plain.batch, &a, &e), 0);
	assert_int_equal(digest_batch(&s->batch, &b, &e), 0);
	assert_int_equal(memcmp(&a, &b, sizeof a) == 0, same);
}

static void every_number_changes_the_digest(void **state)
{
	(void)state;
	static struct sample s;
#define EXPECT_CHANGED(what)             \
	do {                             \
		sample_init(&s);         \
		what;                    \
		check_digest(&s, false); \
	} while (0)
	sample_init(&s);
	check_digest(&s, true);
	s.batch.cpu_seconds = 2;
	s.batch.strategies[2][0] = 1; /* beyond the strategies of the plan */
	check_digest(&s, true);
	EXPECT_CHANGED(s.batch.key.job = 8);
	EXPECT_CHANGED(s.batch.key.kind = LEASE_BOOTSTRAP);
	EXPECT_CHANGED(s.batch.key.group = 0);
	EXPECT_CHANGED(s.batch.key.part = 0);
	EXPECT_CHANGED(s.batch.key.epoch = 4);
	for (int i = 0; i < BATCH_COUNTERS; i++)
		EXPECT_CHANGED(s.batch.counters[i] = 1);
	for (int i = 0; i < STRATEGY_COUNTERS; i++)
		EXPECT_CHANGED(s.batch.strategies[1][i] = 1);
	for (int i = 0; i < PATH_CLASSES; i++)
		EXPECT_CHANGED(s.batch.classes[i] = 1);
	EXPECT_CHANGED(s.batch.independent_sum = -0.0);
	EXPECT_CHANGED(s.batch.independent_square = 1);
	EXPECT_CHANGED(s.batch.overlong_sum = 1);
	EXPECT_CHANGED(s.batch.strategy_count = 1);
	EXPECT_CHANGED(s.batch.tile_count = 1);
	EXPECT_CHANGED(s.batch.state_count = 1);
	EXPECT_CHANGED(s.batch.weight_count = 2);
	EXPECT_CHANGED(s.batch.moment_count = 3);
	EXPECT_CHANGED(s.tiles[1].x = 0);
	EXPECT_CHANGED(s.tiles[1].y = 1);
	EXPECT_CHANGED((s.tiles[1].width = 1, s.tiles[1].height = 4));
	EXPECT_CHANGED(s.pixels[0][0] = 1e-45f);
	EXPECT_CHANGED(s.pixels[1][2 * 2 * TILE_CHANNELS - 1] = 1);
	EXPECT_CHANGED(s.bytes[1][4] = 1);
	EXPECT_CHANGED(s.states[0].size = 4);
	EXPECT_CHANGED(s.weights[2] = 1);
	EXPECT_CHANGED(s.moments[3] = 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(every_number_changes_the_digest)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
