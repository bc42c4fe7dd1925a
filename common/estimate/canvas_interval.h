/* SPDX-License-Identifier: Apache-2.0 */
/* The relMSE of an image and its interval, from sums over the pixels. Private to common/estimate. Pure. */
#ifndef COMMON_ESTIMATE_CANVAS_INTERVAL_H
#define COMMON_ESTIMATE_CANVAS_INTERVAL_H

#include "common/estimate/image.h"

enum { ERROR_GROUPS_FOLDED = 16 };
/* With fewer groups, the values of a pixel do not show whether one group outweighs the others: of four normally
 * distributed values one nearly always does. */
enum { ERROR_GROUPS_MIN = 5 };

/* Sums of the groups' weighted errors over an image. The relMSE is a mean over pixels and channels; the parts here are
 * the terms of that mean, and sums of them are not divided by their number. */
struct error_sums {
	uint32_t groups;
	double total;		    /* sum of all parts */
	double brightness_variance; /* sum of the variances of parts due to the uncertainty of their brightness */
	double lower_bound;	    /* lower bound of `total`: parts divided by the brightness with all fireflies */
	double upper_bound; /* upper bound of `total`: parts divided by the brightness that the other groups found */
	double dark_total;  /* sum of the parts whose brightness is a block's mean */
	double one_group_total; /* sum of the parts in which one group has most of the variance */
	double kurtosis_total;	/* sum of the kurtosis of the groups' values, weighted by parts */
	double tail_index;	/* tail index of the groups' relative errors on the bright side; INFINITY: not known */
	size_t tail_count;	/* number of largest errors from which it was estimated */
	/* Products of the errors of two groups; further groups are folded. */
	double gram[ERROR_GROUPS_FOLDED][ERROR_GROUPS_FOLDED];
	double distance[PLAN_GROUPS_MAX]; /* squared error of each group, if there are more than ERROR_GROUPS_FOLDED */
};

/* Fills in the relMSE, its interval and the reason for doubt. */
void canvas_compute_interval(struct error_sums *s, struct canvas_image *img);

#endif
