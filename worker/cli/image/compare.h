/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The difference of image A from reference B: the figures of docs/design.md, rules 4. One thread.
 */
#ifndef WORKER_CLI_IMAGE_COMPARE_H
#define WORKER_CLI_IMAGE_COMPARE_H

#include "worker/cli/image/picture.h"

/*
 * relMSE = mean over pixels and channels of (A-B)^2 / (B^2 + (0.01 m)^2), m the mean of B over pixels and channels.
 * Errors omit the worst pixels by relMSE; means, m and the peak are over all pixels. Values of A that are not finite
 * make their pixel infinitely wrong.
 */
struct compare_result {
	double rel_mse, relative_error, rmse; /* relative_error: square root of rel_mse */
	double psnr, peak;		      /* dB; peak: 99.5th percentile of B's values. Infinite for equal images */
	double mean_a[3], mean_b[3], ratio[3], luminance_ratio; /* A's over B's */
	size_t pixels, left_out, not_finite;			/* not_finite: number of pixels of A */
};

/* trim: the share of pixels to omit, in [0,1). -EINVAL: different sizes, or B is not finite everywhere. */
int compare(const struct picture *a, const struct picture *b, double trim, struct compare_result *r, struct error *e);

/* Colours of relative errors, from black (0.1 %) through violet, red and orange to white (100 %); not finite: cyan.
 * Sizes as above. */
int compare_heatmap(const struct picture *a, const struct picture *b, unsigned char *rgb, struct error *e);

#endif
