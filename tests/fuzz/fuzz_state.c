/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chain states as a worker receives them, in real worlds: the first byte chooses the world, the others are the state.
 * Its id and step are corrected, and for every other input the contribution as well, as a forger would. A chain that
 * resumes must continue for some mutations, and the state that it saves then must resume again. Invalid operations are
 * not trapped, because clang generates some of its own. (tests/worker/render/chain/test_path_chain.c traps them.)
 */
#include "common/base/mem.h"
#include "tests/fuzz/seeds.h"
#include "tests/support/rooms.h"
#include "tests/support/starts.h"
#include "common/base/bytes.h"
#include "worker/render/chain/path_bytes.h"
#include "worker/render/chain/chain.h"
#include "worker/render/path/integrator.h"

#include <string.h>

#define chain_path (*integrator_find("hslt")->chain)
#define chain_pss (*integrator_find("pssmlt")->chain)

enum { SIDE = 32, EDGES = 8, STEPS = 5, WORLDS_MAX = 64, STATE_BYTES_MAX = 1 << 14, CHAIN_ID = 3 };
static const char mixture[] = "bidirectional=0.2,hslt=0.6,wavelength=0.1,lens=0.05,light=0.05";

static struct world *worlds[WORLDS_MAX];
static unsigned world_count;
static struct path_context context;
static struct film_sums film;
static struct chain *chain;
static uint64_t counters[BATCH_COUNTERS], strategies[BATCH_STRATEGIES][STRATEGY_COUNTERS];

static void set_up(void)
{
	static const struct plan plan = {.width = SIDE, .height = SIDE, .crop_width = SIDE, .crop_height = SIDE};
	static const struct scene_settings settings = {
		.width = SIDE, .height = SIDE, .filter = FILTER_BOX, .filter_radius = 0.5};
	while (world_count < WORLDS_MAX && rooms[world_count].name) {
		worlds[world_count] = rooms[world_count].build();
		world_count++;
	}
	chain = mem_alloc(1, chain_path.size > chain_pss.size ? chain_path.size : chain_pss.size);
	if (!chain || film_sums_init(&film, &plan, &settings, NULL))
		abort();
}

static const struct chain_ops *begin_chain(struct chain *c, unsigned index)
{
	bool is_path_chain = index / world_count % 2 == 0;
	starts_init_context(&context, worlds[index % world_count], 1, EDGES, counters);
	*c = (struct chain){.integrator = integrator_find(is_path_chain ? "hslt" : "pssmlt"),
			    .context = &context,
			    .film = &film,
			    .mixture = mixture,
			    .strategy_counters = strategies,
			    .seed = 7,
			    .id = CHAIN_ID,
			    .step = 1000};
	return c->integrator->chain;
}

static void continue_chain(struct chain *c, const struct chain_ops *ops)
{
	struct chain_sums sums = {0, 0};
	struct chain_state s = {0};
	for (int i = 0; i < STEPS; i++)
		ops->step(c, &sums);
	ops->flush(c);
	if (ops->save(c, &s) == 0 && !ops->resume(c, &s))
		abort();
	mem_free(s.bytes);
}

static void write_seeds(struct chain *c)
{
	for (unsigned number = 0; number < 2 * world_count; number++) {
		const struct chain_ops *ops = begin_chain(c, number);
		struct chain_state s;
		uint8_t bytes[1 + STATE_BYTES_MAX] = {(uint8_t)number};
		uint64_t index = 0;
		while (!ops->start(c, index))
			index++;
		continue_chain(c, ops);
		if (ops->save(c, &s) || s.size > STATE_BYTES_MAX)
			abort();
		memcpy(bytes + 1, s.bytes, s.size);
		seed_write_file("state", number, bytes, 1 + s.size);
		mem_free(s.bytes);
	}
}

static void correct_state(const struct chain *c, uint8_t *bytes, size_t size)
{
	static struct full_path x;
	double contribution;
	put64(bytes, CHAIN_ID);
	put64(bytes + 8, c->step);
	if (size < CHAIN_STATE_HEADER_BYTES + 16 || bytes[16] % 2)
		return;
	if (path_read_contribution(&context, bytes + CHAIN_STATE_HEADER_BYTES, size - CHAIN_STATE_HEADER_BYTES, &x,
				   &contribution))
		put_double(bytes + CHAIN_STATE_HEADER_BYTES + 8, contribution);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc;
	(void)argv;
	set_up();
	if (!seeds_are_requested())
		return 0;
	write_seeds(chain);
	exit(0);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	static uint8_t state[STATE_BYTES_MAX];
	if (size < 1 + CHAIN_STATE_HEADER_BYTES || size > 1 + STATE_BYTES_MAX)
		return 0;
	const struct chain_ops *ops = begin_chain(chain, bytes[0]);
	struct chain_state s = {state, (uint32_t)(size - 1)};
	memcpy(state, bytes + 1, s.size);
	correct_state(chain, state, s.size);
	if (ops->resume(chain, &s))
		continue_chain(chain, ops);
	memset(film.xyz, 0, (size_t)SIDE * SIDE * 3 * sizeof *film.xyz);
	return 0;
}
