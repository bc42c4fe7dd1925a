/* SPDX-License-Identifier: Apache-2.0 */
/* The relMSE of an image and its interval, from sums over the pixels. Private to common/estimate. Pure. */
#ifndef COMMON_ESTIMATE_CANVAS_INTERVAL_H
#define COMMON_ESTIMATE_CANVAS_INTERVAL_H

#include "common/estimate/image.h"

enum { ERROR_FOLDED = 16 };

/* Of the groups' weighted errors, over an image. Parts of the relMSE are sums over pixels and channels, not means. */
struct error_sums {
	uint32_t groups;
	double share, doubt; /* parts; their squares times the variances of their weights */
	double low, high;    /* bounds of the same: over brightness with all fireflies, over what other groups found */
	double dark, one_group; /* parts where brightness is a block's mean, not the pixel's; where one group has most
				   of the variance */
	double kurtosis;	/* of the groups' values, parts as weights */
	double tail;		/* index of the groups' relative errors that are too bright; INFINITY: not known */
	size_t tail_errors;	/* by so many of the largest */
	double gram[ERROR_FOLDED][ERROR_FOLDED]; /* products of groups' errors; more groups are folded onto so many */
	double distance[PLAN_MAX_GROUPS];	 /* a group's error, squared */
};

/* Fills the relMSE, its intervals, and what is doubtful of it. */
void canvas_interval(struct error_sums *s, struct canvas_image *img);

#endif
