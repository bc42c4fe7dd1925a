/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/live_job/digest.h"

#include "common/base/mem.h"
#include "common/blob/blob.h"

#include <string.h>

/* Digests of the parts of a result, which are hashed together at the end: one each for the groups of numbers, for the
 * place and the values of each tile, for each state, for weights and for moments. */
struct parts {
	struct blob_hash *hashes;
	size_t count;
};

static int add_part(struct parts *p, const void *bytes, size_t size, struct error *e)
{
	return blob_hash_bytes(size ? bytes : "", size, &p->hashes[p->count++], e);
}

/* Hashes the numbers field by field, because padding is undefined. */
static int add_numbers(struct parts *p, const struct batch *b, struct error *e)
{
	const uint64_t counts[] = {b->key.job,	    (uint64_t)b->key.kind, b->key.group,   b->key.part,
				   b->key.epoch,    b->tile_count,	   b->state_count, b->strategy_count,
				   b->weight_count, b->moment_count};
	const double sums[] = {b->independent_sum, b->independent_square, b->overlong_sum};
	int rc = add_part(p, counts, sizeof counts, e);
	if (!rc)
		rc = add_part(p, b->counters, sizeof b->counters, e);
	if (!rc)
		rc = add_part(p, b->strategies, b->strategy_count * sizeof *b->strategies, e);
	if (!rc)
		rc = add_part(p, sums, sizeof sums, e);
	return rc ? rc : add_part(p, b->classes, sizeof b->classes, e);
}

static int add_tile(struct parts *p, const struct tile *t, struct error *e)
{
	const uint32_t rectangle[] = {t->x, t->y, t->width, t->height};
	int rc = add_part(p, rectangle, sizeof rectangle, e);
	return rc ? rc : add_part(p, t->xyz, (size_t)t->width * t->height * TILE_CHANNELS * sizeof *t->xyz, e);
}

int digest_batch(const struct batch *b, struct batch_digest *out, struct error *e)
{
	enum { NUMBERS = 5, ARRAYS = 2 };
	struct parts p = {mem_alloc(NUMBERS + 2 * (size_t)b->tile_count + b->state_count + ARRAYS, sizeof *p.hashes),
			  0};
	struct blob_hash combined;
	if (!p.hashes)
		return error_set(e, ENOMEM, "no memory for a digest");
	int rc = add_numbers(&p, b, e);
	for (uint32_t i = 0; !rc && i < b->tile_count; i++)
		rc = add_tile(&p, &b->tiles[i], e);
	for (uint32_t i = 0; !rc && i < b->state_count; i++)
		rc = add_part(&p, b->states[i].bytes, b->states[i].size, e);
	if (!rc)
		rc = add_part(&p, b->weights, b->weight_count * sizeof *b->weights, e);
	if (!rc)
		rc = add_part(&p, b->moments, b->moment_count * sizeof *b->moments, e);
	if (!rc)
		rc = blob_hash_bytes(p.hashes, p.count * sizeof *p.hashes, &combined, e);
	mem_free(p.hashes);
	_Static_assert(sizeof combined.bytes == sizeof out->bytes, "SHA-256 both");
	if (!rc)
		memcpy(out->bytes, combined.bytes, sizeof out->bytes);
	return rc ? -ENOMEM : 0;
}
