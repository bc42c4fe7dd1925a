/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Computes the relMSE of an image and its interval from the sums over the pixels.
 *
 * Estimate. The relMSE is the mean over pixels and channels of the squared standard error over B^2 + (0.01 m)^2. It
 * equals the mean, over groups, of the squared weighted distance between a group's image and the mean image, divided by
 * groups - 1.
 *
 * Distribution. The estimate is approximately its expectation times chi-square over its degrees of freedom. These
 * follow from the spread of the groups' distances (Satterthwaite 1946), but are at most what effective_degrees allows:
 * 16 distances may lie close together by chance, which the products of pairs hardly do. The error of the image at hand,
 * divided by the estimate, follows an F distribution with `degrees` and own * (groups - 1) degrees, where `degrees` is
 * effective_degrees reduced
 * - by (groups - 1) / (groups + 2), because it is estimated from few groups itself; this is the factor by which
 *   Student's t is wider than the normal distribution;
 * - by the doubt of the weights, counted twice, since a brightness that comes in rare hits is skewed;
 * - by heavy tails, since the variance of a variance is (kurtosis - 1) / 2 times that of normal values. The kurtosis of
 *   a few groups is too small where tails are heavy, hence the power of 1.5, a result of calibration
 *   (tests/image/README.md).
 *
 * Interval. The quantiles of F are multiplied by the lower and the upper bound of the sums over the pixels. In the
 * upper bound, the parts of pixels that were divided by a block's brightness count twice, since some of these pixels
 * are darker than their block.
 *
 * Doubt. The interval is declared unknown if too much of the estimate comes from pixels about which too little is known
 * (the limits are results of calibration, too), or if errors are so unequal that the largest may be still to come:
 * their tail index does not rule out an infinite variance, or there are so few groups and pixels that neither the tail
 * index nor the groups of single pixels would show it.
 */
#include "common/estimate/canvas_interval.h"

#include "common/estimate/quantile.h"
#include "common/estimate/tail.h"

#include <math.h>

static const double tail_power = 1.5, max_dark_share = 0.5, max_one_group_share = 0.4;
/* The ratio of the interval's upper to its lower end may be up to `max_end_ratio`, and up to `max_end_ratio_factor`
 * times the ratio that it would have without heavy tails and uncertain brightness: an error that all pixels share may
 * happen to be nearly zero, and then the interval is wide for this reason alone. */
static const double max_end_ratio = 100, max_end_ratio_factor = 4;

/*
 * Returns how many errors vary independently in the error image of a group: (sum l)^2 / sum l^2 over the eigenvalues l
 * of the covariance of a group's error e; 1 if all pixels err together, as they do by an error of b. Both sums are
 * estimated without bias from differences of disjoint pairs of groups: |e1 - e2|^2 |e3 - e4|^2 / 4 and
 * ((e1 - e2) . (e3 - e4))^2 / 4, averaged over all sets of four groups. No fourth power of a group's own error occurs,
 * so a firefly does not look like an error of the whole image. The second sum never exceeds the first.
 */
static double effective_degrees(const struct error_sums *s)
{
	uint32_t n = s->groups < ERROR_GROUPS_FOLDED ? s->groups : ERROR_GROUPS_FOLDED;
	double total = 0, square_total = 0, k[ERROR_GROUPS_FOLDED][ERROR_GROUPS_FOLDED];
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t j = i; j < n; j++)
			k[i][j] = k[j][i] = s->gram[i][j];
	for (uint32_t a = 0; a < n; a++)
		for (uint32_t b = a + 1; b < n; b++)
			for (uint32_t c = a + 1; c < n; c++)
				for (uint32_t d = c + 1; d < n; d++) {
					if (c == b || d == b)
						continue;
					double cross = k[a][c] - k[a][d] - k[b][c] + k[b][d];
					square_total += cross * cross;
					total += (k[a][a] + k[b][b] - 2 * k[a][b]) * (k[c][c] + k[d][d] - 2 * k[c][d]);
				}
	double max_degrees = 1e6;
	return !(total > square_total) ? 1 : total < max_degrees * square_total ? total / square_total : max_degrees;
}

/* Returns the relative variance of the groups' distances, which is 2 over the degrees of freedom of one group. Dividing
 * by the mean distance has a bias if all pixels err together, which the last factor removes. */
static double distance_spread(const struct error_sums *s, double mean)
{
	double groups = s->groups, square = 0;
	for (uint32_t g = 0; g < s->groups; g++)
		square += (s->distance[g] / mean - 1) * (s->distance[g] / mean - 1);
	square /= groups - 1;
	return square * (1 + fmin(square, 2) / groups);
}

/* Returns the factor by which heavy tails reduce the degrees of freedom; at least 1. */
static double heavy_tail_factor(const struct error_sums *s)
{
	double n = s->groups, kurtosis = s->total > 0 ? s->kurtosis_total / s->total * (n + 1) / (n - 1) : 3;
	return kurtosis > 3 ? pow((kurtosis - 1) / 2, tail_power) : 1;
}

/* Tail index of errors below which their squares, whose mean the relMSE is, have no expectation. */
static const double finite_variance_index = 2;

/* Sets the reason, if any, why the interval is not known. normal_end_ratio: the ratio of its ends without heavy tails
 * and uncertain brightness. */
static void set_doubt(const struct error_sums *s, double normal_end_ratio, struct canvas_image *img)
{
	double dark = s->total > 0 ? s->dark_total / s->total : 0,
	       one_group = s->total > 0 ? s->one_group_total / s->total : 0;
	if (one_group > max_one_group_share) {
		img->rel_mse_doubt = ERROR_DOUBT_ONE_GROUP;
		img->doubtful_share = one_group;
	} else if (dark > max_dark_share) {
		img->rel_mse_doubt = ERROR_DOUBT_DARK;
		img->doubtful_share = dark;
	} else if (!(img->rel_mse_interval_95[1] <=
		     fmax(max_end_ratio, max_end_ratio_factor * normal_end_ratio) * img->rel_mse_interval_95[0])) {
		img->rel_mse_doubt = ERROR_DOUBT_WIDE;
	} else if (!(s->tail_index > img->error_tail_critical)) {
		img->rel_mse_doubt = ERROR_DOUBT_TAIL;
	} else if (s->groups < ERROR_GROUPS_MIN && s->tail_index == INFINITY) {
		img->rel_mse_doubt = ERROR_DOUBT_FEW_GROUPS;
	}
	if (img->rel_mse_doubt)
		img->rel_mse_interval_95[0] = img->rel_mse_interval_95[1] = NAN;
}

void canvas_compute_interval(struct error_sums *s, struct canvas_image *img)
{
	double groups = s->groups, mean = 0;
	img->error_tail_index = s->tail_index;
	img->error_tail_critical = tail_index_critical(finite_variance_index, s->tail_count);
	for (uint32_t g = 0; g < s->groups && s->groups <= ERROR_GROUPS_FOLDED; g++)
		s->distance[g] = s->gram[g][g];
	for (uint32_t g = 0; g < s->groups; g++)
		mean += s->distance[g] / groups;
	img->rel_mse = img->rel_mse_as_measured = img->rel_mse_upper = img->rel_mse_interval_95[0] =
		img->rel_mse_interval_95[1] = mean / (groups - 1) / (3.0 * img->width * img->height);
	if (!(mean > 0))
		return;
	double brightness_variance = s->total > 0 ? s->brightness_variance / (s->total * s->total) : 0,
	       degrees = effective_degrees(s);
	img->rel_mse_degrees =
		1 / (0.5 * brightness_variance + fmax(1 / degrees, 0.5 * distance_spread(s, mean)) / (groups - 1));
	degrees = (groups - 1) / (groups + 2) / (1 / degrees + brightness_variance);
	degrees = fmax(degrees, 1);
	double normal_end_ratio =
		f_quantile(0.975, degrees, degrees * (groups - 1)) / f_quantile(0.025, degrees, degrees * (groups - 1));
	degrees = fmax(1, degrees / heavy_tail_factor(s));
	double low = s->total > 0 ? fmin(1, s->lower_bound / s->total) : 1,
	       high = s->total > 0 ? fmax(1, (s->upper_bound + s->dark_total) / s->total) : 1;
	img->rel_mse_as_measured *= low;
	img->rel_mse_upper *= high * f_quantile(0.95, degrees, degrees * (groups - 1));
	img->rel_mse_interval_95[0] *= low * f_quantile(0.025, degrees, degrees * (groups - 1));
	img->rel_mse_interval_95[1] *= high * f_quantile(0.975, degrees, degrees * (groups - 1));
	set_doubt(s, normal_end_ratio, img);
}
