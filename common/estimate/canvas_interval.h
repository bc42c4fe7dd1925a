/* SPDX-License-Identifier: Apache-2.0 */
/* The relMSE of an image and its interval, from sums over the pixels. Private to common/estimate. Pure. */
#ifndef COMMON_ESTIMATE_CANVAS_INTERVAL_H
#define COMMON_ESTIMATE_CANVAS_INTERVAL_H

#include "common/estimate/image.h"

enum { ERROR_FOLDED = 16 };
/* With fewer groups a pixel does not show whether one outweighs the others: of four normal values one nearly always
 * does. */
enum { ERROR_GROUPS = 5 };

/* Sums of the groups' weighted errors over an image. Parts of the relMSE are sums over pixels and channels, not
 * means. */
struct error_sums {
	uint32_t groups;
	double share, doubt; /* parts; their squares times the variances of their weights */
	double low, high;    /* bounds: divided by the brightness with all fireflies, and by what other groups found */
	double dark, one_group; /* parts whose brightness is a block's mean; parts in which one group has most of the
				   variance */
	double kurtosis;	/* of the groups' values, parts as weights */
	double tail;		/* tail index of the groups' relative errors on the bright side; INFINITY: not known */
	size_t tail_errors;	/* number of largest errors used */
	double gram[ERROR_FOLDED][ERROR_FOLDED]; /* products of groups' errors; more groups are folded onto so many */
	double distance[PLAN_MAX_GROUPS];	 /* a group's error, squared */
};

/* Fills in the relMSE, its intervals and the reasons for doubt. */
void canvas_interval(struct error_sums *s, struct canvas_image *img);

#endif
