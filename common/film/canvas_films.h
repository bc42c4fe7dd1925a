/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The contents of struct canvas, for the sources of this folder, which add to it, and of common/estimate, which make
 * images from it.
 *
 * Each group has FILMS_PER_GROUP films: the prefix (FILM_PREFIX) and the open rounds of even and odd number (FILM_OPEN
 * + parity); film `which` of a group has the index group * FILMS_PER_GROUP + which. A film holds one slot of TILE_SIZE
 * x TILE_SIZE x 3 integers per tile of the crop, so that a tile without light is a run of untouched pages.
 */
#ifndef COMMON_FILM_CANVAS_FILMS_H
#define COMMON_FILM_CANVAS_FILMS_H

#include "common/film/tally.h"

struct moments;

enum {
	FILM_PREFIX,
	FILM_OPEN,
	FILMS_PER_GROUP = 3,
	SLOT_ROW_VALUES = TILE_SIZE * TILE_CHANNELS,
	SLOT_VALUES = TILE_SIZE * SLOT_ROW_VALUES,
	OPEN_ROUNDS = 2
};
enum tile_flag {
	TILE_RESERVED = 1, /* its disk space is reserved */
	TILE_USED = 2,	   /* something has been added to it */
};

struct canvas {
	struct plan plan;
	double scale, quantum; /* 2^-exponent and its inverse */
	uint32_t tiles_across, tiles_down;
	int64_t *sums;			     /* [film][tile][SLOT_VALUES] */
	size_t bytes;			     /* of the sums */
	int fd;				     /* the file of the sums; -1: anonymous memory */
	uint8_t *tile_flags;		     /* [film][tile] of enum tile_flag */
	uint64_t *sum_bounds;		     /* [film]: at least the largest |sum| of the film */
	uint64_t rounds;		     /* number of complete rounds */
	uint32_t merged_counts[OPEN_ROUNDS]; /* merged leases of the open rounds, by parity */
	uint8_t *is_merged;	  /* 1: merged; [bootstrap_tally, open round of parity 0, of parity 1][group][part] */
	uint32_t *missing_rounds; /* [group][part]: number of the last complete rounds whose batch was taken back */
	struct tally prefix_tally, open_tallies[OPEN_ROUNDS], bootstrap_tally;
	double b_tail_index; /* tail index of the bootstrap; 0: not known */
	struct moments *moments;
};

/* Reserves disk space for a tile of a film; must be called before the tile is touched. Returns 0 or -errno. */
int canvas_reserve_tile(struct canvas *c, size_t film, size_t tile, struct error *e);

static inline size_t canvas_tile_count(const struct canvas *c)
{
	return (size_t)c->tiles_across * c->tiles_down;
}

static inline size_t canvas_film_index(uint32_t group, uint32_t which)
{
	return (size_t)group * FILMS_PER_GROUP + which;
}

static inline int64_t *canvas_slot(const struct canvas *c, size_t film, size_t tile)
{
	return c->sums + (film * canvas_tile_count(c) + tile) * SLOT_VALUES;
}

static inline uint8_t *canvas_tile_flags(const struct canvas *c, size_t film, size_t tile)
{
	return c->tile_flags + film * canvas_tile_count(c) + tile;
}

static inline bool canvas_lease_is_merged(const struct canvas *c, uint32_t set, uint32_t group, uint32_t part)
{
	return c->is_merged[((size_t)set * c->plan.groups + group) * c->plan.parts + part];
}

#endif
