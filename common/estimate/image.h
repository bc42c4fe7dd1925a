/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An image with estimates of its error: standard errors of pixels, the relMSE with its interval or the reason why the
 * interval is not known (docs/design.md, rules 4), and the statistics by which convergence.h judges chains. Made by
 * canvas_image.h.
 */
#ifndef COMMON_ESTIMATE_IMAGE_H
#define COMMON_ESTIMATE_IMAGE_H

#include "common/film/tally.h"

/* The energy of one class of paths, the part of b (the integral of X+Y+Z over the film window) that it contributes: as
 * measured by the samples of the bootstrap, and by the chains' share of time times b. Standard errors are from the
 * groups. */
struct path_class_energy {
	double bootstrap, bootstrap_error, chains, chains_error;
	double difference_t; /* Student's t of chains - bootstrap, from the groups' differences, with groups - 1 degrees
				of freedom; NAN: nothing to compare */
};

/* Why the interval of an image's relMSE is not known; stated_error.h has sentences for these. */
enum error_doubt {
	ERROR_DOUBT_NONE,      /* the interval is known */
	ERROR_DOUBT_ONE_GROUP, /* too much of relMSE comes from pixels in which one group outweighs the others: rare
				  light */
	ERROR_DOUBT_DARK, /* too much of it comes from pixels whose brightness, the divisor of errors, is not known */
	ERROR_DOUBT_WIDE, /* the interval would span more than a factor of ten in relative error */
	ERROR_DOUBT_TAIL, /* the largest errors of pixels are so unequal that larger ones may still come:
		     error_tail_index is not above error_tail_critical */
	ERROR_DOUBT_FEW_GROUPS,	  /* too few groups, and too few pixels for a tail index, to tell whether larger errors
			       may still come */
	ERROR_DOUBT_NO_SPREAD,	  /* a single group, which cannot be compared with others */
	ERROR_DOUBT_SHORT_CHAINS, /* the chains are too short to be judged (convergence.h) */
	/* light is missing that the samples so far are unlikely to have found (struct plan_unseen) */
	ERROR_DOUBT_UNSEEN,
};

/* rel_mse_unseen may be too small by this factor, because pilots estimate it from few photons. */
#define IMAGE_UNSEEN_FACTOR 2

struct canvas_image {
	uint32_t width, height; /* crop */
	float *rgb;		/* linear Rec. 709, [height][width][3]; from the prefix of complete rounds */
	float *error;		/* one standard error, same shape and units; NULL when groups < 2 */
	/* Estimate of the relMSE of rgb against the true image B of this resolution: the mean over pixels and channels
	 * of (rgb - B)^2 / (B^2 + (0.01 m)^2), m the mean of B. NAN if groups < 2 or there is no light. */
	double rel_mse;
	double rel_mse_upper; /* upper end of the 90 % interval of this image's relMSE; valid only if rel_mse_doubt is
				 ERROR_DOUBT_NONE */
	double rel_mse_as_measured; /* rel_mse if every pixel's brightness is right as it came out, without fireflies */
	double rel_mse_degrees; /* degrees of freedom: rel_mse is distributed as its expectation times chi-square over
				   them; NAN: not known */
	double rel_mse_interval_95[2]; /* contains this image's relMSE in 95 % of all cases; NAN if rel_mse_doubt is set
					*/
	enum error_doubt rel_mse_doubt;
	double doubtful_share; /* share of rel_mse from the doubtful pixels (ERROR_DOUBT_ONE_GROUP, ERROR_DOUBT_DARK) */
	/* relMSE due to light that the samples so far are unlikely to have found, by the pilot */
	double rel_mse_unseen;
	double error_tail_index;    /* tail index (tail.h) of the groups' relative errors; INFINITY or 0: not known */
	double error_tail_critical; /* above this the variance of errors is finite, with 95 % confidence */
	uint64_t unvisited_count;   /* pixels that no chain visited; 0 for samples */
	/*
	 * Statistics of chains, from complete rounds, for each tile of TILE_SIZE from the crop's corner. NULL for
	 * samples, previews and before the first complete round.
	 * - r_hat: the potential scale reduction (Gelman and Rubin 1992) of the share of its time that a sequence
	 *   spends in the tile, sqrt((n - 1) / n + V / W), with n mutations per sequence, V the variance of the
	 *   sequences' shares, W the mean variance of one mutation's share within a sequence. It is 1 for independent
	 *   states and grows with the time that states stay alike; INFINITY if sequences differ and none ever varies,
	 *   NAN if no chain came.
	 * - tile_error: the relative standard error of the tile's mean brightness from the spread between sequences
	 *   (sqrt(V / sequences) over the mean, without b's own error); NAN if the tile is dark.
	 * - tile_energy_share: the tile's share of the crop's energy.
	 */
	uint32_t tiles_across, tiles_down;
	float *r_hat, *tile_error, *tile_energy_share;
	struct path_class_energy classes[PATH_CLASSES];
	/* For samples whose brightest contributions are spread by chains (erpt): the chains' share of b, and of its
	 * variance between the groups; NAN where that is 0 / 0. */
	double chains_energy_share, chains_variance_share;
	double b, b_error;	  /* pooled b; its standard error (chains), valid unless stated_error_print_b_doubt says
				     otherwise */
	double b_tail_index;	  /* tail index of the independent samples whose mean is b; 0: not known */
	double overlong_share;	  /* share of the energy in paths too long for the chains' state */
	uint64_t samples, rounds; /* sum of COUNT_SAMPLES, and complete rounds, of this image */
	struct canvas_counts counts; /* counters of this image, with the contributions that the bootstrap refused */
	bool is_black;		     /* all pixels are 0 */
};

#endif
