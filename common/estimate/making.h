/* SPDX-License-Identifier: Apache-2.0 */
/* What the making of an image shares. Private to common/estimate. */
#ifndef COMMON_ESTIMATE_MAKING_H
#define COMMON_ESTIMATE_MAKING_H

#include "common/estimate/canvas_image.h"
#include "common/film/canvas_films.h"
#include "common/film/moments_sums.h"

/* An image on its way. */
struct making {
	const struct canvas *c;
	struct canvas_image *img;
	bool open_rounds;
	struct tally *all;		/* prefix, bootstrap and, for a preview, the open rounds */
	double factor[PLAN_MAX_GROUPS]; /* grid units to the group's image; 0: the group has nothing */
	double pooled_factor;
	double b[PLAN_MAX_GROUPS];
};

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

/* Fills error and the relMSE of an image whose rgb is there; two or more groups, no open rounds. -ENOMEM */
int canvas_error(struct making *m, struct error *e);

/* What moments_image needs of a group: independent samples of its bootstrap, mutations that are merged, b. */
struct moments_group {
	uint64_t bootstrap, mutations;
	double b;
};
/* Fills img->classes and, where there are complete rounds of chains and this is no preview, the arrays by tile. */
int moments_image(const struct moments *m, const struct moments_group *groups, uint64_t rounds, bool open_rounds,
		  struct canvas_image *img, struct error *e);

#endif
