/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads images as tables of texels, and looks these up with wrap modes and a filter. An image is decoded once for all
 * textures that use it in the same way, if the assets have a cache.
 *
 * Reading fails, with the position of the node, if the file is missing or is not an image. Look-ups cannot fail.
 */
#include "worker/render/texture/raster.h"

#include <string.h>

static int decode_image(struct raster *r, const struct scene_node *n, const struct asset_source *assets,
			const struct picture_key *k, struct arena *arena, struct error *e)
{
	struct arena decoded = {0};
	struct image image;
	struct asset_range file;
	struct error reason;
	int code = asset_part_open(&file, n, assets, e);
	if (code)
		return code;
	bool grey = k->channel == IMAGE_LUMINANCE || k->channel == IMAGE_MEAN;
	code = image_decode(file.bytes, file.size, k->name, k->is_linear, grey ? IMAGE_ALL : k->channel, &decoded,
			    &image, &reason);
	asset_range_close(&file, assets);
	if (!code)
		code = image_apply_power(&image, k->power, &reason);
	if (!code && grey)
		image_convert_to_grey(&image, k->channel);
	if (!code && (code = indexed_image_make(&image, arena, &r->image, &reason)))
		error_prefix(&reason, code, "%s", k->name);
	arena_fini(&decoded);
	return code ? node_error(n, e, -code, "%s", reason.text) : 0;
}

/* Returns the number of pixels with a value below `min`. */
static uint64_t count_pixels_below(const struct indexed_image *i, double min)
{
	size_t numbers = indexed_image_palette_count(i), values = (size_t)i->width * i->height * i->channels;
	uint64_t count = 0;
	bool has_any = false;
	for (size_t k = 0; k < numbers && !has_any; k++)
		has_any = (double)i->palette[k] < min;
	for (size_t k = 0; k < values && has_any; k += i->channels) {
		bool below = false;
		for (size_t c = 0; c < i->channels; c++)
			below |= (double)indexed_image_value(i, k + c) < min;
		count += below;
	}
	return count;
}

/* Notes that node n has read an image with so many pixels below its range. One file may be read in several ways. */
static void note_raised(struct raised_pictures *all, const struct scene_node *n, uint64_t pixels)
{
	if (pixels == 0)
		return;
	if (!all->first) {
		all->first = n;
		all->pixel_count = pixels;
		return;
	}
	all->has_others |= strcmp(node_string(all->first, "filename", ""), node_string(n, "filename", "")) != 0;
}

/* Applies the threshold, if there is one, and clamps to the range. Returns whether a pixel was outside the range. */
static bool clamp_to_range(struct indexed_image *i, double threshold, const struct raster_options *options)
{
	size_t count = indexed_image_palette_count(i);
	bool is_changed = false;
	for (size_t k = 0; k < count; k++) {
		float x = i->palette[k];
		if (threshold >= 0)
			x = (double)x >= threshold ? 1 : 0;
		float y = (double)x < options->min   ? (float)options->min
			  : (double)x > options->max ? (float)options->max
						     : x;
		is_changed |= y != x;
		i->palette[k] = y;
	}
	return is_changed;
}

int raster_read(struct raster *r, const struct scene_node *n, const struct asset_source *assets,
		const struct raster_options *options, struct arena *arena, struct error *e)
{
	const char *name = node_string(n, "filename", NULL), *channel = node_string(n, "channel", "all");
	enum image_channel selected = image_channel_named(channel);
	double gamma = node_float(n, "gamma", 0);
	if (!name)
		return node_error(n, e, EINVAL, "\"%s\" needs a filename", n->type);
	if (gamma < 0 && gamma != -1)
		return node_error(n, e, EINVAL, "gamma = %g; it is -1 (sRGB), 1 (linear) or another positive number",
				  gamma);
	const struct picture_key key = {
		.name = name,
		.first_byte = node_int(n, "first_byte", 0),
		.byte_count = node_int(n, "byte_count", 0),
		.skip_bytes = node_int(n, "skip_bytes", 0),
		.is_base64 = node_bool(n, "base64", false),
		.is_linear = gamma > 0 || node_bool(n, "raw", options->is_raw_by_default && gamma != -1),
		.channel = selected == IMAGE_ALL ? options->default_channel : selected,
		.threshold = node_float(n, "threshold", -1),
		.power = gamma > 0 ? gamma : 1,
	};
	struct picture_cache *cache =
		assets->picture_cache && assets->picture_cache->arena == arena ? assets->picture_cache : NULL;
	r->shared = cache ? picture_find(cache, &key, options->min, options->max) : NULL;
	if (r->shared) {
		r->image = r->shared->image;
		return 0;
	}
	int code = decode_image(r, n, assets, &key, arena, e);
	if (code)
		return code;
	if (cache && !(key.threshold >= 0))
		note_raised(&cache->raised, n, count_pixels_below(&r->image, options->min));
	bool was_clamped = clamp_to_range(&r->image, key.threshold, options);
	if (cache)
		r->shared = picture_add(cache, &key, &r->image, options->min, options->max, was_clamped, arena);
	return 0;
}

void raster_pixel(const struct raster *r, uint32_t x, uint32_t y, double rgb[3])
{
	size_t index = ((size_t)y * r->image.width + x) * r->image.channels;
	for (size_t k = 0; k < 3; k++)
		rgb[k] = (double)indexed_image_value(&r->image, r->image.channels == 3 ? index + k : index);
}

enum { OUTSIDE = UINT32_MAX }; /* index of columns and rows in a border of one colour */

static bool has_border(enum raster_wrap mode)
{
	return mode == RASTER_BLACK || mode == RASTER_WHITE;
}

/* Maps x into the unit interval, or near it if the image has a border. */
static double wrap_coordinate(double x, enum raster_wrap mode)
{
	if (!isfinite(x))
		return 0;
	if (has_border(mode))
		return fmin(fmax(x, -1), 2);
	if (mode == RASTER_CLAMP)
		return fmin(fmax(x, 0), 1);
	if (mode == RASTER_REPEAT)
		return x - floor(x);
	double y = x - 2 * floor(0.5 * x);
	return y > 1 ? 2 - y : y;
}

/* Returns the index of the pixel that stands for the i-th, which may be one beyond the edge: on the opposite side if
 * repeated, the outermost pixel if mirrored or clamped. */
static uint32_t wrap_index(int64_t i, uint32_t n, enum raster_wrap mode)
{
	if (has_border(mode) && (i < 0 || i >= (int64_t)n))
		return OUTSIDE;
	if (i < 0)
		return mode == RASTER_REPEAT ? n - 1 : 0;
	if (i >= (int64_t)n)
		return mode == RASTER_REPEAT ? 0 : n - 1;
	return (uint32_t)i;
}

static void load_texel(const struct raster *r, uint32_t x, uint32_t y, double rgb[3])
{
	if (x != OUTSIDE && y != OUTSIDE) {
		raster_pixel(r, x, y, rgb);
		return;
	}
	rgb[0] = rgb[1] = rgb[2] = (x == OUTSIDE ? r->wrap_u : r->wrap_v) == RASTER_WHITE;
}

/* The four pixels around a position, and the position between their centres, from 0 to 1. */
struct corners {
	double c[4][3], fx, fy;
};

static void find_corners(const struct raster *r, double u, double v, struct corners *k)
{
	uint32_t w = r->image.width, h = r->image.height;
	double x = wrap_coordinate(u, r->wrap_u) * w, y = wrap_coordinate(v, r->wrap_v) * h;
	int64_t i = (int64_t)floor(x - 0.5), j = (int64_t)floor(y - 0.5);
	k->fx = x - 0.5 - (double)i;
	k->fy = y - 0.5 - (double)j;
	uint32_t xs[2] = {wrap_index(i, w, r->wrap_u), wrap_index(i + 1, w, r->wrap_u)};
	uint32_t ys[2] = {wrap_index(j, h, r->wrap_v), wrap_index(j + 1, h, r->wrap_v)};
	for (int n = 0; n < 4; n++)
		load_texel(r, xs[n & 1], ys[n >> 1], k->c[n]);
}

static uint32_t nearest_index(double u, uint32_t n, enum raster_wrap mode)
{
	return wrap_index((int64_t)floor(wrap_coordinate(u, mode) * n), n, mode == RASTER_REPEAT ? RASTER_CLAMP : mode);
}

static void eval_nearest(const struct raster *r, double u, double v, double rgb[3])
{
	load_texel(r, nearest_index(u, r->image.width, r->wrap_u), nearest_index(v, r->image.height, r->wrap_v), rgb);
}

static double interpolate(const struct corners *q, int k)
{
	return (1 - q->fy) * ((1 - q->fx) * q->c[0][k] + q->fx * q->c[1][k]) +
	       q->fy * ((1 - q->fx) * q->c[2][k] + q->fx * q->c[3][k]);
}

void raster_eval(const struct raster *r, double u, double v, double rgb[3])
{
	struct corners q;
	if (r->is_nearest) {
		eval_nearest(r, u, v, rgb);
		return;
	}
	find_corners(r, u, v, &q);
	for (int k = 0; k < 3; k++)
		rgb[k] = interpolate(&q, k);
}

/* Returns the pixels per unit of u; negative where the image is mirrored. */
static double pixels_per_unit(double x, uint32_t pixels, enum raster_wrap mode)
{
	bool backwards = mode == RASTER_MIRROR && isfinite(x) && x - 2 * floor(0.5 * x) > 1;
	return backwards ? -(double)pixels : (double)pixels;
}

void raster_eval_derivatives(const struct raster *r, double u, double v, struct raster_derivatives *out)
{
	struct corners q;
	*out = (struct raster_derivatives){.x = {0}};
	if (r->is_nearest) {
		eval_nearest(r, u, v, out->x);
		return;
	}
	find_corners(r, u, v, &q);
	double su = pixels_per_unit(u, r->image.width, r->wrap_u), sv = pixels_per_unit(v, r->image.height, r->wrap_v);
	for (int k = 0; k < 3; k++) {
		double top = q.c[1][k] - q.c[0][k], bottom = q.c[3][k] - q.c[2][k];
		out->x[k] = interpolate(&q, k);
		out->du[k] = su * ((1 - q.fy) * top + q.fy * bottom);
		out->dv[k] = sv * ((1 - q.fx) * (q.c[2][k] - q.c[0][k]) + q.fx * (q.c[3][k] - q.c[1][k]));
		out->duv[k] = su * sv * (bottom - top);
	}
}

bool raster_is_grey(const struct raster *r)
{
	size_t count = (size_t)r->image.width * r->image.height;
	for (size_t i = 0; r->image.channels == 3 && i < count; i++) {
		float x = indexed_image_value(&r->image, 3 * i);
		if (x != indexed_image_value(&r->image, 3 * i + 1) || x != indexed_image_value(&r->image, 3 * i + 2))
			return false;
	}
	return true;
}

double raster_max(const struct raster *r)
{
	size_t count = indexed_image_palette_count(&r->image);
	float m = 0;
	if (r->shared && r->shared->max_value >= 0)
		return r->shared->max_value;
	for (size_t i = 0; i < count; i++)
		m = r->image.palette[i] > m ? r->image.palette[i] : m;
	if (r->shared)
		r->shared->max_value = (double)m;
	return (double)m;
}
