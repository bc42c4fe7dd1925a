/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The spread between groups in one tile of an image, and the error layer that is made from it. Private to
 * common/estimate. Pure; nothing allocates.
 */
#ifndef COMMON_ESTIMATE_TILE_ERROR_H
#define COMMON_ESTIMATE_TILE_ERROR_H

#include "common/estimate/canvas_interval.h"
#include "common/estimate/image_builder.h"
#include "common/estimate/tail.h"

/* With fewer groups there is no trimmed mean, and no colours cancel. */
enum { BASE_GROUPS = 8 };
/* The number of powers of two above the floor that are distinguished. */
enum { BASE_POWERS = 32 };

/* A tile being worked on. Rows of `apart` hold three channels of `groups` values. */
struct tile_error {
	const struct canvas *c;
	uint32_t groups, x, y, width, height;	     /* the tile's place and size in the crop */
	double floor_square;			     /* of 0.01 m */
	double one_group_kurtosis, highlight_errors; /* by the number of groups (canvas_error.c) */
	bool lit;				     /* rendered by chains, and some visited the tile */
	double mean_square[3];			     /* over the tile's pixels */
	float *apart; /* [height][width][3][groups]: a group's image minus the mean of the groups */
	double brightness[TILE_SIZE * TILE_SIZE][3],
		square[TILE_SIZE * TILE_SIZE][3]; /* of the mean: value, variance */
	double base[TILE_SIZE * TILE_SIZE][3],
		base_square[TILE_SIZE * TILE_SIZE][3]; /* trimmed mean: value, variance */
	uint8_t base_power[TILE_SIZE * TILE_SIZE][3];  /* powers of two by which the base is above the floor */
	double kurtosis[TILE_SIZE * TILE_SIZE][3];     /* of the groups' values */
	bool settled[TILE_SIZE * TILE_SIZE][3], cancels[TILE_SIZE * TILE_SIZE][3];
	double cancelling_spread[3]; /* cancelling.h */
	struct error_sums sum;
	struct tail tail; /* of the groups' errors on the bright side */
};

/* Squared relative standard error up to which a brightness is used. */
#define BRIGHTNESS_KNOWN 0.08

static inline bool brightness_is_known(const struct tile_error *t, double brightness, double square)
{
	return square <= BRIGHTNESS_KNOWN * (brightness * brightness + t->floor_square);
}

/* A pixel's deviations: [3][groups]. */
static inline float *tile_error_apart(const struct tile_error *t, size_t pixel)
{
	return t->apart + pixel * 3 * t->groups;
}

/* Fills in what follows from the film of the tile at (x, y): apart, brightness, square, kurtosis, mean_square, lit.
 * Counts the image's unvisited pixels. */
void tile_error_load(struct image_builder *m, struct tile_error *t);

/* base, base_square and base_power of all pixels: mean and its variance without the eighth of the groups that are
 * farthest from the others, which is the brightness without fireflies. `apart` must still be as tile_error_load made
 * it. */
void tile_error_find_bases(struct tile_error *t);

/* Writes the standard errors of the tile's pixels into the image; `settled` must be known. Rare light is
 * looked for if the bases are known: it is where not all pixels are settled. */
void tile_error_write(struct image_builder *m, const struct tile_error *t, bool have_bases);

/* Gives the mean variance of the image to tiles that no chain visited, which have none of their own. */
void tile_error_fill_unvisited(struct canvas_image *img);

#endif
