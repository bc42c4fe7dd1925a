/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/image/compare.h"

#include "common/base/color.h"
#include "common/base/mem.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

struct pixel_error {
	double relative, squared; /* means over the channels */
};

static size_t pixel_count(const struct picture *p)
{
	return (size_t)p->image.width * p->image.height;
}

static int check_comparable(const struct picture *a, const struct picture *b, struct error *e)
{
	const struct exr_image *i = &a->image, *j = &b->image;
	if (i->width != j->width || i->height != j->height)
		return error_set(e, EINVAL,
				 "the images have %ux%u and %ux%u pixels; --size WxH averages both to one size",
				 i->width, i->height, j->width, j->height);
	for (int k = 0; k < 3; k++)
		for (size_t p = 0; p < pixel_count(b); p++)
			if (!isfinite(b->rgb[k][p]))
				return error_set(e, EINVAL, "the reference is not finite at pixel %zu,%zu",
						 p % j->width, p / j->width);
	return 0;
}

static double plane_mean(const float *plane, size_t n)
{
	double sum = 0;
	for (size_t i = 0; i < n; i++)
		sum += (double)plane[i];
	return sum / (double)n;
}

/* Returns (0.01 m)^2, m the mean of the reference, which keeps relative errors of black pixels finite. */
static double denominator_floor(const struct picture *b)
{
	double sum = 0;
	for (int k = 0; k < 3; k++)
		sum += plane_mean(b->rgb[k], pixel_count(b));
	return sum / 300 * (sum / 300);
}

static struct pixel_error compute_pixel_error(const struct picture *a, const struct picture *b, size_t i,
					      double min_denominator)
{
	struct pixel_error r = {0, 0};
	for (int k = 0; k < 3; k++) {
		double reference = (double)b->rgb[k][i], d = (double)a->rgb[k][i] - reference;
		r.squared += d * d / 3;
		/* Avoids 0 / 0 for a black image. */
		r.relative += d == 0 ? 0 : d * d / (reference * reference + min_denominator) / 3;
	}
	if (!isfinite(r.squared))
		r = (struct pixel_error){INFINITY, INFINITY};
	return r;
}

static int compare_worst_first(const void *p, const void *q)
{
	const struct pixel_error *a = p, *b = q;
	if (a->relative != b->relative)
		return a->relative > b->relative ? -1 : 1;
	return a->squared == b->squared ? 0 : a->squared > b->squared ? -1 : 1;
}

static int compare_floats(const void *p, const void *q)
{
	float a = *(const float *)p, b = *(const float *)q;
	return a < b ? -1 : a > b;
}

/* Computes a percentile of all values of the three channels, by nearest rank. */
static int percentile(const struct picture *b, double fraction, double *value, struct error *e)
{
	size_t n = pixel_count(b);
	float *values = mem_alloc(n, 3 * sizeof *values);
	if (!values)
		return error_set(e, ENOMEM, "no memory to sort %zu pixels", n);
	for (size_t k = 0; k < 3; k++)
		for (size_t i = 0; i < n; i++)
			values[k * n + i] = b->rgb[k][i];
	qsort(values, n * 3, sizeof *values, compare_floats);
	*value = (double)values[(size_t)ceil(fraction * (double)(n * 3)) - 1];
	mem_free(values);
	return 0;
}

static int compute_errors(const struct picture *a, const struct picture *b, double trim, struct compare_result *r,
			  struct error *e)
{
	size_t n = pixel_count(a);
	double min_denominator = denominator_floor(b), relative = 0, squared = 0;
	struct pixel_error *pixel = mem_alloc(n, sizeof *pixel);
	if (!pixel)
		return error_set(e, ENOMEM, "no memory for the errors of %zu pixels", n);
	for (size_t i = 0; i < n; i++) {
		pixel[i] = compute_pixel_error(a, b, i, min_denominator);
		r->not_finite_count += isinf(pixel[i].squared) != 0;
	}
	r->pixel_count = n;
	r->trimmed_count = (size_t)(trim * (double)n * (1 + 4 * DBL_EPSILON));
	if (r->trimmed_count)
		qsort(pixel, n, sizeof *pixel, compare_worst_first);
	for (size_t i = r->trimmed_count; i < n; i++) {
		relative += pixel[i].relative;
		squared += pixel[i].squared;
	}
	mem_free(pixel);
	double kept_count = (double)(n - r->trimmed_count);
	r->rel_mse = relative / kept_count;
	r->rel_error = sqrt(r->rel_mse);
	r->rmse = sqrt(squared / kept_count);
	return 0;
}

int compare_to_reference(const struct picture *a, const struct picture *b, double trim, struct compare_result *r,
			 struct error *e)
{
	*r = (struct compare_result){0};
	int rc = check_comparable(a, b, e);
	if (rc == 0)
		rc = compute_errors(a, b, trim, r, e);
	if (rc == 0)
		rc = percentile(b, 0.995, &r->peak, e);
	if (rc)
		return rc;
	r->psnr = 20 * log10(r->peak / r->rmse);
	if (r->rmse == 0)
		r->psnr = INFINITY;
	for (int k = 0; k < 3; k++) {
		r->mean_a[k] = plane_mean(a->rgb[k], r->pixel_count);
		r->mean_b[k] = plane_mean(b->rgb[k], r->pixel_count);
		r->ratio[k] = r->mean_a[k] / r->mean_b[k];
	}
	r->luminance_ratio = rec709_luminance(r->mean_a) / rec709_luminance(r->mean_b);
	return 0;
}

/* Returns the colour for t in [0,1]. */
static void heatmap_colour(double t, unsigned char rgb[3])
{
	static const double stops[6][3] = {{0, 0, 0},	   {70, 0, 110},   {190, 20, 60},
					   {245, 110, 10}, {255, 215, 70}, {255, 255, 255}};
	double position = t < 0 ? 0 : t > 1 ? 5 : t * 5;
	size_t i = position < 4 ? (size_t)position : 4;
	for (int k = 0; k < 3; k++)
		rgb[k] = (unsigned char)(stops[i][k] + (stops[i + 1][k] - stops[i][k]) * (position - (double)i) + 0.5);
}

int compare_heatmap(const struct picture *a, const struct picture *b, unsigned char *rgb, struct error *e)
{
	int rc = check_comparable(a, b, e);
	if (rc)
		return rc;
	double min_denominator = denominator_floor(b);
	for (size_t i = 0; i < pixel_count(a); i++) {
		struct pixel_error p = compute_pixel_error(a, b, i, min_denominator);
		if (isinf(p.squared))
			rgb[i * 3] = 0, rgb[i * 3 + 1] = rgb[i * 3 + 2] = 255;
		else
			heatmap_colour((log10(sqrt(p.relative)) + 3) / 3, rgb + i * 3);
	}
	return 0;
}
