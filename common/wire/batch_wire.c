/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Converts batches and grants to frames and back. Packing first encodes the tiles and adds up the sizes, then allocates
 * one frame and writes the message and the payload into it. Unpacking cuts the payload into pieces by the sizes in the
 * message, each of which is checked against the bytes that remain, and decodes tiles and states into a batch or grant
 * that owns its memory.
 *
 * Failures: -EBADMSG for sizes that contradict each other or the plan, and for states that do not match their digest;
 * -ENOMEM. The batch or grant is empty after a failure.
 */
#include "common/wire/batch_wire.h"

#include "common/base/bytes.h"
#include "common/base/mem.h"
#include "common/exr/exr_tile.h"

#include <assert.h>
#include <string.h>

enum { PAYLOAD_MAX = 1 << 30 };

static uint32_t chains_per_lease(const struct plan *p)
{
	return p->kind == PLAN_CHAINS ? p->chains / (p->groups * p->parts) : 0;
}

uint32_t chain_states_payload_max(const struct plan *p)
{
	uint64_t n = (uint64_t)chains_per_lease(p) * chain_state_max_bytes(p);
	return n < PAYLOAD_MAX ? (uint32_t)n : PAYLOAD_MAX;
}

static uint64_t max_tile_count(const struct plan *p)
{
	uint64_t across = (p->crop_width + TILE_SIZE - 1) / TILE_SIZE,
		 down = (p->crop_height + TILE_SIZE - 1) / TILE_SIZE;
	return across * down;
}

uint32_t batch_payload_max(const struct plan *p)
{
	uint64_t tiles = max_tile_count(p) * exr_tile_size_max(TILE_SIZE, TILE_SIZE);
	uint64_t moments = batch_moment_count(p, LEASE_RENDER) * sizeof(float);
	uint64_t render = tiles + chain_states_payload_max(p) + moments;
	uint64_t weights = p->bootstrap / ((uint64_t)p->groups * p->parts) * sizeof(float);
	uint64_t n = render > weights ? render : weights;
	return n < PAYLOAD_MAX ? (uint32_t)n : PAYLOAD_MAX;
}

/* ---- digests of chain states ---- */

int chain_states_digest(const struct chain_state *states, uint32_t count, struct blob_hash *out, struct error *e)
{
	struct blob_hash *digests = mem_alloc(count, sizeof *digests);
	if (!digests)
		return error_set(e, ENOMEM, "no memory for a digest of %u chain states", count);
	int rc = 0;
	for (uint32_t i = 0; i < count && !rc; i++)
		rc = blob_hash_bytes(states[i].size ? (const void *)states[i].bytes : "", states[i].size, &digests[i],
				     e);
	if (!rc)
		rc = blob_hash_bytes(digests, count * sizeof *digests, out, e);
	mem_free(digests);
	return rc ? -ENOMEM : 0;
}

/* Computes the digest of the states for a message, which points to *h. Without states the message has no digest. */
static int digest_to_wire(const struct chain_state *states, uint32_t count, struct blob_hash *h,
			  ProtobufCBinaryData *out, struct error *e)
{
	if (count == 0)
		return 0;
	*out = (ProtobufCBinaryData){sizeof h->bytes, h->bytes};
	return chain_states_digest(states, count, h, e);
}

int chain_states_digest_from_wire(const ProtobufCBinaryData *m, struct blob_hash *out, struct error *e)
{
	if (m->len != sizeof out->bytes)
		return error_set(e, EBADMSG, "a digest of chain states with %zu bytes", m->len);
	memcpy(out->bytes, m->data, sizeof out->bytes);
	return 0;
}

/* Computes the digest of the states and compares it with that in the message. */
static int check_digest(const struct chain_state *states, uint32_t count, const ProtobufCBinaryData *m,
			struct blob_hash *out, struct error *e)
{
	struct blob_hash stated;
	int rc = chain_states_digest_from_wire(m, &stated, e);
	if (!rc)
		rc = chain_states_digest(states, count, out, e);
	return rc || blob_hash_equal(&stated, out)
		       ? rc
		       : error_set(e, EBADMSG, "the chain states do not match their digest");
}

/* ---- packing ---- */

struct packing {
	unsigned char **tile_bytes;
	uint32_t *tile_sizes, *state_sizes;
	size_t payload_size;
};

static void packing_fini(struct packing *k, uint32_t tiles)
{
	for (uint32_t i = 0; k->tile_bytes && i < tiles; i++)
		mem_free(k->tile_bytes[i]);
	mem_free(k->tile_bytes);
	mem_free(k->tile_sizes);
	mem_free(k->state_sizes);
}

static int packing_init(struct packing *k, const struct batch *b, const struct plan *p, struct error *e)
{
	memset(k, 0, sizeof *k);
	k->tile_bytes = mem_alloc(b->tile_count, sizeof *k->tile_bytes);
	k->tile_sizes = mem_alloc(b->tile_count, sizeof *k->tile_sizes);
	k->state_sizes = mem_alloc(b->state_count, sizeof *k->state_sizes);
	if (!k->tile_bytes || !k->tile_sizes || !k->state_sizes)
		return error_set(e, ENOMEM, "no memory to pack a batch");
	for (uint32_t i = 0; i < b->tile_count; i++) {
		size_t n;
		int rc = exr_tile_write(&b->tiles[i], p->width, p->height, &k->tile_bytes[i], &n, e);
		if (rc)
			return rc;
		k->tile_sizes[i] = (uint32_t)n;
		k->payload_size += n;
	}
	for (uint32_t i = 0; i < b->state_count; i++) {
		k->state_sizes[i] = b->states[i].size;
		k->payload_size += b->states[i].size;
	}
	k->payload_size += (b->weight_count + b->moment_count) * sizeof(float);
	return 0;
}

static void write_payload(unsigned char *destination, const struct batch *b, const struct packing *k)
{
	for (uint32_t i = 0; i < b->tile_count; i++) {
		memcpy(destination, k->tile_bytes[i], k->tile_sizes[i]);
		destination += k->tile_sizes[i];
	}
	for (uint32_t i = 0; i < b->state_count; i++) {
		if (b->states[i].size)
			memcpy(destination, b->states[i].bytes, b->states[i].size);
		destination += b->states[i].size;
	}
	copy_numbers(destination, b->weights, sizeof(float), b->weight_count);
	copy_numbers(destination + b->weight_count * sizeof(float), b->moments, sizeof(float), b->moment_count);
}

int batch_pack(const struct batch *b, const struct plan *p, unsigned char **frame, size_t *size, struct error *e)
{
	struct packing k;
	uint64_t counters[BATCH_COUNTERS], strategy[BATCH_STRATEGIES][STRATEGY_COUNTERS];
	double classes[PATH_CLASSES];
	struct blob_hash digest;
	Farm__LeaseKey key;
	Farm__LeaseResult m;
	memcpy(counters, b->counters, sizeof counters);
	memcpy(strategy, b->strategies, sizeof strategy);
	memcpy(classes, b->classes, sizeof classes);
	int rc = packing_init(&k, b, p, e);
	if (!rc) {
		farm__lease_result__init(&m);
		lease_key_to_wire(&b->key, &key);
		m.key = &key;
		m.n_counters = BATCH_COUNTERS;
		m.counters = counters;
		m.n_strategies = (size_t)b->strategy_count * STRATEGY_COUNTERS;
		m.strategies = strategy[0];
		m.independent_sum = b->independent_sum;
		m.independent_square = b->independent_square;
		m.beyond_sum = b->overlong_sum;
		m.cpu_seconds = b->cpu_seconds;
		m.n_tile_sizes = b->tile_count;
		m.tile_sizes = k.tile_sizes;
		m.n_state_sizes = b->state_count;
		m.state_sizes = k.state_sizes;
		m.weight_count = b->weight_count;
		m.n_classes = PATH_CLASSES;
		m.classes = classes;
		m.moment_count = b->moment_count;
		rc = digest_to_wire(b->states, b->state_count, &digest, &m.states_digest, e);
	}
	if (!rc)
		rc = envelope_pack(ENVELOPE_OF(LEASE_RESULT, lease_result, &m), NULL, k.payload_size, frame, size, e);
	if (!rc)
		write_payload(*frame + *size - k.payload_size, b, &k);
	packing_fini(&k, b->tile_count);
	return rc;
}

/* ---- unpacking ---- */

/* The part of a payload that has not been used yet. */
struct payload_reader {
	const unsigned char *next;
	size_t remaining;
};

/* The pointer must not be NULL even if there is no payload: read_bytes returns it for states of 0 bytes. */
static struct payload_reader payload_reader_from(const unsigned char *payload, size_t size)
{
	static const unsigned char empty[1];
	return (struct payload_reader){payload ? payload : empty, size};
}

/* Cuts `size` bytes off the front of the payload; NULL if it has fewer. */
static const unsigned char *read_bytes(struct payload_reader *c, size_t size)
{
	if (size > c->remaining)
		return NULL;
	const unsigned char *p = c->next;
	c->next += size;
	c->remaining -= size;
	return p;
}

static int read_states(struct payload_reader *c, const uint32_t *sizes, size_t count, struct chain_state **out,
		       struct error *e)
{
	struct chain_state *states = mem_alloc(count, sizeof *states);
	*out = states;
	if (!states)
		return error_set(e, ENOMEM, "no memory for %zu chain states", count);
	for (size_t i = 0; i < count; i++) {
		const unsigned char *from = sizes[i] <= CHAIN_STATE_MAX ? read_bytes(c, sizes[i]) : NULL;
		if (!from)
			return error_set(e, EBADMSG, "chain state %zu of %u bytes does not fit", i, sizes[i]);
		if (sizes[i] == 0)
			continue;
		states[i].bytes = mem_alloc(sizes[i], 1);
		if (!states[i].bytes)
			return error_set(e, ENOMEM, "no memory for a chain state");
		memcpy(states[i].bytes, from, sizes[i]);
		states[i].size = sizes[i];
	}
	return 0;
}

static int read_tiles(struct payload_reader *c, const Farm__LeaseResult *m, const struct plan *p, struct batch *b,
		      struct error *e)
{
	b->tiles = mem_alloc(m->n_tile_sizes, sizeof *b->tiles);
	if (!b->tiles)
		return error_set(e, ENOMEM, "no memory for %zu tiles", m->n_tile_sizes);
	for (size_t i = 0; i < m->n_tile_sizes; i++) {
		const unsigned char *from = read_bytes(c, m->tile_sizes[i]);
		if (!from)
			return error_set(e, EBADMSG, "tile %zu of %u bytes does not fit", i, m->tile_sizes[i]);
		int rc = exr_tile_read(from, m->tile_sizes[i], p->width, p->height, &b->tiles[i], e);
		if (rc)
			return error_prefix(e, rc, "tile %zu", i);
		b->tile_count++;
	}
	return 0;
}

static int read_floats(struct payload_reader *c, const char *noun, uint64_t count, float **out, uint64_t *out_count,
		       struct error *e)
{
	if (count > c->remaining / sizeof(float))
		return error_set(e, EBADMSG, "%llu %s do not fit the payload", (unsigned long long)count, noun);
	if (count == 0)
		return 0;
	*out = mem_alloc(count, sizeof **out);
	if (!*out)
		return error_set(e, ENOMEM, "no memory for %llu %s", (unsigned long long)count, noun);
	copy_numbers(*out, read_bytes(c, count * sizeof(float)), sizeof(float), count);
	*out_count = count;
	return 0;
}

int batch_unpack(struct batch *b, const struct plan *p, const Farm__LeaseResult *m, const unsigned char *payload,
		 size_t payload_size, struct error *e)
{
	struct payload_reader c = payload_reader_from(payload, payload_size);
	struct blob_hash digest;
	memset(b, 0, sizeof *b);
	int rc = lease_key_from_wire(m->key, &b->key, e);
	if (!rc && m->n_counters != BATCH_COUNTERS)
		rc = error_set(e, EBADMSG, "a batch with %zu counters", m->n_counters);
	if (!rc && (m->n_strategies % STRATEGY_COUNTERS || m->n_strategies > BATCH_STRATEGIES * STRATEGY_COUNTERS))
		rc = error_set(e, EBADMSG, "a batch with %zu counters of strategies", m->n_strategies);
	if (!rc && m->n_classes != PATH_CLASSES)
		rc = error_set(e, EBADMSG, "a batch with %zu path classes", m->n_classes);
	/* Counts are checked against the plan before memory is allocated for them, and before a message with thousands
	 * of tiny tiles costs time. */
	if (!rc && m->n_tile_sizes > max_tile_count(p))
		rc = error_set(e, EBADMSG, "a batch with %zu tiles", m->n_tile_sizes);
	if (!rc && m->n_state_sizes > chains_per_lease(p))
		rc = error_set(e, EBADMSG, "a batch with %zu chain states", m->n_state_sizes);
	if (!rc) {
		memcpy(b->counters, m->counters, sizeof b->counters);
		b->strategy_count = (uint32_t)(m->n_strategies / STRATEGY_COUNTERS);
		if (m->n_strategies)
			memcpy(b->strategies, m->strategies, m->n_strategies * sizeof *m->strategies);
		b->independent_sum = m->independent_sum;
		b->independent_square = m->independent_square;
		b->overlong_sum = m->beyond_sum;
		b->cpu_seconds = m->cpu_seconds;
		memcpy(b->classes, m->classes, sizeof b->classes);
		rc = read_tiles(&c, m, p, b, e);
	}
	if (!rc) {
		b->state_count = (uint32_t)m->n_state_sizes;
		rc = read_states(&c, m->state_sizes, m->n_state_sizes, &b->states, e);
	}
	if (!rc && m->states_digest.len)
		rc = check_digest(b->states, b->state_count, &m->states_digest, &digest, e);
	if (!rc)
		rc = read_floats(&c, "weights", m->weight_count, &b->weights, &b->weight_count, e);
	if (!rc)
		rc = read_floats(&c, "moments", m->moment_count, &b->moments, &b->moment_count, e);
	if (!rc && c.remaining)
		rc = error_set(e, EBADMSG, "%zu extra bytes after a batch", c.remaining);
	if (!rc)
		rc = batch_check(b, p, e);
	if (rc)
		batch_fini(b);
	return rc;
}

const unsigned char *batch_tile_bytes(const Farm__LeaseResult *m, const unsigned char *payload, size_t index,
				      size_t *size)
{
	for (size_t i = 0; i < index; i++)
		payload += m->tile_sizes[i];
	*size = m->tile_sizes[index];
	return payload;
}

/* ---- grants ---- */

int grant_pack(const struct lease_key *k, const uint64_t *seeds, const struct chain_state *states, uint32_t chain_count,
	       unsigned char **frame, size_t *size, struct error *e)
{
	Farm__LeaseKey key;
	Farm__LeaseGrant m;
	farm__lease_grant__init(&m);
	struct blob_hash digest;
	uint64_t *seed_copy = seeds ? mem_alloc(chain_count, sizeof *seed_copy) : NULL;
	uint32_t *sizes = states ? mem_alloc(chain_count, sizeof *sizes) : NULL;
	size_t payload = 0;
	int rc = (seeds && !seed_copy) || (states && !sizes) ? error_set(e, ENOMEM, "no memory to pack a lease") : 0;
	if (!rc) {
		if (seeds)
			memcpy(seed_copy, seeds, chain_count * sizeof *seeds);
		for (uint32_t i = 0; states && i < chain_count; i++)
			payload += sizes[i] = states[i].size;
		lease_key_to_wire(k, &key);
		m.key = &key;
		m.n_seeds = seeds ? chain_count : 0;
		m.seeds = seed_copy;
		m.n_state_sizes = states ? chain_count : 0;
		m.state_sizes = sizes;
		rc = digest_to_wire(states, states ? chain_count : 0, &digest, &m.states_digest, e);
	}
	if (!rc)
		rc = envelope_pack(ENVELOPE_OF(LEASE_GRANT, lease_grant, &m), NULL, payload, frame, size, e);
	if (!rc && states) {
		unsigned char *destination = *frame + *size - payload;
		for (uint32_t i = 0; i < chain_count; destination += states[i++].size)
			if (states[i].size)
				memcpy(destination, states[i].bytes, states[i].size);
	}
	mem_free(seed_copy);
	mem_free(sizes);
	return rc;
}

int grant_unpack(struct grant *g, const Farm__LeaseGrant *m, const unsigned char *payload, size_t payload_size,
		 struct error *e)
{
	struct payload_reader c = payload_reader_from(payload, payload_size);
	memset(g, 0, sizeof *g);
	int rc = lease_key_from_wire(m->key, &g->key, e);
	if (!rc && m->n_seeds && m->n_state_sizes)
		rc = error_set(e, EBADMSG, "a lease with both seeds and states");
	if (!rc && m->n_seeds) {
		g->seeds = mem_alloc(m->n_seeds, sizeof *g->seeds);
		if (!g->seeds)
			rc = error_set(e, ENOMEM, "no memory for %zu seeds", m->n_seeds);
		else
			memcpy(g->seeds, m->seeds, m->n_seeds * sizeof *g->seeds);
		g->chain_count = (uint32_t)m->n_seeds;
	}
	if (!rc && m->n_state_sizes) {
		g->chain_count = (uint32_t)m->n_state_sizes;
		rc = read_states(&c, m->state_sizes, m->n_state_sizes, &g->states, e);
		if (!rc)
			rc = check_digest(g->states, g->chain_count, &m->states_digest, &g->digest, e);
	}
	if (!rc && c.remaining)
		rc = error_set(e, EBADMSG, "%zu extra bytes after a lease", c.remaining);
	if (rc)
		grant_fini(g);
	return rc;
}

void grant_fini(struct grant *g)
{
	mem_free(g->seeds);
	chain_states_free(g->states, g->chain_count);
	memset(g, 0, sizeof *g);
}

void chain_states_free(struct chain_state *states, uint32_t count)
{
	for (uint32_t i = 0; states && i < count; i++)
		mem_free(states[i].bytes);
	mem_free(states);
}

struct blob_hash file_hash_from_wire(const Farm__File *f)
{
	struct blob_hash h;
	assert(f->hash.len == BLOB_HASH_SIZE);
	memcpy(h.bytes, f->hash.data, BLOB_HASH_SIZE);
	return h;
}
