/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Splats samples on the film of a lease. A kernel is the product of one in x and one in y; their values are computed
 * once per splat for all pixels in reach. On a panorama, a splat is repeated beyond each edge, so that a kernel that
 * reaches over an edge continues on the other side.
 *
 * Failures: -ENOMEM; -EINVAL for a filter that vanishes, or a window that cuts off a panorama's edge.
 */
#include "worker/render/film/sums.h"

#include "common/base/mem.h"

/* Mitchell and Netravali 1988, eq. 8: the integral is 1 for all B and C. */
static double cubic(double b, double c, double d)
{
	if (d >= 2)
		return 0;
	if (d >= 1)
		return ((((-b - 6 * c) * d + 6 * b + 30 * c) * d - 12 * b - 48 * c) * d + 8 * b + 24 * c) / 6;
	return (((12 - 9 * b - 6 * c) * d - 18 + 12 * b + 6 * c) * d * d + 6 - 2 * b) / 6;
}

static double sinc(double x)
{
	return x > 0 ? sin(M_PI * x) / (M_PI * x) : 1;
}

static double windowed_sinc(double radius, double d)
{
	return d < radius ? sinc(d) * sinc(d / radius) : 0;
}

/* Uses Simpson's rule; the function is smooth except at the ends, where it is 0. */
static double windowed_sinc_integral(double radius)
{
	enum { STEPS = 4096 };
	double sum = 0;
	for (int i = 0; i <= STEPS; i++)
		sum += (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2) * windowed_sinc(radius, radius * i / STEPS);
	return 2 * sum * radius / (3.0 * STEPS);
}

static void splat_on_film(struct splat_target *target, const struct splat *s, double weight)
{
	film_sums_splat((struct film_sums *)(void *)target, s, weight);
}

/* Checks the window of a panorama. Samples beyond its edge are only taken if they are in the window. */
static int check_panorama_window(const struct plan *p, const struct scene_settings *s, struct error *e)
{
	uint32_t b = s->border;
	bool is_inside = p->crop_x >= b && p->crop_y >= b && p->crop_x + p->crop_width + b <= s->width &&
			 p->crop_y + p->crop_height + b <= s->height;
	if (s->projection != PROJECTION_SPHERE || is_inside)
		return 0;
	if (p->crop_width < s->width)
		return error_set(
			e, EINVAL,
			"a window of a panorama that comes within %u pixels of its edges must be as wide as the "
			"panorama, because the filter reaches across its edges",
			b);
	return s->filter_radius <= s->width / 2.0 && s->filter_radius <= p->crop_height
		       ? 0
		       : error_set(e, EINVAL, "the filter's radius of %g pixels is too large for a panorama of %u x %u",
				   s->filter_radius, p->crop_width, p->crop_height);
}

int film_sums_init(struct film_sums *f, const struct plan *p, const struct scene_settings *s, struct error *e)
{
	*f = (struct film_sums){.target = {splat_on_film},
				.x = p->crop_x,
				.y = p->crop_y,
				.width = p->crop_width,
				.height = p->crop_height,
				.filter = s->filter,
				.filter_radius = s->filter_radius};
	int rc = check_panorama_window(p, s, e);
	if (rc)
		return rc;
	if (s->projection == PROJECTION_SPHERE) {
		f->panorama_size[0] = s->width;
		f->panorama_size[1] = s->height;
	}
	f->tiles_x = (f->width + TILE_SIZE - 1) / TILE_SIZE;
	f->tiles_y = (f->height + TILE_SIZE - 1) / TILE_SIZE;
	if (s->filter == FILTER_GAUSSIAN) {
		/* Mitsuba's Gaussian is shifted down so that it ends at zero; the integral is in closed form. */
		double sd = s->filter_stddev, r = s->filter_radius;
		f->gaussian_exponent = 1 / (2 * sd * sd);
		f->gaussian_floor = exp(-f->gaussian_exponent * r * r);
		f->kernel_scale = 1 / (sd * sqrt(2 * M_PI) * erf(r / (sd * M_SQRT2)) - 2 * r * f->gaussian_floor);
		if (!(f->kernel_scale > 0) || !isfinite(f->kernel_scale))
			return error_set(e, EINVAL, "a gaussian filter of deviation %g and radius %g pixels vanishes",
					 sd, r);
	}
	f->cubic_b = s->filter_b;
	f->cubic_c = s->filter_c;
	if (s->filter == FILTER_LANCZOS)
		f->kernel_scale = 1 / windowed_sinc_integral(f->filter_radius);
	f->xyz = mem_alloc((size_t)f->width * f->height * 3, sizeof *f->xyz);
	f->touched_tiles = mem_alloc((size_t)f->tiles_x * f->tiles_y, 1);
	if (!f->xyz || !f->touched_tiles) {
		film_sums_fini(f);
		return error_set(e, ENOMEM, "out of memory for a film of %u x %u pixels", f->width, f->height);
	}
	rc = chain_moments_init(&f->moments, p, e);
	if (rc)
		film_sums_fini(f);
	return rc;
}

void film_sums_fini(struct film_sums *f)
{
	mem_free(f->xyz);
	mem_free(f->touched_tiles);
	chain_moments_fini(&f->moments);
	f->xyz = NULL;
	f->touched_tiles = NULL;
}

double film_sums_kernel(const struct film_sums *f, double distance)
{
	double d = fabs(distance);
	switch (f->filter) {
	case FILTER_BOX:
		return d <= f->filter_radius ? 0.5 / f->filter_radius : 0;
	case FILTER_TENT:
		return d < f->filter_radius ? (1 - d / f->filter_radius) / f->filter_radius : 0;
	case FILTER_GAUSSIAN:
		return d < f->filter_radius ? f->kernel_scale * (exp(-f->gaussian_exponent * d * d) - f->gaussian_floor)
					    : 0;
	case FILTER_CUBIC:
		return cubic(f->cubic_b, f->cubic_c, d);
	case FILTER_LANCZOS:
		return f->kernel_scale * windowed_sinc(f->filter_radius, d);
	}
	return 0;
}

static void add_pixel(struct film_sums *f, uint32_t i, uint32_t j, const double xyz[3], double weight)
{
	double *p = f->xyz + ((size_t)j * f->width + i) * 3;
	for (int k = 0; k < 3; k++)
		p[k] += weight * xyz[k];
	f->touched_tiles[(size_t)(j / TILE_SIZE) * f->tiles_x + i / TILE_SIZE] = 1;
}

/* Finds the first and last pixel (relative to the crop) whose centre is within the radius. Returns false if there
 * is none inside the crop. */
static bool pixels_within(double position, double radius, uint32_t size, uint32_t *first, uint32_t *last)
{
	double lo = fmax(ceil(position - radius - 0.5), 0), hi = fmin(floor(position + radius - 0.5), (double)size - 1);
	if (!(lo <= hi))
		return false;
	*first = (uint32_t)lo;
	*last = (uint32_t)hi;
	return true;
}

enum { KERNEL_PIXELS_MAX = 130 }; /* most pixels that a kernel spans: settings limit its radius to 64 */

static void splat_at(struct film_sums *f, double x, double y, const struct splat *s, double weight)
{
	if (f->filter == FILTER_BOX && f->filter_radius == 0.5) {
		/* A point on the border of two pixels belongs to only one. */
		if (x >= 0 && y >= 0 && x < f->width && y < f->height)
			add_pixel(f, (uint32_t)x, (uint32_t)y, s->xyz, weight);
		return;
	}
	uint32_t i0, i1, j0, j1;
	if (!pixels_within(x, f->filter_radius, f->width, &i0, &i1) ||
	    !pixels_within(y, f->filter_radius, f->height, &j0, &j1) || i1 - i0 >= KERNEL_PIXELS_MAX)
		return;
	double kx[KERNEL_PIXELS_MAX];
	for (uint32_t i = i0; i <= i1; i++)
		kx[i - i0] = film_sums_kernel(f, x - (i + 0.5));
	for (uint32_t j = j0; j <= j1; j++) {
		double ky = film_sums_kernel(f, y - (j + 0.5)) * weight;
		for (uint32_t i = i0; i <= i1; i++)
			if (kx[i - i0] * ky != 0)
				add_pixel(f, i, j, s->xyz, kx[i - i0] * ky);
	}
}

/* Splats on a panorama: beyond its left edge follows the right one; beyond a pole follows the
 * meridian half a turn away. */
static void splat_on_panorama(struct film_sums *f, const struct splat *s, double weight)
{
	double w = f->panorama_size[0], h = f->panorama_size[1];
	const double copies[3][2] = {{s->x, s->y}, {s->x + 0.5 * w, -s->y}, {s->x + 0.5 * w, 2 * h - s->y}};
	for (int i = 0; i < 3; i++)
		for (int turn = -1; turn <= 1; turn++)
			splat_at(f, copies[i][0] + turn * w - f->x, copies[i][1] - f->y, s, weight);
}

void film_sums_splat(struct film_sums *f, const struct splat *s, double weight)
{
	if (f->panorama_size[0] > 0)
		splat_on_panorama(f, s, weight);
	else
		splat_at(f, s->x - f->x, s->y - f->y, s, weight);
}

static int round_tile(const struct film_sums *f, uint32_t tx, uint32_t ty, struct tile *t)
{
	uint32_t x0 = tx * TILE_SIZE, y0 = ty * TILE_SIZE;
	t->x = f->x + x0;
	t->y = f->y + y0;
	t->width = f->width - x0 < TILE_SIZE ? f->width - x0 : TILE_SIZE;
	t->height = f->height - y0 < TILE_SIZE ? f->height - y0 : TILE_SIZE;
	t->xyz = mem_alloc((size_t)t->width * t->height * 3, sizeof *t->xyz);
	if (!t->xyz)
		return -ENOMEM;
	float *out = t->xyz;
	for (uint32_t j = 0; j < t->height; j++) {
		const double *in = f->xyz + ((size_t)(y0 + j) * f->width + x0) * 3;
		for (uint32_t i = 0; i < t->width * 3; i++)
			*out++ = (float)in[i];
	}
	return 0;
}

int film_sums_add_tiles(const struct film_sums *f, struct batch *out, struct error *e)
{
	uint32_t count = 0;
	for (uint32_t i = 0; i < f->tiles_x * f->tiles_y; i++)
		count += f->touched_tiles[i];
	out->tiles = mem_alloc(count, sizeof *out->tiles);
	if (!out->tiles)
		return error_set(e, ENOMEM, "out of memory for tiles");
	for (uint32_t i = 0; i < f->tiles_x * f->tiles_y; i++) {
		if (!f->touched_tiles[i])
			continue;
		if (round_tile(f, i % f->tiles_x, i / f->tiles_x, &out->tiles[out->tile_count]))
			return error_set(e, ENOMEM, "out of memory for tiles");
		out->tile_count++;
	}
	return 0;
}
