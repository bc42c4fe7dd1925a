/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An image with all that its samples say of its error: standard errors of pixels, the relMSE with its interval or the
 * reason why there is none (docs/design.md, rules 4), and whether chains agree. Made by canvas_image.h.
 */
#ifndef COMMON_ESTIMATE_IMAGE_H
#define COMMON_ESTIMATE_IMAGE_H

#include "common/film/tally.h"

/* One class of paths: its X+Y+Z over the film window in units of b, as measured by independent samples (of the
 * bootstrap only) and by the chains' share of time times b, with standard errors from the groups. */
struct path_class_energy {
	double bootstrap, bootstrap_error, chains, chains_error;
	double difference_t; /* of the groups' differences, chains - bootstrap, Student's t with groups - 1 degrees;
				NAN: nothing to compare */
};

/* Why the interval of an image's relMSE is not known, in words in common/estimate/stated_error.h. */
enum error_doubt {
	ERROR_KNOWN,
	ERROR_ONE_GROUP, /* too much of it comes from pixels where one group outweighs the others: rare light */
	ERROR_DARK,	 /* ... from pixels whose brightness, the denominator of errors, is not known */
	ERROR_WIDE,	 /* the interval would span more than a factor of ten in relative error */
	ERROR_TAIL, /* the largest errors of pixels are so unequal that larger ones may still come: error_tail is not
		       above error_tail_least */
	ERROR_FEW_GROUPS, /* too few groups, and too few pixels for a tail index, to tell whether the largest errors
			     have come */
	ERROR_NO_SPREAD,  /* a single group: nothing to compare it with */
	ERROR_SHORT,	  /* the chains are too short to be judged (common/estimate/convergence.h) */
	ERROR_UNSEEN,	  /* light that so few samples hardly ever find is missing (struct plan_unseen) */
};

/* By which pilots' estimates of rel_mse_unseen may be too small: they are made of few photons. */
#define IMAGE_UNSEEN_FACTOR 2

struct canvas_image {
	uint32_t width, height; /* crop */
	float *rgb;		/* linear Rec. 709, [height][width][3]; from the prefix of complete rounds */
	float *error;		/* one standard error, same shape and units; NULL when groups < 2 */
	/* relMSE of rgb against the truth B, at this resolution, estimated: mean over pixels and channels of (rgb -
	 * B)^2 / (B^2 + (0.01 m)^2), m the mean of B. NAN if groups < 2 or there is no light. */
	double rel_mse;
	double rel_mse_upper;	/* upper end of the 90 % interval of this image's relMSE; valid only if nothing is
				   doubtful */
	double rel_mse_own;	/* rel_mse if every pixel is as bright as it came out: if none has a firefly */
	double rel_mse_degrees; /* degrees of freedom: rel_mse is distributed as its expectation times chi-square over
				   them; NAN: not known */
	double rel_mse_95[2];	/* contains this image's relMSE in 95 % of all cases; NAN if doubtful */
	enum error_doubt rel_mse_doubt;
	double doubtful_share; /* share of rel_mse that the doubt is about */
	double rel_mse_unseen; /* what light that so few samples hardly ever find adds to rel_mse, by the plan's pilot
				*/
	double error_tail; /* tail index (common/estimate/tail.h) of the groups' relative errors of pixels; INFINITY or
			      0: not known */
	double error_tail_least; /* above this the variance of errors is finite, with 95 % confidence */
	uint64_t unvisited;	 /* pixels that no chain visited; 0 for samples */
	/*
	 * Chains only, of complete rounds; NULL for samples, previews and before the first complete round. For each
	 * tile of TILE_SIZE from the crop's corner:
	 * - the potential scale reduction (Gelman and Rubin 1992) of the share of its time that a sequence spends in
	 *   the tile, sqrt((n - 1) / n + V / W), with n mutations per sequence, V the variance of the sequences'
	 *   shares, W the mean variance of one mutation's share within a sequence. It is 1 for independent states and
	 *   grows with the time that states stay alike; INFINITY if sequences differ and none ever varies, NAN if no
	 *   chain came.
	 * - the relative standard error of the tile's mean brightness from the spread between sequences (sqrt(V /
	 *   sequences) over the mean, without b's own error), NAN if it is dark.
	 * - the tile's share of the crop's energy.
	 */
	uint32_t tiles_across, tiles_down;
	float *r_hat, *tile_error, *tile_share;
	struct path_class_energy classes[PATH_CLASSES];
	/* Samples that leave some of their light to chains: the chains' share in b, and in its variance between the
	 * groups; NAN where that is 0 / 0. */
	double chains_energy, chains_variance;
	double b, b_error; /* pooled b and its standard error (chains); stated_b_doubt says when that is not valid */
	double b_tail;	   /* tail index of the independent samples whose mean is b; 0: not known */
	double beyond_share;
	uint64_t samples, rounds;
	struct canvas_counts counts; /* for the same pixels; refused contributions of the bootstrap are included */
	bool black;
};

#endif
