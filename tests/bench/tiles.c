/* SPDX-License-Identifier: Apache-2.0 */
/* The coordinator's work on each pixel of a partial result: decoding the EXR tiles, checking the batch, adding it to
 * the film. */
#include "common/base/mem.h"
#include "common/film/canvas.h"
#include "common/exr/exr_tile.h"
#include "tests/bench/bench.h"
#include "worker/render/math/rng.h"

#include <string.h>

enum { SIDE = 512, TILES_PER_ROW = SIDE / TILE_SIZE, TILES = TILES_PER_ROW * TILES_PER_ROW, PARTS = 4, GROUPS = 4 };

struct wire_tile {
	unsigned char *bytes;
	size_t size;
};

static void write_tiles(struct wire_tile *out)
{
	static float xyz[TILE_SIZE * TILE_SIZE * TILE_CHANNELS];
	struct error e;
	for (uint32_t t = 0; t < TILES; t++) {
		for (size_t i = 0; i < sizeof xyz / sizeof *xyz; i += 4) {
			double u[4];
			rng_uniform4(0, RNG_TEST, t, i, 0, u);
			for (size_t k = 0; k < 4; k++)
				xyz[i + k] = (float)u[k];
		}
		struct tile tile = {t % TILES_PER_ROW * TILE_SIZE, t / TILES_PER_ROW * TILE_SIZE, TILE_SIZE, TILE_SIZE,
				    xyz};
		if (exr_tile_write(&tile, SIDE, SIDE, &out[t].bytes, &out[t].size, &e))
			bench_die(&e);
	}
}

struct times {
	double decode, check, add;
};

static void time_merge(struct canvas *c, const struct plan *p, const struct wire_tile *wire, struct lease_key key,
		       struct times *t)
{
	static struct tile tiles[TILES];
	struct error e;
	struct batch b = {.key = key, .tile_count = TILES, .tiles = tiles};
	uint64_t samples = p->epoch * SIDE * (SIDE / PARTS);
	b.counters[COUNT_SAMPLES] = b.counters[COUNT_INDEPENDENT] = samples;
	double begin = bench_cpu_seconds();
	for (uint32_t i = 0; i < TILES; i++)
		if (exr_tile_read(wire[i].bytes, wire[i].size, SIDE, SIDE, &tiles[i], &e))
			bench_die(&e);
	double decoded = bench_cpu_seconds();
	if (batch_check(&b, p, &e))
		bench_die(&e);
	double checked = bench_cpu_seconds();
	if (canvas_add(c, &b, &e))
		bench_die(&e);
	double added = bench_cpu_seconds();
	t->decode += decoded - begin;
	t->check += checked - decoded;
	t->add += added - checked;
	for (uint32_t i = 0; i < TILES; i++)
		mem_free(tiles[i].xyz);
}

void bench_tiles(const char *bin)
{
	(void)bin;
	static struct wire_tile wire[TILES];
	struct plan p = {.integrator = "path",
			 .kind = PLAN_SAMPLES,
			 .width = SIDE,
			 .height = SIDE,
			 .crop_width = SIDE,
			 .crop_height = SIDE,
			 .groups = GROUPS,
			 .parts = PARTS,
			 .epoch = 1,
			 .rounds = 1 << 20,
			 .min_depth = 1,
			 .max_depth = 8};
	struct canvas *c;
	struct error e;
	mem_retain_freed(16 << 20); /* the same setting as in the coordinator */
	write_tiles(wire);
	if (canvas_new(&c, &p, -30, NULL, &e))
		bench_die(&e);
	bench_group(
		"tiles",
		"decoding, checking and adding full tiles, 3 float channels, one core; each round's closing included");
	struct series all = {0}, decode = {0}, check = {0}, add = {0};
	for (uint64_t round = 0; round < 2 + BENCH_REPEATS; round++) {
		struct times t = {0};
		for (uint32_t i = 0; i < GROUPS * PARTS; i++)
			time_merge(c, &p, wire, (struct lease_key){1, LEASE_RENDER, i % GROUPS, i / GROUPS, round}, &t);
		double pixels = 1e-6 * SIDE * SIDE * GROUPS * PARTS;
		if (round < 2) /* touches each page of the films for the first time */
			continue;
		series_add(&all, pixels / (t.decode + t.check + t.add));
		series_add(&decode, pixels / t.decode);
		series_add(&check, pixels / t.check);
		series_add(&add, pixels / t.add);
	}
	bench_row("decode, check and add", &all, "million pixels/s", BENCH_AT_LEAST, 100);
	bench_row("decode (exr_tile_read)", &decode, "million pixels/s", BENCH_NO_TARGET, 0);
	bench_row("check (batch_check)", &check, "million pixels/s", BENCH_NO_TARGET, 0);
	bench_row("add (canvas_add)", &add, "million pixels/s", BENCH_NO_TARGET, 0);
	canvas_free(c);
	for (uint32_t i = 0; i < TILES; i++)
		mem_free(wire[i].bytes);
}
