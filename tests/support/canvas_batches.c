/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/canvas_batches.h"

#include "common/base/mem.h"
#include "common/film/canvas_films.h"

#include <math.h>

uint64_t canvas_random_state;

uint64_t canvas_random_next(void)
{
	canvas_random_state ^= canvas_random_state << 13;
	canvas_random_state ^= canvas_random_state >> 7;
	return canvas_random_state ^= canvas_random_state << 17;
}

double canvas_random_uniform(void)
{
	return (double)(canvas_random_next() >> 11) * 0x1p-53;
}

double canvas_random_normal(void)
{
	return sqrt(-2 * log(1 - canvas_random_uniform())) * cos(6.283185307179586 * canvas_random_uniform());
}

struct plan canvas_test_plan(enum plan_kind kind, uint32_t width, uint32_t height, uint32_t groups, uint32_t parts)
{
	struct plan p = {.integrator = "path",
			 .kind = kind,
			 .width = width + 3,
			 .height = height + 2,
			 .crop_x = 3,
			 .crop_y = 2,
			 .crop_width = width,
			 .crop_height = height,
			 .groups = groups,
			 .parts = parts,
			 .epoch = 4,
			 .rounds = UINT64_MAX,
			 .seconds = 1,
			 .max_depth = 8};
	p.bootstrap = (uint64_t)groups * parts * 8;
	if (kind == PLAN_CHAINS)
		p.chains = groups * parts * 2;
	return p;
}

struct tile canvas_test_tile(const struct plan *p, uint32_t i, float (*value)(void))
{
	uint32_t tiles_per_row = (p->crop_width + TILE_SIZE - 1) / TILE_SIZE;
	uint32_t x = i % tiles_per_row * TILE_SIZE, y = i / tiles_per_row * TILE_SIZE;
	uint32_t w = p->crop_width - x < TILE_SIZE ? p->crop_width - x : TILE_SIZE;
	uint32_t h = p->crop_height - y < TILE_SIZE ? p->crop_height - y : TILE_SIZE;
	struct tile t = {p->crop_x + x, p->crop_y + y, w, h, mem_alloc((size_t)w * h * 3, sizeof(float))};
	for (size_t k = 0; k < (size_t)w * h * 3; k++)
		t.xyz[k] = value();
	return t;
}

struct batch canvas_test_batch(const struct plan *p, uint64_t epoch, uint32_t group, uint32_t part, uint32_t tiles,
			       float (*value)(void))
{
	struct batch b = {.key = {1, LEASE_RENDER, group, part, epoch}, .tile_count = tiles};
	struct plan_range rows = plan_row_range(p, part);
	b.tiles = mem_alloc(tiles, sizeof *b.tiles);
	for (uint32_t i = 0; i < tiles; i++)
		b.tiles[i] = canvas_test_tile(p, i, value);
	b.counters[COUNT_SAMPLES] = (rows.end - rows.begin) * p->crop_width * p->epoch;
	if (p->kind == PLAN_CHAINS) {
		b.state_count = 2;
		b.states = mem_alloc(2, sizeof *b.states);
		for (int i = 0; i < 2; i++) {
			b.states[i].bytes = mem_alloc(8, 1);
			b.states[i].size = 8;
		}
		b.counters[COUNT_SAMPLES] = 2 * p->epoch;
		b.counters[COUNT_INDEPENDENT] = p->epoch;
		b.independent_sum = canvas_random_uniform() * (double)p->epoch;
	}
	return b;
}

float canvas_test_one(void)
{
	return 1;
}

uint64_t canvas_merged_leases(const struct canvas *c)
{
	return c->rounds * c->plan.groups * c->plan.parts + c->merged_counts[0] + c->merged_counts[1] -
	       canvas_missing_count(c);
}
