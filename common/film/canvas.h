/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The merged films of a job: one film a group, sums on an integer grid, so that adding is order-free (docs/design.md,
 * rules 1). Round r's batches go into the open film of r; when all have come the round is closed and its sums move into
 * the prefix. The published image is the prefix of complete rounds. Two rounds may be open: the first incomplete one
 * and the next. Memory: 8 bytes x 3 channels x pixels x groups x 3, in mapped files below `folder` (unlinked at once)
 * or, with folder NULL, in anonymous memory; pages that no batch touched cost nothing. For chains also what
 * canvas_moments.h keeps: 24 bytes a tile and sequence, 0.5 % of the films with 1,024 chains in 16 groups. One thread
 * at a time.
 */
#ifndef COMMON_FILM_CANVAS_H
#define COMMON_FILM_CANVAS_H

#include "common/film/batch.h"
#include "common/film/exact_sum.h"
#include "common/film/path_class.h"

struct canvas;

struct bootstrap_result { /* of all groups, from the weights in index order: see bootstrap_merge */
	double b[PLAN_MAX_GROUPS];
	double b_pooled;
	double beyond_share; /* of the energy, in paths too long for the chains' state */
	bool black; /* no sample carried light, so chains have nowhere to begin: the job ends with a black image.
		       Samples go on: the few of the bootstrap prove nothing about the many */
};

/* The grid: quantum 2^exponent. For chains fixed (values are of order 1 per mutation); for samples from b. */
int canvas_grid_exponent(const struct plan *p, double b_pooled, double brightest);

int canvas_new(struct canvas **c, const struct plan *p, int grid_exponent, const char *folder, struct error *e);
void canvas_free(struct canvas *c);
size_t canvas_bytes(const struct plan *p);     /* of its films */
bool canvas_is_mapped(const struct canvas *c); /* to a file */

/* Bootstrap batches add only their independent sums. Counters and sums of render batches are those of their round.
 * -EEXIST: merged already; -EAGAIN: round not open, or an earlier batch is taken back; -ERANGE: a sum left the grid (an
 * error of the job). */
int canvas_add(struct canvas *c, const struct batch *b, struct error *e);
/* Of a (group, part) the last render batch that was added, as it was then: its sums are taken out, exactly, and it may
 * be added again, with another content; until then no round is closed. COUNT_LONGEST_STUCK stays what it was. */
void canvas_take_back(struct canvas *c, const struct batch *b);
uint64_t canvas_missing(const struct canvas *c); /* batches of complete rounds that are taken back */
/* Before anything is done with a render batch: no pixel of it takes an eighth of the film's range. -EBADMSG: of chains,
 * which cannot be so long in one pixel; -ERANGE: of samples, which may be as bright as they like, but not here. */
int canvas_admits(const struct canvas *c, const struct batch *b, struct error *e);
/* The tail index of the independent samples (common/film/tail.h), from the bootstrap. */
void canvas_set_tail(struct canvas *c, double index);
/* The plan ends after so many rounds now, not fewer than are open. */
void canvas_set_rounds(struct canvas *c, uint64_t rounds);
/* Room on the disk for the tiles of a render batch, so that adding it does not fail for want of it. -ENOSPC and what
 * else a disk says. */
int canvas_reserve(struct canvas *c, const struct batch *b, struct error *e);
bool canvas_has(const struct canvas *c, const struct lease_key *k); /* merged already */
uint64_t canvas_rounds(const struct canvas *c);			    /* complete rounds */
uint64_t canvas_merged(const struct canvas *c);			    /* render leases merged, open rounds too */

/* Sums over render batches, each merged once; COUNT_LONGEST_STUCK is their maximum. Cells of the strategies that the
 * plan's mixture does not have are 0. */
struct canvas_counts {
	uint64_t counters[BATCH_COUNTERS];
	uint64_t strategy[BATCH_STRATEGIES][STRATEGY_COUNTERS];
};
/* Of the prefix of complete rounds, with open_rounds of all that has come. */
void canvas_counts(const struct canvas *c, bool open_rounds, struct canvas_counts *out);

/* One class of paths: its X+Y+Z over the film window in units of b's, as independent samples (bootstrap and independent
 * proposals of chains are kept apart: only the bootstrap's count here) and as the chains' share of time times b say;
 * with standard errors from the groups. */
struct path_class_energy {
	double bootstrap, bootstrap_error, chains, chains_error;
	double difference_t; /* of the groups' differences, chains - bootstrap, Student's t with groups - 1 degrees;
				NAN: nothing to compare */
};

/* Why the interval of an image's relMSE is not known; common/film/stated_error.h says it in words. */
enum error_doubt {
	ERROR_KNOWN,
	ERROR_ONE_GROUP, /* too much of it comes from pixels where one group of samples outweighs the others: rare light
			  */
	ERROR_DARK,	 /* ... from pixels whose brightness, by which errors are divided, is not known */
	ERROR_WIDE,	 /* the interval would span more than a factor of ten of the relative error */
	ERROR_TAIL,  /* the largest errors of pixels are so unequal that larger ones have not come yet: error_tail is
			below 2 */
	ERROR_SHORT, /* chains are too short to be judged (common/film/convergence.h) */
};

struct canvas_image {
	uint32_t width, height; /* crop */
	float *rgb;		/* linear Rec. 709, [height][width][3]; from the prefix of complete rounds */
	float *error;		/* one standard error, same shape and units; NULL when groups < 2 */
	/* relMSE of rgb against the truth B, at this resolution: mean over pixels and channels of (rgb - B)^2 / (B^2 +
	 * (0.01 m)^2), m the mean of B; estimated. NAN when groups < 2 or nothing came. */
	double rel_mse;
	double rel_mse_upper;	/* upper end of the 90 % interval of this image's own; believed only where nothing is
				   doubtful */
	double rel_mse_degrees; /* of freedom: rel_mse is distributed as its expectation times chi-square over them;
				   NAN: unknown */
	double rel_mse_95[2];	/* interval that holds this image's own relMSE in 95 % of all cases; NAN where it is
				   doubtful */
	enum error_doubt rel_mse_doubt;
	double doubtful_share; /* of rel_mse: what the doubt is about */
	double error_tail;  /* tail index (common/film/tail.h) of the groups' relative errors of pixels; INFINITY or 0:
			       not known */
	uint64_t unvisited; /* pixels to which no chain came; 0 of samples */
	/* Chains only, of complete rounds; NULL for samples, previews and before the first round is complete. Per tile
	 * of TILE_SIZE from the crop's corner: potential scale reduction (Gelman and Rubin 1992) of the share of a
	 * sequence's time that falls into the tile, sqrt((n - 1) / n + V / W), n mutations a sequence, V the variance
	 * of the sequences' shares, W the mean variance of one mutation's share within a sequence: 1 for independent
	 * states, grows with the time that states stay alike, INFINITY where no sequence ever varies and they differ,
	 * NAN where no chain came. Then the relative standard error of the tile's mean brightness from the spread
	 * between sequences (sqrt(V / sequences) over the mean; b's own error apart), NAN where it is dark; and the
	 * tile's share of the crop's energy. */
	uint32_t tiles_across, tiles_down;
	float *r_hat, *tile_error, *tile_share;
	struct path_class_energy classes[PATH_CLASSES];
	double b, b_error; /* pooled b and its standard error (chains); stated_b_doubt says where that is not to be
			      believed */
	double b_tail;	   /* tail index of the independent samples that b is the mean of; 0: not known */
	double beyond_share;
	uint64_t samples, rounds;
	struct canvas_counts counts; /* as the pixels; contributions refused in the bootstrap are added */
	bool black;
};
/* Allocates img's arrays; canvas_image_fini frees them. open_rounds: a preview with all that has come. */
int canvas_image(const struct canvas *c, bool open_rounds, struct canvas_image *img, struct error *e);
void canvas_image_fini(struct canvas_image *img);

/* Mean X+Y+Z of each of across x down blocks of the crop in each group's own image, of the prefix of complete rounds,
 * and that of the whole crop as the last: out[group][across * down + 1]. Groups are independent, so that their spread
 * is these means' error. across and down: at most width and height. */
void canvas_group_blocks(const struct canvas *c, uint32_t across, uint32_t down, double *out);

/* Sum over pixels and R, G, B (weight[height][width][3], as canvas_image's rgb) of the weighted square of a group's
 * image less the mean of the groups': out[groups]. Their mean over groups - 1 is the same sum of squared standard
 * errors. */
void canvas_group_distances(const struct canvas *c, const double *weight, double *out);

#endif
