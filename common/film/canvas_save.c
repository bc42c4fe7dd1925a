/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/canvas_save.h"

#include "common/film/canvas_films.h"
#include "common/film/canvas_moments.h"

#include <assert.h>
#include <string.h>

enum { VERSION = 2, END = UINT32_MAX };

/* What must be equal for a file to be loaded. */
struct head {
	uint32_t version, tally_bytes, groups, parts, tiles_across, tiles_down, kind, slot;
	double quantum;
};

struct place {
	uint32_t film, tile;
};

static struct head head_of(const struct canvas *c)
{
	struct head h;
	memset(&h, 0, sizeof h);
	h.version = VERSION;
	h.tally_bytes = sizeof(struct tally);
	h.groups = c->plan.groups;
	h.parts = c->plan.parts;
	h.tiles_across = c->tiles_across;
	h.tiles_down = c->tiles_down;
	h.kind = c->plan.kind;
	h.slot = SLOT;
	h.quantum = c->quantum;
	return h;
}

static size_t films_of(const struct canvas *c)
{
	return (size_t)c->plan.groups * FILMS;
}

static size_t has_bytes(const struct canvas *c)
{
	return (size_t)(1 + OPEN_ROUNDS) * c->plan.groups * c->plan.parts;
}

/* Everything but the pixels, in order: writing and reading use the same list. */
struct piece {
	void *bytes;
	size_t size;
};
enum { PIECES = 9 };

static void pieces_of(struct canvas *c, struct piece p[PIECES])
{
	const struct piece all[PIECES] = {{&c->rounds, sizeof c->rounds},   {c->merged, sizeof c->merged},
					  {c->has, has_bytes(c)},	    {c->bound, films_of(c) * sizeof *c->bound},
					  {&c->prefix, sizeof c->prefix},   {&c->open[0], sizeof c->open[0]},
					  {&c->open[1], sizeof c->open[1]}, {&c->bootstrap, sizeof c->bootstrap},
					  {&c->b_tail, sizeof c->b_tail}};
	memcpy(p, all, sizeof all);
}

static int save_tiles(const struct canvas *c, struct checked_file *out, struct error *e)
{
	int rc = 0;
	for (size_t film = 0; film < films_of(c) && !rc; film++)
		for (size_t tile = 0; tile < canvas_tiles(c) && !rc; tile++) {
			if (!(*canvas_flags(c, film, tile) & TILE_USED))
				continue;
			struct place at = {(uint32_t)film, (uint32_t)tile};
			rc = checked_file_write(out, &at, sizeof at, e);
			if (!rc)
				rc = checked_file_write(out, canvas_slot(c, film, tile), SLOT * sizeof *c->sums, e);
		}
	return rc ? rc : checked_file_write(out, &(struct place){END, END}, sizeof(struct place), e);
}

int canvas_save(const struct canvas *c, struct checked_file *out, struct error *e)
{
	struct head h = head_of(c);
	assert(canvas_missing(c) == 0);
	struct canvas copy = *c; /* its pieces are only read */
	struct piece p[PIECES];
	pieces_of(&copy, p);
	int rc = checked_file_write(out, &h, sizeof h, e);
	for (int i = 0; i < PIECES && !rc; i++)
		rc = checked_file_write(out, p[i].bytes, p[i].size, e);
	if (!rc)
		rc = moments_save(c->moments, out, e);
	return rc ? rc : save_tiles(c, out, e);
}

static int load_tiles(struct canvas *c, struct checked_file *in, struct error *e)
{
	for (;;) {
		struct place at;
		int rc = checked_file_read(in, &at, sizeof at, e);
		if (rc || at.film == END)
			return rc;
		if (at.film >= films_of(c) || at.tile >= canvas_tiles(c))
			return error_set(e, EBADMSG, "a tile that the films do not have");
		rc = canvas_back_tile(c, at.film, at.tile, e);
		/* Closing a round moves it into the prefix, so room for that is reserved now. */
		if (!rc)
			rc = canvas_back_tile(c, canvas_film(at.film / FILMS, FILM_PREFIX), at.tile, e);
		if (!rc)
			rc = checked_file_read(in, canvas_slot(c, at.film, at.tile), SLOT * sizeof *c->sums, e);
		if (rc)
			return rc;
		*canvas_flags(c, at.film, at.tile) |= TILE_USED;
	}
}

int canvas_load(struct canvas *c, struct checked_file *in, struct error *e)
{
	struct head h, want = head_of(c);
	struct piece p[PIECES];
	int rc = checked_file_read(in, &h, sizeof h, e);
	if (rc)
		return rc;
	if (h.version != want.version || h.tally_bytes != want.tally_bytes || h.slot != want.slot)
		return error_set(
			e, EPROTO,
			"%s: films of version %u, and this coordinator knows version %u: another one wrote them",
			in->path, h.version, want.version);
	if (memcmp(&h, &want, sizeof h) != 0)
		return error_set(e, EBADMSG, "%s: the films of another plan", in->path);
	pieces_of(c, p);
	for (int i = 0; i < PIECES && !rc; i++)
		rc = checked_file_read(in, p[i].bytes, p[i].size, e);
	if (!rc)
		rc = moments_load(c->moments, in, e);
	return rc ? rc : load_tiles(c, in, e);
}
