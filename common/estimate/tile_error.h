/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The spread between groups in one tile of an image, and the standard errors of its pixels. Private to common/estimate.
 * Pure; nothing allocates.
 */
#ifndef COMMON_ESTIMATE_TILE_ERROR_H
#define COMMON_ESTIMATE_TILE_ERROR_H

#include "common/estimate/canvas_interval.h"
#include "common/estimate/image_builder.h"
#include "common/estimate/tail.h"

/* With fewer groups, the trimmed mean below drops none of them, and no channel counts as cancelling. */
enum { BASE_GROUPS_MIN = 8 };
/* The number of powers of two above the floor that are distinguished. */
enum { BASE_POWERS = 32 };

/* A tile being worked on. */
struct tile_error {
	const struct canvas *c;
	uint32_t groups, x, y, width, height;	     /* number of groups; the tile's place and size in the crop */
	double floor_square;			     /* (0.01 m)^2, m the mean brightness of the image */
	double one_group_kurtosis, highlight_errors; /* limits for this number of groups (canvas_error.c) */
	bool is_lit;				     /* rendered by chains, and some visited the tile */
	double mean_variance[3];		     /* mean of `variance` over the tile's pixels */
	float *deviations; /* [height][width][3][groups]: a group's image minus the mean of the groups */
	double brightness[TILE_SIZE * TILE_SIZE][3], /* mean of the groups */
		variance[TILE_SIZE * TILE_SIZE][3];  /* its variance */
	double base[TILE_SIZE * TILE_SIZE][3],	     /* trimmed mean of the groups: the brightness without fireflies */
		base_variance[TILE_SIZE * TILE_SIZE][3]; /* its variance */
	uint8_t base_power[TILE_SIZE * TILE_SIZE][3];	 /* log2(base / floor), rounded down, 0 to BASE_POWERS - 1 */
	double kurtosis[TILE_SIZE * TILE_SIZE][3];	 /* of the groups' values */
	bool is_settled[TILE_SIZE * TILE_SIZE][3];	 /* the brightness for the pixel's weight has been chosen */
	bool is_cancelling[TILE_SIZE * TILE_SIZE][3];	 /* colours cancel in the channel (cancelling.h) */
	double cancelling_spread[3];			 /* s of cancelling.c, by channel */
	struct error_sums sum;
	struct tail tail; /* of the groups' errors on the bright side */
};

/* Largest squared relative standard error of a brightness that counts as reliable. */
#define RELIABLE_VARIANCE_MAX 0.08

static inline bool brightness_is_reliable(const struct tile_error *t, double brightness, double variance)
{
	return variance <= RELIABLE_VARIANCE_MAX * (brightness * brightness + t->floor_square);
}

/* Returns the deviations of a pixel's groups from their mean: [3][groups]. */
static inline float *tile_error_deviations(const struct tile_error *t, size_t pixel)
{
	return t->deviations + pixel * 3 * t->groups;
}

/* Fills in deviations, brightness, variance, kurtosis, mean_variance and is_lit from the films of the tile at (x, y),
 * and counts unvisited pixels in the image. */
void tile_error_load(struct image_builder *m, struct tile_error *t);

/* Fills in base, base_variance and base_power of all pixels: the mean, and its variance, without the eighth of the
 * groups that are farthest from the others. `deviations` must still be as tile_error_load has left it. */
void tile_error_find_bases(struct tile_error *t);

/* Writes the standard errors of the tile's pixels into the image; `is_settled` must be set. have_bases:
 * tile_error_find_bases has been called, as it must be unless all pixels are settled; errors then include rare light.
 */
void tile_error_write(struct image_builder *m, const struct tile_error *t, bool have_bases);

/* Gives the mean variance of the image to pixels without an error, in tiles that no chain visited. */
void tile_error_fill_unvisited(struct canvas_image *img);

#endif
