/*
 * States of chains of whole paths: what is saved comes back as the same path, two that resume from the same bytes go on bit by
 * bit alike, and bytes that somebody has changed are refused or are another path of this world.
 */
#include "common/base/mem.h"
#include "tests/support/dice.h"
#include "tests/support/rooms.h"
#include "tests/support/starts.h"
#include "worker/chain/path_chain.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 32, EDGES = 8 };
static const char mixture[] = "bidirectional=0.2,hslt=0.6,wavelength=0.1,lens=0.05,light=0.05";

static struct path_context context;
static uint64_t counters[BATCH_COUNTERS], strategies[BATCH_STRATEGIES][STRATEGY_COUNTERS];

static void begin(struct chain *c, struct film_sums *film)
{
	*c = (struct chain){.context = &context, .film = film, .mixture = mixture, .strategy = strategies, .seed = 7, .id = 3};
}

/* The first sample of the bootstrap that carries light. */
static void start(struct chain *c)
{
	uint64_t index = 0;
	while (!chain_path.start(c, index))
		assert_true(++index < 100000);
}

static void steps(struct chain *c, int n)
{
	struct chain_sums sums = {0, 0};
	for (int i = 0; i < n; i++)
		chain_path.step(c, &sums);
	chain_path.flush(c);
}

static bool same_state(const struct chain *a, const struct chain *b)
{
	struct chain_state s, t;
	assert_int_equal(chain_path.save(a, &s), 0);
	assert_int_equal(chain_path.save(b, &t), 0);
	bool same = s.size == t.size && memcmp(s.bytes, t.bytes, s.size) == 0;
	mem_free(s.bytes);
	mem_free(t.bytes);
	return same;
}

static void check_resume(struct chain *c, struct chain *d)
{
	static struct whole_path x;
	struct chain_state s;
	char text[200];
	assert_int_equal(chain_path.save(c, &s), 0);
	assert_true(s.size <= CHAIN_STATE_MAX);
	memset(d + 1, 0xa5, chain_path.size - sizeof *d);
	d->step = d->rejected_run = 99;
	assert_true(chain_path.resume(d, &s) && chain_path.resume(c, &s));
	assert_int_equal(c->step, d->step);
	assert_true(path_read(&context, s.bytes + CHAIN_STATE_HEAD, s.size - CHAIN_STATE_HEAD, &x));
	if (!path_check(&context, &x, text, sizeof text) && !strstr(text, "occluded"))
		fail_msg("resumed: %s", text);
	d->id++;
	assert_false(chain_path.resume(d, &s));
	d->id--;
	assert_true(chain_path.resume(d, &s));
	mem_free(s.bytes);
}

/* Every byte may be anything: mostly refused, never believed where it names what is not there. */
static size_t check_changed(const struct chain *c, struct chain *d, struct dice *dice)
{
	static struct whole_path x;
	struct chain_state s;
	size_t refused = 0;
	char text[200];
	assert_int_equal(chain_path.save(c, &s), 0);
	for (int i = 0; i < 200; i++) {
		uint8_t *copy = mem_alloc(s.size, 1);
		memcpy(copy, s.bytes, s.size);
		for (int k = 0; k <= i % 3; k++)
			copy[CHAIN_STATE_HEAD + dice_below(dice, s.size - CHAIN_STATE_HEAD)] ^= (uint8_t)(1u << dice_below(dice, 8));
		struct chain_state changed = {copy, i % 7 == 0 ? s.size - 1 - dice_below(dice, 40) : s.size};
		if (!chain_path.resume(d, &changed)) {
			refused++;
		} else if (path_read(&context, copy + CHAIN_STATE_HEAD, changed.size - CHAIN_STATE_HEAD, &x) && x.edges) {
			/* What it may break: occlusion and exactly specular directions are not asked again. */
			if (!path_check(&context, &x, text, sizeof text) && !strstr(text, "occluded") && !strstr(text, "specular"))
				fail_msg("changed: %s", text);
			steps(d, 3);
		}
		mem_free(copy);
	}
	mem_free(s.bytes);
	return refused;
}

static void check_room(const struct room *room)
{
	struct chain *c = test_malloc(chain_path.size), *d = test_malloc(chain_path.size);
	struct plan plan = {.width = SIDE, .height = SIDE, .crop_width = SIDE, .crop_height = SIDE};
	struct scene_settings settings = {.width = SIDE, .height = SIDE, .filter = FILTER_BOX, .filter_radius = 0.5};
	struct film_sums a, b, waste;
	struct world *w = room->build();
	struct dice dice = dice_of(room->name);
	starts_context(&context, w, 1, EDGES, counters);
	assert_int_equal(film_sums_init(&a, &plan, &settings, NULL), 0);
	assert_int_equal(film_sums_init(&b, &plan, &settings, NULL), 0);
	assert_int_equal(film_sums_init(&waste, &plan, &settings, NULL), 0);
	begin(c, &a);
	begin(d, &b);
	start(c);
	steps(c, 50);
	memset(a.xyz, 0, (size_t)SIDE * SIDE * 3 * sizeof *a.xyz);
	size_t refused = 0;
	for (int epoch = 0; epoch < 20; epoch++) {
		check_resume(c, d);
		steps(c, 40);
		steps(d, 40);
		assert_true(same_state(c, d));
		d->film = &waste;
		refused += check_changed(c, d, &dice);
		d->film = &b;
	}
	assert_memory_equal(a.xyz, b.xyz, (size_t)SIDE * SIDE * 3 * sizeof *a.xyz);
	assert_true(refused > 20 * 200 / 3);
	film_sums_fini(&a);
	film_sums_fini(&b);
	film_sums_fini(&waste);
	test_free(c);
	test_free(d);
	world_free(w);
}

static void test_states(void **state)
{
	(void)state;
	for (const struct room *r = rooms; r->name; r++)
		check_room(r);
}

/* Nothing to start from: the chain looks for light, and its state is as small as can be. */
static void test_black(void **state)
{
	(void)state;
	struct chain *c = test_malloc(chain_path.size);
	struct plan plan = {.width = SIDE, .height = SIDE, .crop_width = SIDE, .crop_height = SIDE};
	struct scene_settings settings = {.width = SIDE, .height = SIDE, .filter = FILTER_BOX, .filter_radius = 0.5};
	struct film_sums film;
	struct chain_state s;
	struct world *w = rooms[0].build();
	starts_context(&context, w, 1, EDGES, counters);
	assert_int_equal(film_sums_init(&film, &plan, &settings, NULL), 0);
	begin(c, &film);
	assert_true(chain_path.start(c, UINT64_MAX));
	assert_int_equal(chain_path.save(c, &s), 0);
	assert_int_equal(s.size, CHAIN_STATE_HEAD + 8);
	assert_true(chain_path.resume(c, &s));
	mem_free(s.bytes);
	steps(c, 200);
	assert_int_equal(chain_path.save(c, &s), 0);
	/* A wavelength and a point of the aperture only where the scene has them. */
	uint32_t without = CHAIN_STATE_HEAD + 8 + (w->effects.colour ? 8u : 0) + (w->effects.aperture ? 40u : 0);
	assert_true(s.size > without && (s.size - without) % 40 == 0);
	mem_free(s.bytes);
	film_sums_fini(&film);
	test_free(c);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_states), cmocka_unit_test(test_black)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
