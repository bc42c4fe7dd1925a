/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/load/load.h"

#include "common/base/mem.h"

#include <string.h>

enum { STATE_BYTES = 1024 };

struct prepared_result {
	struct envelope env; /* the message; only its key changes */
	unsigned char *frame;
	const unsigned char *payload;
	size_t payload_size;
};

struct load_content {
	struct prepared_result bootstrap, render;
};

static void prepare_result(struct prepared_result *k, const struct batch *b, const struct plan *p)
{
	struct error e;
	size_t size;
	struct batch parsed;
	if (batch_check(b, p, &e) || batch_pack(b, p, &k->frame, &size, &e))
		load_die("the batch: %s", e.text);
	uint32_t header =
		(uint32_t)k->frame[0] << 24 | (uint32_t)k->frame[1] << 16 | (uint32_t)k->frame[2] << 8 | k->frame[3];
	if (envelope_unpack(&k->env, k->frame + FRAME_PREFIX_SIZE, header, &e))
		load_die("the batch: %s", e.text);
	k->payload = k->frame + FRAME_PREFIX_SIZE + header;
	k->payload_size = size - FRAME_PREFIX_SIZE - header;
	if (batch_unpack(&parsed, p, k->env.message->lease_result, k->payload, k->payload_size, &e))
		load_die("the batch: %s", e.text);
	batch_fini(&parsed);
}

static void *alloc_or_die(size_t count, size_t size)
{
	void *p = mem_alloc(count, size);
	if (!p)
		load_die("no memory for a batch");
	return p;
}

/* Makes every tile of the film, as a chain that went everywhere leaves them. */
static void make_tiles(struct batch *b, const struct plan *p)
{
	float mean = (float)((double)p->epoch / (double)plan_extended_pixels(p));
	uint32_t count = batch_film_tile_count(p), random = 1;
	b->tiles = alloc_or_die(count, sizeof *b->tiles);
	for (uint32_t y = 0; y < p->crop_height; y += TILE_SIZE)
		for (uint32_t x = 0; x < p->crop_width; x += TILE_SIZE) {
			struct tile *t = &b->tiles[b->tile_count++];
			*t = (struct tile){x, y, p->crop_width - x < TILE_SIZE ? p->crop_width - x : TILE_SIZE,
					   p->crop_height - y < TILE_SIZE ? p->crop_height - y : TILE_SIZE, NULL};
			size_t n = (size_t)t->width * t->height * TILE_CHANNELS;
			t->xyz = alloc_or_die(n, sizeof *t->xyz);
			for (size_t i = 0; i < n; i++) {
				random = random * 1664525u + 1013904223u;
				t->xyz[i] = mean * (float)(random >> 8) * 0x1p-23f;
			}
		}
}

static void make_render_result(struct prepared_result *k, const struct plan *p)
{
	struct batch b = {.key = {1, LEASE_RENDER, 0, 0, 0}};
	uint32_t chains = p->chains / (p->groups * p->parts);
	make_tiles(&b, p);
	b.counters[COUNT_SAMPLES] = chains * p->epoch;
	b.counters[COUNT_ACCEPTED] = b.counters[COUNT_SAMPLES] / 2;
	b.strategy_count = (uint32_t)plan_strategy_count(p->mutations);
	for (uint32_t i = 0; i < b.strategy_count; i++)
		b.strategies[i][STRATEGY_PROPOSED] = b.counters[COUNT_SAMPLES] / b.strategy_count;
	b.classes[0] = 0.5 * (double)b.counters[COUNT_SAMPLES];
	b.cpu_seconds = 20;
	b.state_count = chains;
	b.states = alloc_or_die(chains, sizeof *b.states);
	for (uint32_t i = 0; i < chains; i++) {
		b.states[i].bytes = alloc_or_die(STATE_BYTES, 1);
		b.states[i].size = STATE_BYTES;
	}
	b.moment_count = batch_moment_count(p, LEASE_RENDER);
	b.moments = alloc_or_die(b.moment_count, sizeof *b.moments);
	uint64_t tiles = batch_film_tile_count(p), sequences = batch_sequence_count(p);
	for (uint64_t i = 0; i < sequences * tiles; i++)
		b.moments[i] = 0.9f * (float)p->epoch / (float)tiles;
	for (uint64_t i = 0; i < tiles; i++)
		b.moments[sequences * tiles + i] = 0.5f * (float)p->epoch / (float)tiles;
	prepare_result(k, &b, p);
	batch_fini(&b);
}

static void make_bootstrap_result(struct prepared_result *k, const struct plan *p)
{
	struct batch b = {.key = {1, LEASE_BOOTSTRAP, 0, 0, 0}};
	struct plan_range r = plan_bootstrap_range(p, 0, 0);
	b.weight_count = r.end - r.begin;
	b.weights = alloc_or_die(b.weight_count, sizeof *b.weights);
	for (uint64_t i = 0; i < b.weight_count; i++) {
		b.weights[i] = 1 + 0.5f * (float)(i % 3);
		b.independent_sum += (double)b.weights[i];
		b.independent_square += (double)b.weights[i] * (double)b.weights[i];
	}
	b.counters[COUNT_INDEPENDENT] = b.weight_count;
	b.classes[0] = 0.5 * b.independent_sum;
	prepare_result(k, &b, p);
	batch_fini(&b);
}

struct load_content *load_content_new(const struct plan *p)
{
	struct load_content *c = alloc_or_die(1, sizeof *c);
	make_bootstrap_result(&c->bootstrap, p);
	make_render_result(&c->render, p);
	return c;
}

void load_content_free(struct load_content *c)
{
	if (!c)
		return;
	struct prepared_result *kinds[] = {&c->bootstrap, &c->render};
	for (int i = 0; i < 2; i++) {
		envelope_fini(&kinds[i]->env);
		mem_free(kinds[i]->frame);
	}
	mem_free(c);
}

size_t load_content_payload_bytes(const struct load_content *c)
{
	return c->render.payload_size;
}

unsigned char *load_content_frame(const struct load_content *c, const struct lease_key *k, size_t *size)
{
	const struct prepared_result *kind = k->kind == LEASE_BOOTSTRAP ? &c->bootstrap : &c->render;
	Farm__LeaseKey key;
	unsigned char *frame;
	struct error e;
	lease_key_to_wire(k, &key);
	kind->env.message->lease_result->key->job = key.job;
	kind->env.message->lease_result->key->kind = key.kind;
	kind->env.message->lease_result->key->group = key.group;
	kind->env.message->lease_result->key->part = key.part;
	kind->env.message->lease_result->key->epoch = key.epoch;
	if (envelope_pack(kind->env.message, kind->payload, kind->payload_size, &frame, size, &e))
		load_die("the batch: %s", e.text);
	return frame;
}
