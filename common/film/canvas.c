/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Merges batches into films. canvas_add finds the film of the batch's group and round, reserves disk space for its
 * tiles, adds the pixel values as integers on the grid, and records that the lease is merged. When the last batch of a
 * round has arrived, close_round adds the round's films to the prefix and clears them for the next round but one.
 * Integers add exactly, so the order of batches does not matter and canvas_subtract can subtract a batch again.
 *
 * For each film, `sum_bounds` limits the magnitude of its sums. Batches that could push a pixel beyond 2^62 are refused
 * when they are added, so that closing a round cannot fail.
 *
 * Failures leave the canvas unchanged: -EEXIST if the lease is merged already, -EAGAIN if its round is not open,
 * -ERANGE if a sum would leave the grid, -ENOSPC if the disk has no room for a tile.
 */
#include "common/film/canvas.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/film/canvas_films.h"
#include "common/film/canvas_moments.h"

#include <assert.h>
#include <fcntl.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* The sums of the prefix and both open rounds together stay below 2^62 in every pixel, so closing a round cannot fail.
 */
#define SUM_MAX (UINT64_C(1) << 62)
#define VALUE_MAX 0x1p61

enum {
	CHAIN_EXPONENT = -32, /* grid of chains: a mutation adds about 1, so that 2^30 mutations fit into one pixel */
	SAMPLE_BITS = 28,     /* grid of samples: bits below a group's mean pixel sum in one round */
	BLACK_BITS = 40,      /* if b is not known: bits below the brightest sample */
	GRID_EXPONENT_MAX = 900,
};

int canvas_grid_exponent(const struct plan *p, double b_pooled, double brightest)
{
	double value = b_pooled / (double)plan_extended_pixels(p) * (double)p->epoch;
	int bits = SAMPLE_BITS;
	if (p->kind == PLAN_CHAINS)
		return CHAIN_EXPONENT;
	if (!(value > 0) || !isfinite(value)) {
		value = brightest;
		bits = BLACK_BITS;
	}
	if (!(value > 0) || !isfinite(value))
		return CHAIN_EXPONENT;
	int exponent;
	frexp(value, &exponent);
	exponent -= bits;
	return exponent < -GRID_EXPONENT_MAX  ? -GRID_EXPONENT_MAX
	       : exponent > GRID_EXPONENT_MAX ? GRID_EXPONENT_MAX
					      : exponent;
}

/* Opens a file without a name in the folder: by O_TMPFILE, or where the file system lacks it, by unlinking a new file.
 */
static int open_unlinked(const char *folder, struct error *e)
{
	int fd = disk_open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
	if (fd >= 0)
		return fd;
	static atomic_uint count;
	char path[4096];
	int n = snprintf(path, sizeof path, "%s/canvas-%ld-%u", folder, (long)getpid(), atomic_fetch_add(&count, 1));
	if (n < 0 || (size_t)n >= sizeof path)
		return error_set(e, ENAMETOOLONG, "%s: the folder's name is too long", folder);
	fd = disk_open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	if (fd < 0) {
		int code = errno;
		return error_set(e, code, "%s: cannot make a file for the films: %s", folder, strerror(code));
	}
	disk_unlink(path);
	return fd;
}

enum { ANONYMOUS_MAP_FLAGS = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE };

/* Maps memory for the films; NULL, with the error set, if there is none. */
static void *map_films(size_t bytes, int flags, int fd, struct error *e)
{
	void *map = mmap(NULL, bytes, PROT_READ | PROT_WRITE, flags, fd, 0);
	int code = errno;
	if (map != MAP_FAILED)
		return map;
	error_set(e, code, "no room for the films, %.3g GB: %s; --crop and fewer --groups need less",
		  1e-9 * (double)bytes, strerror(code));
	return NULL;
}

int canvas_probe(const struct plan *p, struct error *e)
{
	void *map = map_films(canvas_bytes(p), ANONYMOUS_MAP_FLAGS, -1, e);
	if (map)
		munmap(map, canvas_bytes(p));
	return map ? 0 : -ENOMEM;
}

static int map_sums(struct canvas *c, const char *folder, struct error *e)
{
	int flags = ANONYMOUS_MAP_FLAGS;
	if (folder) {
		c->fd = open_unlinked(folder, e);
		if (c->fd < 0)
			return c->fd;
		if (disk_ftruncate(c->fd, (off_t)c->bytes) != 0) {
			int code = errno;
			return error_set(e, code, "%s: a file of %zu bytes for the films: %s", folder, c->bytes,
					 strerror(code));
		}
		flags = MAP_SHARED;
	}
	c->sums = map_films(c->bytes, flags, c->fd, e);
	return c->sums ? 0 : -ENOMEM;
}

static uint32_t tiles_along(uint32_t pixels)
{
	return (pixels + TILE_SIZE - 1) / TILE_SIZE;
}

size_t canvas_bytes(const struct plan *p)
{
	size_t tiles = (size_t)tiles_along(p->crop_width) * tiles_along(p->crop_height);
	return p->groups * FILMS_PER_GROUP * tiles * SLOT_VALUES * sizeof(int64_t);
}

bool canvas_is_mapped(const struct canvas *c)
{
	return c->fd >= 0;
}

uint64_t canvas_unreserved_bytes(const struct canvas *c)
{
	struct stat st;
	if (!canvas_is_mapped(c) || disk_fstat(c->fd, &st))
		return 0;
	uint64_t size = (uint64_t)st.st_size, reserved = 512 * (uint64_t)st.st_blocks;
	return size > reserved ? size - reserved : 0;
}

int canvas_new(struct canvas **out, const struct plan *p, int grid_exponent, const char *folder, struct error *e)
{
	assert(grid_exponent >= -GRID_EXPONENT_MAX && grid_exponent <= GRID_EXPONENT_MAX);
	*out = NULL;
	struct canvas *c = mem_alloc(1, sizeof *c);
	if (!c)
		return error_set(e, ENOMEM, "no memory for the films");
	c->plan = *p;
	c->fd = -1;
	c->scale = ldexp(1, -grid_exponent);
	c->quantum = ldexp(1, grid_exponent);
	c->tiles_across = tiles_along(p->crop_width);
	c->tiles_down = tiles_along(p->crop_height);
	size_t films = (size_t)p->groups * FILMS_PER_GROUP;
	c->bytes = canvas_bytes(p);
	c->tile_flags = mem_alloc(films * canvas_tile_count(c), 1);
	c->sum_bounds = mem_alloc(films, sizeof *c->sum_bounds);
	c->is_merged = mem_alloc((size_t)(1 + OPEN_ROUNDS) * p->groups * p->parts, 1);
	c->missing_rounds = mem_alloc((size_t)p->groups * p->parts, sizeof *c->missing_rounds);
	int rc = c->tile_flags && c->sum_bounds && c->is_merged && c->missing_rounds
			 ? map_sums(c, folder, e)
			 : error_set(e, ENOMEM, "no memory for the films");
	if (rc == 0)
		rc = moments_new(&c->moments, p, e);
	if (rc) {
		canvas_free(c);
		return rc;
	}
	*out = c;
	return 0;
}

void canvas_free(struct canvas *c)
{
	if (!c)
		return;
	if (c->sums)
		munmap(c->sums, c->bytes);
	if (c->fd >= 0)
		disk_close(c->fd);
	mem_free(c->tile_flags);
	mem_free(c->sum_bounds);
	mem_free(c->is_merged);
	mem_free(c->missing_rounds);
	moments_free(c->moments);
	mem_free(c);
}

static uint32_t round_parity(uint64_t round)
{
	return (uint32_t)(round % OPEN_ROUNDS);
}

static uint32_t lease_set(const struct lease_key *k)
{
	return k->kind == LEASE_BOOTSTRAP ? 0 : 1 + round_parity(k->epoch);
}

static uint32_t *lease_missing_rounds(const struct canvas *c, const struct lease_key *k)
{
	return &c->missing_rounds[(size_t)k->group * c->plan.parts + k->part];
}

/* Returns whether the round of a render lease is closed. Its sums are then in the prefix, unless the batch has been
 * taken back. */
static bool round_is_closed(const struct canvas *c, const struct lease_key *k)
{
	return k->epoch < c->rounds;
}

static size_t lease_film(const struct canvas *c, const struct lease_key *k)
{
	return canvas_film_index(k->group, round_is_closed(c, k) ? FILM_PREFIX : FILM_OPEN + round_parity(k->epoch));
}

static struct tally *lease_tally(struct canvas *c, const struct lease_key *k)
{
	return round_is_closed(c, k) ? &c->prefix_tally : &c->open_tallies[round_parity(k->epoch)];
}

bool canvas_has_lease(const struct canvas *c, const struct lease_key *k)
{
	if (k->kind == LEASE_RENDER && round_is_closed(c, k))
		return k->epoch < c->rounds - *lease_missing_rounds(c, k);
	if (k->kind == LEASE_RENDER && k->epoch >= c->rounds + OPEN_ROUNDS)
		return false;
	return canvas_lease_is_merged(c, lease_set(k), k->group, k->part);
}

void canvas_set_tail_index(struct canvas *c, double index)
{
	c->b_tail_index = index;
}

void canvas_set_rounds(struct canvas *c, uint64_t rounds)
{
	assert(rounds >= c->rounds);
	c->plan.rounds = rounds;
}

uint64_t canvas_complete_rounds(const struct canvas *c)
{
	return c->rounds;
}

uint64_t canvas_missing_count(const struct canvas *c)
{
	uint64_t missing = 0;
	for (uint32_t i = 0; i < c->plan.groups * c->plan.parts; i++)
		missing += c->missing_rounds[i];
	return missing;
}

/* ---- pixels */

/* Rounds to the nearest integer, ties to even. Adding 1.5 * 2^52 leaves the integer in the low bits of the mantissa.
 * From 2^51 on, x is an integer already: it is a float times a power of two. */
static int64_t round_to_grid(double x)
{
	if (fabs(x) < 0x1p51) {
		double shifted = x + 0x1.8p52;
		int64_t bits;
		memcpy(&bits, &shifted, sizeof bits);
		return bits - INT64_C(0x4338000000000000);
	}
	return (int64_t)x;
}

static size_t tile_values(const struct tile *t)
{
	return (size_t)t->width * t->height * TILE_CHANNELS;
}

/* Returns the largest magnitude of a value of the tile. Without the sign bit, finite floats are ordered like their bits
 * read as integers. */
static float tile_max_magnitude(const struct tile *t)
{
	uint32_t max_bits = 0;
	size_t count = tile_values(t);
	for (size_t i = 0; i < count; i++) {
		uint32_t bits;
		memcpy(&bits, &t->xyz[i], sizeof bits);
		bits &= 0x7FFFFFFF;
		max_bits = bits > max_bits ? bits : max_bits;
	}
	float value;
	memcpy(&value, &max_bits, sizeof value);
	return value;
}

/* Above the largest value of any filter kernel: a kernel has integral 1, and settings bound its radius from below. */
#define KERNEL_MAX 0x1p14

int canvas_check_range(const struct canvas *c, const struct batch *b, struct error *e)
{
	bool chains = c->plan.kind == PLAN_CHAINS;
	double limit = (double)(SUM_MAX / 8) * c->quantum;
	if (chains)
		limit = fmin(limit, KERNEL_MAX * (double)b->counters[COUNT_SAMPLES]);
	for (uint32_t i = 0; i < b->tile_count; i++) {
		const struct tile *t = &b->tiles[i];
		double max_value = (double)tile_max_magnitude(t);
		if (!(max_value <= limit))
			return error_set(e, chains ? EBADMSG : ERANGE,
					 "a pixel of %g in the tile at %u,%u; at most %g fits into one lease",
					 max_value, t->x, t->y, limit);
	}
	return 0;
}

/* Adds v * scale to a row of sums. products_fit: all products are below 2^51. Neither loop has an exit, so that the
 * compiler vectorises them. */
static void add_row(int64_t *s, const float *v, size_t count, double scale, bool products_fit)
{
	if (products_fit) {
		for (size_t x = 0; x < count; x++) {
			double shifted = (double)v[x] * scale + 0x1.8p52;
			int64_t bits;
			memcpy(&bits, &shifted, sizeof bits);
			s[x] += bits - INT64_C(0x4338000000000000);
		}
	} else {
		for (size_t x = 0; x < count; x++)
			s[x] += round_to_grid((double)v[x] * scale);
	}
}

/* Adds (sign 1) or subtracts (sign -1) a tile, and raises *bound to the largest resulting |sum|. Returns false, without
 * any change, if a value is too large for the grid. The sums were at most SUM_MAX and the values are less than
 * VALUE_MAX, so they cannot overflow here; the caller compares *bound with SUM_MAX. */
static bool add_tile(const struct canvas *c, int64_t *slot, const struct tile *t, double sign, uint64_t *bound)
{
	double max_value = (double)tile_max_magnitude(t) * c->scale;
	if (!(max_value < VALUE_MAX))
		return false;
	size_t row = (size_t)t->width * TILE_CHANNELS;
	int64_t low = 0, high = 0;
	for (size_t y = 0; y < t->height; y++) {
		int64_t *s = slot + y * SLOT_ROW_VALUES;
		add_row(s, t->xyz + y * row, row, sign * c->scale, max_value < 0x1p51);
		for (size_t x = 0; x < row; x++) {
			low = s[x] < low ? s[x] : low;
			high = s[x] > high ? s[x] : high;
		}
	}
	uint64_t below = 0 - (uint64_t)low, above = (uint64_t)high, larger = below > above ? below : above;
	*bound = larger > *bound ? larger : *bound;
	return true;
}

static size_t tile_index(const struct canvas *c, const struct tile *t)
{
	return (size_t)((t->y - c->plan.crop_y) / TILE_SIZE) * c->tiles_across + (t->x - c->plan.crop_x) / TILE_SIZE;
}

int canvas_reserve(struct canvas *c, const struct batch *b, struct error *e)
{
	size_t prefix = canvas_film_index(b->key.group, FILM_PREFIX), open = lease_film(c, &b->key);
	int rc = 0;
	for (uint32_t i = 0; i < b->tile_count && rc == 0; i++) {
		size_t tile = tile_index(c, &b->tiles[i]);
		assert(tile < canvas_tile_count(c));
		rc = canvas_reserve_tile(c, open, tile, e);
		if (rc == 0)
			rc = canvas_reserve_tile(c, prefix, tile, e);
	}
	return rc;
}

/* Adds all tiles of a batch to the film of its lease; if one does not fit, subtracts those that were added. */
static int add_tiles(struct canvas *c, const struct batch *b, struct error *e)
{
	size_t prefix = canvas_film_index(b->key.group, FILM_PREFIX), open = lease_film(c, &b->key);
	int rc = canvas_reserve(c, b, e);
	if (rc)
		return rc;
	uint64_t bound = c->sum_bounds[open], old_bound = bound, ignored = 0;
	uint32_t added = 0;
	for (; added < b->tile_count && bound <= SUM_MAX; added++) {
		size_t tile = tile_index(c, &b->tiles[added]);
		if (!add_tile(c, canvas_slot(c, open, tile), &b->tiles[added], 1, &bound))
			break;
		*canvas_tile_flags(c, open, tile) |= TILE_USED;
	}
	uint64_t other_bounds = c->sum_bounds[prefix] + c->sum_bounds[prefix + FILM_OPEN] +
				c->sum_bounds[prefix + FILM_OPEN + 1] - old_bound;
	if (added == b->tile_count && bound <= SUM_MAX && bound + other_bounds <= SUM_MAX) {
		c->sum_bounds[open] = bound;
		return 0;
	}
	while (added-- > 0)
		add_tile(c, canvas_slot(c, open, tile_index(c, &b->tiles[added])), &b->tiles[added], -1, &ignored);
	return error_set(e, ERANGE, "a pixel's sum left the film's range (quantum %g)", c->quantum);
}

/* Moves the sums of a tile from an open film to the prefix and raises *bound to the prefix's largest |sum|. */
static void close_tile(struct canvas *c, size_t prefix, size_t open, size_t tile, uint64_t *bound)
{
	int64_t *to = canvas_slot(c, prefix, tile), *from = canvas_slot(c, open, tile);
	for (size_t i = 0; i < SLOT_VALUES; i++) {
		to[i] += from[i];
		uint64_t magnitude = to[i] < 0 ? 0 - (uint64_t)to[i] : (uint64_t)to[i];
		*bound = magnitude > *bound ? magnitude : *bound;
	}
	memset(from, 0, SLOT_VALUES * sizeof *from);
	*canvas_tile_flags(c, prefix, tile) |= TILE_USED;
	*canvas_tile_flags(c, open, tile) &= (uint8_t)~TILE_USED;
}

/* ---- other data of a batch */

void canvas_sum_counts(const struct canvas *c, bool open_rounds, struct canvas_counts *out)
{
	*out = c->prefix_tally.counts;
	for (uint32_t i = 0; open_rounds && i < OPEN_ROUNDS; i++)
		canvas_counts_add(out, &c->open_tallies[i].counts);
}

static void close_round(struct canvas *c)
{
	uint32_t open = round_parity(c->rounds), leases = c->plan.groups * c->plan.parts;
	for (uint32_t g = 0; g < c->plan.groups; g++) {
		size_t prefix = canvas_film_index(g, FILM_PREFIX), from = prefix + FILM_OPEN + open;
		for (size_t t = 0; t < canvas_tile_count(c); t++)
			if (*canvas_tile_flags(c, from, t) & TILE_USED)
				close_tile(c, prefix, from, t, &c->sum_bounds[prefix]);
		c->sum_bounds[from] = 0;
	}
	tally_merge(&c->prefix_tally, &c->open_tallies[open], c->plan.groups);
	moments_close_round(c->moments, c->rounds);
	c->open_tallies[open] = (struct tally){0};
	c->merged_counts[open] = 0;
	memset(c->is_merged + (size_t)(1 + open) * leases, 0, leases);
	c->rounds++;
}

int canvas_add(struct canvas *c, const struct batch *b, struct error *e)
{
	const struct lease_key *k = &b->key;
	assert(k->group < c->plan.groups && k->part < c->plan.parts);
	if (canvas_has_lease(c, k))
		return error_set(e, EEXIST, "the lease has been merged before");
	uint8_t *is_merged =
		&c->is_merged[((size_t)lease_set(k) * c->plan.groups + k->group) * c->plan.parts + k->part];
	if (k->kind == LEASE_BOOTSTRAP) {
		tally_add(&c->bootstrap_tally, b);
		moments_add(c->moments, b, false);
		*is_merged = 1;
		return 0;
	}
	uint32_t *missing = lease_missing_rounds(c, k);
	bool closed = round_is_closed(c, k);
	if (k->epoch >= c->rounds + OPEN_ROUNDS || k->epoch >= c->plan.rounds ||
	    (*missing && k->epoch != c->rounds - *missing))
		return error_set(e, EAGAIN, "round %llu is not open yet: %llu are complete",
				 (unsigned long long)k->epoch, (unsigned long long)c->rounds);
	int rc = moments_check_range(c->moments, k, e);
	if (rc == 0)
		rc = add_tiles(c, b, e);
	if (rc)
		return rc;
	tally_add(lease_tally(c, k), b);
	moments_add(c->moments, b, closed);
	if (closed) {
		--*missing;
		return 0;
	}
	*is_merged = 1;
	c->merged_counts[round_parity(k->epoch)]++;
	while (c->merged_counts[round_parity(c->rounds)] == c->plan.groups * c->plan.parts)
		close_round(c);
	return 0;
}

void canvas_subtract(struct canvas *c, const struct batch *b)
{
	const struct lease_key *k = &b->key;
	size_t film = lease_film(c, k);
	uint64_t bound = 0;
	assert(k->kind == LEASE_RENDER && canvas_has_lease(c, k));
	for (uint32_t i = 0; i < b->tile_count; i++) {
		bool on_grid = add_tile(c, canvas_slot(c, film, tile_index(c, &b->tiles[i])), &b->tiles[i], -1, &bound);
		assert(on_grid); /* as it was when the batch was added */
		(void)on_grid;
	}
	c->sum_bounds[film] = bound > c->sum_bounds[film] ? bound : c->sum_bounds[film];
	tally_subtract(lease_tally(c, k), b);
	moments_subtract(c->moments, b, round_is_closed(c, k));
	if (round_is_closed(c, k)) {
		++*lease_missing_rounds(c, k);
		return;
	}
	c->is_merged[((size_t)lease_set(k) * c->plan.groups + k->group) * c->plan.parts + k->part] = 0;
	c->merged_counts[round_parity(k->epoch)]--;
}
