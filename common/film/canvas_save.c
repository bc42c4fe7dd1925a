/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/canvas_save.h"

#include "common/base/bytes.h"
#include "common/film/canvas_films.h"
#include "common/film/canvas_moments.h"

#include <assert.h>
#include <string.h>

enum { VERSION = 2, HEAD_SIZE = 40, POSITION_SIZE = 8, TILES_END = UINT32_MAX };
enum {
	TALLY_SIZE = sizeof(uint64_t) * (BATCH_COUNTERS + BATCH_STRATEGIES * STRATEGY_COUNTERS +
					 PLAN_GROUPS_MAX * (2 + 2 * EXACT_SUM_WORDS))
};
/* Offsets in the head of the numbers that depend on the build, not on the plan. */
enum { VERSION_OFFSET = 0, TALLY_SIZE_OFFSET = 4, SLOT_VALUES_OFFSET = 28 };

/* Writes the head, which must be equal in the file and in the canvas that loads it. */
static void pack_head(const struct canvas *c, unsigned char bytes[HEAD_SIZE])
{
	put32(bytes + VERSION_OFFSET, VERSION);
	put32(bytes + TALLY_SIZE_OFFSET, TALLY_SIZE);
	put32(bytes + 8, c->plan.groups);
	put32(bytes + 12, c->plan.parts);
	put32(bytes + 16, c->tiles_across);
	put32(bytes + 20, c->tiles_down);
	put32(bytes + 24, c->plan.kind);
	put32(bytes + SLOT_VALUES_OFFSET, SLOT_VALUES);
	put_double(bytes + 32, c->quantum);
}

static size_t film_count(const struct canvas *c)
{
	return (size_t)c->plan.groups * FILMS_PER_GROUP;
}

static size_t lease_flag_count(const struct canvas *c)
{
	return (size_t)(1 + OPEN_ROUNDS) * c->plan.groups * c->plan.parts;
}

/* ---- everything but pixels and moments; the same functions write and read, so that the order is the same */

struct transfer {
	struct checked_file *file;
	bool is_writing;
	int rc; /* the first error; nothing is transferred after it */
	struct error *e;
};

static void transfer_numbers(struct transfer *t, void *numbers, size_t width, size_t count)
{
	if (!t->rc)
		t->rc = t->is_writing ? checked_file_write_numbers(t->file, numbers, width, count, t->e)
				      : checked_file_read_numbers(t->file, numbers, width, count, t->e);
}

static void transfer_u64(struct transfer *t, void *numbers, size_t count)
{
	transfer_numbers(t, numbers, sizeof(uint64_t), count);
}

static void transfer_tally(struct transfer *t, struct tally *y)
{
	transfer_u64(t, y->counts.counters, BATCH_COUNTERS);
	transfer_u64(t, y->counts.strategies, BATCH_STRATEGIES * STRATEGY_COUNTERS);
	for (uint32_t g = 0; g < PLAN_GROUPS_MAX; g++) {
		transfer_u64(t, &y->groups[g].samples, 1);
		transfer_u64(t, &y->groups[g].independent, 1);
		transfer_u64(t, y->groups[g].independent_sum.words, EXACT_SUM_WORDS);
		transfer_u64(t, y->groups[g].overlong_sum.words, EXACT_SUM_WORDS);
	}
}

static int transfer_all(struct transfer *t, struct canvas *c)
{
	transfer_u64(t, &c->rounds, 1);
	transfer_numbers(t, c->merged_counts, sizeof *c->merged_counts, OPEN_ROUNDS);
	transfer_numbers(t, c->is_merged, sizeof *c->is_merged, lease_flag_count(c));
	transfer_u64(t, c->sum_bounds, film_count(c));
	transfer_tally(t, &c->prefix_tally);
	for (int i = 0; i < OPEN_ROUNDS; i++)
		transfer_tally(t, &c->open_tallies[i]);
	transfer_tally(t, &c->bootstrap_tally);
	transfer_u64(t, &c->b_tail_index, 1);
	return t->rc;
}

/* ---- pixels */

static int write_tile_position(struct checked_file *out, uint32_t film, uint32_t tile, struct error *e)
{
	unsigned char bytes[POSITION_SIZE];
	put32(bytes, film);
	put32(bytes + 4, tile);
	return checked_file_write(out, bytes, sizeof bytes, e);
}

static int save_tiles(const struct canvas *c, struct checked_file *out, struct error *e)
{
	int rc = 0;
	for (size_t film = 0; film < film_count(c) && !rc; film++)
		for (size_t tile = 0; tile < canvas_tile_count(c) && !rc; tile++) {
			if (!(*canvas_tile_flags(c, film, tile) & TILE_USED))
				continue;
			rc = write_tile_position(out, (uint32_t)film, (uint32_t)tile, e);
			if (!rc)
				rc = checked_file_write_numbers(out, canvas_slot(c, film, tile), sizeof *c->sums,
								SLOT_VALUES, e);
		}
	return rc ? rc : write_tile_position(out, TILES_END, TILES_END, e);
}

int canvas_save(const struct canvas *c, struct checked_file *out, struct error *e)
{
	unsigned char head[HEAD_SIZE];
	struct canvas copy = *c; /* transfer_all takes a canvas that it could write to; it only reads this one */
	assert(canvas_missing_count(c) == 0);
	pack_head(c, head);
	int rc = checked_file_write(out, head, sizeof head, e);
	if (!rc)
		rc = transfer_all(&(struct transfer){out, true, 0, e}, &copy);
	if (!rc)
		rc = moments_save(c->moments, out, e);
	return rc ? rc : save_tiles(c, out, e);
}

/* Checks the counts of merged leases against the flags of the leases. With a wrong count, a round would never be
 * closed. */
static int check_merged(const struct canvas *c, struct error *e)
{
	uint32_t leases = c->plan.groups * c->plan.parts, merged[1 + OPEN_ROUNDS] = {0};
	for (uint32_t i = 0; i < lease_flag_count(c); i++) {
		if (c->is_merged[i] > 1)
			return error_set(e, EBADMSG, "a lease that is merged %u times", c->is_merged[i]);
		merged[i / leases] += c->is_merged[i];
	}
	if (memcmp(merged + 1, c->merged_counts, sizeof c->merged_counts) != 0 ||
	    c->merged_counts[c->rounds % OPEN_ROUNDS] == leases)
		return error_set(e, EBADMSG, "%u and %u merged leases in open rounds of %u, %u", merged[1], merged[2],
				 c->merged_counts[0], c->merged_counts[1]);
	return 0;
}

static int load_tiles(struct canvas *c, struct checked_file *in, struct error *e)
{
	for (;;) {
		uint32_t position[2];
		int rc = checked_file_read_numbers(in, position, sizeof *position, 2, e);
		if (rc || position[0] == TILES_END)
			return rc;
		uint32_t film = position[0], tile = position[1];
		if (film >= film_count(c) || tile >= canvas_tile_count(c))
			return error_set(e, EBADMSG, "a tile that the films do not have");
		rc = canvas_reserve_tile(c, film, tile, e);
		/* Closing the round will move the tile into the prefix, so space for that is reserved now. */
		if (!rc)
			rc = canvas_reserve_tile(c, canvas_film_index(film / FILMS_PER_GROUP, FILM_PREFIX), tile, e);
		if (!rc)
			rc = checked_file_read_numbers(in, canvas_slot(c, film, tile), sizeof *c->sums, SLOT_VALUES, e);
		if (rc)
			return rc;
		*canvas_tile_flags(c, film, tile) |= TILE_USED;
	}
}

int canvas_load(struct canvas *c, struct checked_file *in, struct error *e)
{
	unsigned char head[HEAD_SIZE];
	int rc = checked_file_read(in, head, sizeof head, e);
	if (rc)
		return rc;
	uint32_t version = get32(head + VERSION_OFFSET);
	if (version != VERSION || get32(head + TALLY_SIZE_OFFSET) != TALLY_SIZE ||
	    get32(head + SLOT_VALUES_OFFSET) != SLOT_VALUES)
		return error_set(
			e, EPROTO,
			"%s: films of version %u, and this coordinator knows version %u: another one wrote them",
			in->path, version, VERSION);
	unsigned char expected[HEAD_SIZE];
	pack_head(c, expected);
	if (memcmp(head, expected, HEAD_SIZE) != 0)
		return error_set(e, EBADMSG, "%s: the films of another plan", in->path);
	rc = transfer_all(&(struct transfer){in, false, 0, e}, c);
	if (!rc)
		rc = check_merged(c, e);
	if (!rc)
		rc = moments_load(c->moments, in, e);
	return rc ? rc : load_tiles(c, in, e);
}
