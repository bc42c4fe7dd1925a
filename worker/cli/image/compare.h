/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Measures the difference of image A from reference B by the figures of docs/design.md, rules 4. One thread.
 */
#ifndef WORKER_CLI_IMAGE_COMPARE_H
#define WORKER_CLI_IMAGE_COMPARE_H

#include "worker/cli/image/picture.h"

/*
 * relMSE = mean over pixels and channels of (A-B)^2 / (B^2 + (0.01 m)^2), m the mean of B over pixels and channels.
 * relMSE, RMSE and PSNR omit the pixels with the largest relative errors, if asked to; means, m and the peak are over
 * all pixels. A pixel with a value of A that is not finite has an infinite error.
 */
struct compare_result {
	double rel_mse, rel_error, rmse; /* rel_error: square root of rel_mse */
	double psnr, peak; /* dB, infinite for equal images; 99.5th percentile of B's values, the peak of the PSNR */
	double mean_a[3], mean_b[3], ratio[3], luminance_ratio; /* ratios of A to B */
	/* Pixels in all; omitted; of A with values that are not finite. */
	size_t pixel_count, trimmed_count, not_finite_count;
};

/* Compares two images of equal size. trim: the share of pixels to omit, in [0,1). Returns -EINVAL if the sizes differ
 * or a value of B is not finite, or -ENOMEM. */
int compare_to_reference(const struct picture *a, const struct picture *b, double trim, struct compare_result *r,
			 struct error *e);

/* Shows the relative error of each pixel as a colour, from black (0.1 %) through violet, red and orange to white
 * (100 %), and cyan if it is not finite. rgb: 3 bytes per pixel. Errors as for compare_to_reference. */
int compare_heatmap(const struct picture *a, const struct picture *b, unsigned char *rgb, struct error *e);

#endif
