/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The relMSE of an image from the sums over its pixels, and the interval of it.
 *
 * The estimate is the mean over pixels and channels of the squared standard error over B^2 + (0.01 m)^2. It equals the
 * mean over groups of their squared distance from the mean, over groups - 1.
 *
 * Of its expectation it is about chi-square over its degrees of freedom, those with the spread that the distances show
 * (Satterthwaite 1946), but no more than own_degrees allows: 16 distances may lie together by chance, the products of
 * pairs hardly. The error at hand over the estimate is F with own_degrees and (groups - 1) times as many. Own degrees
 * are fewer by (groups - 1) / (groups + 2), since they come from so many groups themselves: as much as Student's t is
 * wider than the normal; by the doubt of the weights, twice, since brightness that comes in hits is skewed; by heavy
 * tails: the variance of a variance is (kurtosis - 1) / 2 times the normal's. The kurtosis of a few groups is too small
 *   where tails are heavy, hence the power of 1.5, which is of calibration (tests/image/README.md).
 * The interval begins at the lower bound of the sums and ends at the upper one, in which the part of pixels that are
 * divided by a block's brightness counts twice: some of them are darker than the block, and where that shows, by as
 * much as it may be. It is not known where too much of the estimate comes from pixels of which too little is known
 * (limits are of calibration, too), and where errors are so unequal that those which count most may not have come:
 * where their tail index does not rule out an infinite variance, or where neither it nor the groups of single pixels,
 * of which there are too few, would show that.
 */
#include "common/estimate/canvas_interval.h"

#include "common/estimate/quantile.h"
#include "common/estimate/tail.h"

#include <math.h>

static const double tail_power = 1.5, dark_most = 0.5, one_group_most = 0.4;
/* The maximum ratio of upper to lower end, and the maximum of that over the ratio without heavy tails and uncertain
 * brightness. An error that all pixels share may happen to be nearly zero, so the lower end alone says little. */
static const double widest = 100, widest_of_known = 4;

/*
 * How many errors vary independently in one error image: (sum l)^2 / sum l^2 over the eigenvalues l of the covariance
 * of a group's error; 1 if all pixels err together, as by an error of b. Both sums are estimated without bias from
 * differences of disjoint pairs of groups: |e1 - e2|^2 |e3 - e4|^2 / 4 and ((e1 - e2) . (e3 - e4))^2 / 4, averaged over
 * all sets of four groups. No fourth power of a group's own error occurs, so a firefly does not look like an error of
 * everything. The second sum never exceeds the first.
 */
static double own_degrees(const struct error_sums *s)
{
	uint32_t n = s->groups < ERROR_FOLDED ? s->groups : ERROR_FOLDED;
	double total = 0, square = 0, k[ERROR_FOLDED][ERROR_FOLDED];
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
					square += cross * cross;
					total += (k[a][a] + k[b][b] - 2 * k[a][b]) * (k[c][c] + k[d][d] - 2 * k[c][d]);
				}
	double most = 1e6;
	return !(total > square) ? 1 : total < most * square ? total / square : most;
}

/* Relative variance of the groups' distances: 2 over the degrees of freedom of one group. The factor removes the
 * bias of dividing by the mean distance, which exists if all pixels err together. */
static double distance_spread(const struct error_sums *s, double mean)
{
	double groups = s->groups, square = 0;
	for (uint32_t g = 0; g < s->groups; g++)
		square += (s->distance[g] / mean - 1) * (s->distance[g] / mean - 1);
	square /= groups - 1;
	return square * (1 + fmin(square, 2) / groups);
}

static double heavier_than_normal(const struct error_sums *s)
{
	double n = s->groups, kurtosis = s->share > 0 ? s->kurtosis / s->share * (n + 1) / (n - 1) : 3;
	return kurtosis > 3 ? pow((kurtosis - 1) / 2, tail_power) : 1;
}

/* The relMSE is a mean of squared errors: below this tail index it has no expectation. */
static const double finite_variance = 2;

/* known: ratio of upper to lower end if only the degrees of freedom were uncertain. */
static void find_doubt(const struct error_sums *s, double known, struct canvas_image *img)
{
	double dark = s->share > 0 ? s->dark / s->share : 0, one_group = s->share > 0 ? s->one_group / s->share : 0;
	if (one_group > one_group_most) {
		img->rel_mse_doubt = ERROR_ONE_GROUP;
		img->doubtful_share = one_group;
	} else if (dark > dark_most) {
		img->rel_mse_doubt = ERROR_DARK;
		img->doubtful_share = dark;
	} else if (!(img->rel_mse_95[1] <= fmax(widest, widest_of_known * known) * img->rel_mse_95[0])) {
		img->rel_mse_doubt = ERROR_WIDE;
	} else if (!(s->tail > img->error_tail_least)) {
		img->rel_mse_doubt = ERROR_TAIL;
	} else if (s->groups < ERROR_GROUPS && s->tail == INFINITY) {
		img->rel_mse_doubt = ERROR_FEW_GROUPS;
	}
	if (img->rel_mse_doubt)
		img->rel_mse_95[0] = img->rel_mse_95[1] = NAN;
}

void canvas_interval(struct error_sums *s, struct canvas_image *img)
{
	double groups = s->groups, mean = 0;
	img->error_tail = s->tail;
	img->error_tail_least = tail_index_least(finite_variance, s->tail_errors);
	for (uint32_t g = 0; g < s->groups && s->groups <= ERROR_FOLDED; g++)
		s->distance[g] = s->gram[g][g];
	for (uint32_t g = 0; g < s->groups; g++)
		mean += s->distance[g] / groups;
	img->rel_mse = img->rel_mse_own = img->rel_mse_upper = img->rel_mse_95[0] = img->rel_mse_95[1] =
		mean / (groups - 1) / (3.0 * img->width * img->height);
	if (!(mean > 0))
		return;
	double doubt = s->share > 0 ? s->doubt / (s->share * s->share) : 0, own = own_degrees(s);
	img->rel_mse_degrees = 1 / (0.5 * doubt + fmax(1 / own, 0.5 * distance_spread(s, mean)) / (groups - 1));
	own = (groups - 1) / (groups + 2) / (1 / own + doubt);
	own = fmax(own, 1);
	double known = f_quantile(0.975, own, own * (groups - 1)) / f_quantile(0.025, own, own * (groups - 1));
	own = fmax(1, own / heavier_than_normal(s));
	double low = s->share > 0 ? fmin(1, s->low / s->share) : 1,
	       high = s->share > 0 ? fmax(1, (s->high + s->dark) / s->share) : 1;
	img->rel_mse_own *= low;
	img->rel_mse_upper *= high * f_quantile(0.95, own, own * (groups - 1));
	img->rel_mse_95[0] *= low * f_quantile(0.025, own, own * (groups - 1));
	img->rel_mse_95[1] *= high * f_quantile(0.975, own, own * (groups - 1));
	find_doubt(s, known, img);
}
