/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The inside of struct canvas, for those who add to it here and those who make images of it (common/estimate).
 * A film holds one slot of TILE_SIZE x TILE_SIZE x 3 integers per tile of the crop, so that a tile that nothing touched
 * is a run of pages that nothing touched. Film `group * FILMS + which`; which: the prefix, or the open round's parity.
 */
#ifndef COMMON_FILM_CANVAS_FILMS_H
#define COMMON_FILM_CANVAS_FILMS_H

#include "common/film/tally.h"

struct moments;

enum {
	FILM_PREFIX,
	FILM_OPEN,
	FILMS = 3,
	SLOT_ROW = TILE_SIZE * TILE_CHANNELS,
	SLOT = TILE_SIZE * SLOT_ROW,
	OPEN_ROUNDS = 2
};
enum tile_flag { TILE_BACKED = 1, TILE_USED = 2 };

struct canvas {
	struct plan plan;
	double scale, quantum; /* 2^-exponent and its inverse */
	uint32_t tiles_across, tiles_down;
	int64_t *sums;
	size_t bytes;
	int fd;			      /* -1: anonymous */
	uint8_t *flags;		      /* [film][tile] of enum tile_flag */
	uint64_t *bound;	      /* [film]: no |sum| of the film is above */
	uint64_t rounds;	      /* complete */
	uint32_t merged[OPEN_ROUNDS]; /* leases of an open round, by its parity */
	uint8_t *has;		      /* [bootstrap, open parity 0, 1][group][part] */
	uint32_t *missing; /* [group][part]: so many of the last complete rounds lack its batch, which was taken back */
	struct tally prefix, open[OPEN_ROUNDS], bootstrap;
	double b_tail; /* 0: not known */
	struct moments *moments;
};

/* Reserves its place on the disk, before it is touched. */
int canvas_back_tile(struct canvas *c, size_t film, size_t tile, struct error *e);

static inline size_t canvas_tiles(const struct canvas *c)
{
	return (size_t)c->tiles_across * c->tiles_down;
}

static inline size_t canvas_film(uint32_t group, uint32_t which)
{
	return (size_t)group * FILMS + which;
}

static inline int64_t *canvas_slot(const struct canvas *c, size_t film, size_t tile)
{
	return c->sums + (film * canvas_tiles(c) + tile) * SLOT;
}

static inline uint8_t *canvas_flags(const struct canvas *c, size_t film, size_t tile)
{
	return c->flags + film * canvas_tiles(c) + tile;
}

static inline bool canvas_lease_merged(const struct canvas *c, uint32_t set, uint32_t group, uint32_t part)
{
	return c->has[((size_t)set * c->plan.groups + group) * c->plan.parts + part];
}

#endif
