/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/canvas_save.h"

#include "common/base/bytes.h"
#include "common/film/canvas_films.h"
#include "common/film/canvas_moments.h"

#include <assert.h>
#include <string.h>

enum { VERSION = 2, HEAD = 40, PLACE = 8, END = UINT32_MAX };
enum {
	TALLY = sizeof(uint64_t) *
		(BATCH_COUNTERS + BATCH_STRATEGIES * STRATEGY_COUNTERS + PLAN_MAX_GROUPS * (2 + 2 * EXACT_SUM_WORDS))
};
/* Offsets in the head of the numbers that depend on the build, not on the plan. */
enum { AT_VERSION = 0, AT_TALLY = 4, AT_SLOT = 28 };

/* Writes the head, which must be equal in the file and in the canvas that loads it. */
static void pack_head(const struct canvas *c, unsigned char bytes[HEAD])
{
	put32(bytes + AT_VERSION, VERSION);
	put32(bytes + AT_TALLY, TALLY);
	put32(bytes + 8, c->plan.groups);
	put32(bytes + 12, c->plan.parts);
	put32(bytes + 16, c->tiles_across);
	put32(bytes + 20, c->tiles_down);
	put32(bytes + 24, c->plan.kind);
	put32(bytes + AT_SLOT, SLOT);
	put_double(bytes + 32, c->quantum);
}

static size_t films_of(const struct canvas *c)
{
	return (size_t)c->plan.groups * FILMS;
}

static size_t has_bytes(const struct canvas *c)
{
	return (size_t)(1 + OPEN_ROUNDS) * c->plan.groups * c->plan.parts;
}

/* ---- everything but pixels and moments; the same functions write and read, so that the order is the same */

struct transfer {
	struct checked_file *file;
	bool writes;
	int rc; /* the first error; nothing is transferred after it */
	struct error *e;
};

static void transfer_numbers(struct transfer *t, void *numbers, size_t width, size_t count)
{
	if (!t->rc)
		t->rc = t->writes ? checked_file_write_numbers(t->file, numbers, width, count, t->e)
				  : checked_file_read_numbers(t->file, numbers, width, count, t->e);
}

static void transfer64(struct transfer *t, void *numbers, size_t count)
{
	transfer_numbers(t, numbers, sizeof(uint64_t), count);
}

static void transfer_tally(struct transfer *t, struct tally *y)
{
	transfer64(t, y->counts.counters, BATCH_COUNTERS);
	transfer64(t, y->counts.strategy, BATCH_STRATEGIES * STRATEGY_COUNTERS);
	for (uint32_t g = 0; g < PLAN_MAX_GROUPS; g++) {
		transfer64(t, &y->group[g].samples, 1);
		transfer64(t, &y->group[g].independent, 1);
		transfer64(t, y->group[g].sum.word, EXACT_SUM_WORDS);
		transfer64(t, y->group[g].beyond.word, EXACT_SUM_WORDS);
	}
}

static int transfer_all(struct transfer *t, struct canvas *c)
{
	transfer64(t, &c->rounds, 1);
	transfer_numbers(t, c->merged, sizeof *c->merged, OPEN_ROUNDS);
	transfer_numbers(t, c->has, sizeof *c->has, has_bytes(c));
	transfer64(t, c->bound, films_of(c));
	transfer_tally(t, &c->prefix);
	for (int i = 0; i < OPEN_ROUNDS; i++)
		transfer_tally(t, &c->open[i]);
	transfer_tally(t, &c->bootstrap);
	transfer64(t, &c->b_tail, 1);
	return t->rc;
}

/* ---- pixels */

static int write_place(struct checked_file *out, uint32_t film, uint32_t tile, struct error *e)
{
	unsigned char bytes[PLACE];
	put32(bytes, film);
	put32(bytes + 4, tile);
	return checked_file_write(out, bytes, sizeof bytes, e);
}

static int save_tiles(const struct canvas *c, struct checked_file *out, struct error *e)
{
	int rc = 0;
	for (size_t film = 0; film < films_of(c) && !rc; film++)
		for (size_t tile = 0; tile < canvas_tiles(c) && !rc; tile++) {
			if (!(*canvas_flags(c, film, tile) & TILE_USED))
				continue;
			rc = write_place(out, (uint32_t)film, (uint32_t)tile, e);
			if (!rc)
				rc = checked_file_write_numbers(out, canvas_slot(c, film, tile), sizeof *c->sums, SLOT,
								e);
		}
	return rc ? rc : write_place(out, END, END, e);
}

int canvas_save(const struct canvas *c, struct checked_file *out, struct error *e)
{
	unsigned char head[HEAD];
	struct canvas copy = *c; /* transfer_all takes a canvas that it could write to; it only reads this one */
	assert(canvas_missing(c) == 0);
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
	for (uint32_t i = 0; i < has_bytes(c); i++) {
		if (c->has[i] > 1)
			return error_set(e, EBADMSG, "a lease that is merged %u times", c->has[i]);
		merged[i / leases] += c->has[i];
	}
	if (memcmp(merged + 1, c->merged, sizeof c->merged) != 0 || c->merged[c->rounds % OPEN_ROUNDS] == leases)
		return error_set(e, EBADMSG, "%u and %u merged leases in open rounds of %u, %u", merged[1], merged[2],
				 c->merged[0], c->merged[1]);
	return 0;
}

static int load_tiles(struct canvas *c, struct checked_file *in, struct error *e)
{
	for (;;) {
		uint32_t at[2];
		int rc = checked_file_read_numbers(in, at, sizeof *at, 2, e);
		if (rc || at[0] == END)
			return rc;
		uint32_t film = at[0], tile = at[1];
		if (film >= films_of(c) || tile >= canvas_tiles(c))
			return error_set(e, EBADMSG, "a tile that the films do not have");
		rc = canvas_back_tile(c, film, tile, e);
		/* Closing the round will move the tile into the prefix, so space for that is reserved now. */
		if (!rc)
			rc = canvas_back_tile(c, canvas_film(film / FILMS, FILM_PREFIX), tile, e);
		if (!rc)
			rc = checked_file_read_numbers(in, canvas_slot(c, film, tile), sizeof *c->sums, SLOT, e);
		if (rc)
			return rc;
		*canvas_flags(c, film, tile) |= TILE_USED;
	}
}

int canvas_load(struct canvas *c, struct checked_file *in, struct error *e)
{
	unsigned char head[HEAD];
	int rc = checked_file_read(in, head, sizeof head, e);
	if (rc)
		return rc;
	uint32_t version = get32(head + AT_VERSION);
	if (version != VERSION || get32(head + AT_TALLY) != TALLY || get32(head + AT_SLOT) != SLOT)
		return error_set(
			e, EPROTO,
			"%s: films of version %u, and this coordinator knows version %u: another one wrote them",
			in->path, version, VERSION);
	unsigned char want[HEAD];
	pack_head(c, want);
	if (memcmp(head, want, HEAD) != 0)
		return error_set(e, EBADMSG, "%s: the films of another plan", in->path);
	rc = transfer_all(&(struct transfer){in, false, 0, e}, c);
	if (!rc)
		rc = check_merged(c, e);
	if (!rc)
		rc = moments_load(c->moments, in, e);
	return rc ? rc : load_tiles(c, in, e);
}
