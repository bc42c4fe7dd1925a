/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An image as a function on the plane, u to the right, v DOWN; the unit square shows the image once. Pixel centres are
 * at ((i + 1/2) / width, (j + 1/2) / height). Immutable; any thread.
 */
#ifndef WORKER_RENDER_TEXTURE_RASTER_H
#define WORKER_RENDER_TEXTURE_RASTER_H

#include "worker/render/scene/asset_part.h"
#include "worker/render/image/image.h"
#include "worker/render/scene/scene.h"
#include "worker/render/texture/indexed_image.h"
#include "worker/render/texture/picture_cache.h"

/* RASTER_BLACK, RASTER_WHITE: outside the image the value is 0, or 1. */
enum raster_wrap { RASTER_REPEAT, RASTER_MIRROR, RASTER_CLAMP, RASTER_BLACK, RASTER_WHITE };

struct raster {
	struct indexed_image image;
	enum raster_wrap wrap_u, wrap_v;
	bool is_nearest;	/* otherwise bilinear */
	struct picture *shared; /* NULL: the pixels are not shared */
};

struct raster_options {
	double min, max;	/* pixels outside are clamped */
	bool is_raw_by_default; /* default of the parameter `raw`, unless `gamma` is given */
	/* Default of the parameter `channel`: IMAGE_ALL, IMAGE_LUMINANCE or IMAGE_MEAN. */
	enum image_channel default_channel;
};

/* Reads the image that n names (asset_part.h), and the parameters raw, gamma, channel (r, g, b, a: only this
 * channel, as three equal values) and threshold (pixels become 1 at or above it, 0 below). Returns 0 or a negative
 * error code. */
int raster_read(struct raster *r, const struct scene_node *n, const struct asset_source *assets,
		const struct raster_options *options, struct arena *arena, struct error *e);
#define RASTER_PARAMS                                                                        \
	{.name = "filename", .types = VALUE_STRING}, ASSET_PART_PARAMS,                      \
		{.name = "channel", .types = VALUE_STRING, .choices = "all|r|g|b|a"},        \
		{.name = "threshold", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 2}, \
		{.name = "raw", .types = VALUE_BOOL},                                        \
		{.name = "gamma", .types = VALUE_FLOAT | VALUE_INT, .min = -1, .max = 100},  \
	{                                                                                    \
		.name = "cache", .types = VALUE_BOOL, .status = PARAM_IGNORED                \
	}

void raster_eval(const struct raster *r, double u, double v, double rgb[3]);
/* The value with its derivatives with respect to u and v, and the mixed one. The other second derivatives are 0 between
 * pixel centres. */
struct raster_derivatives {
	double x[3], du[3], dv[3], duv[3];
};
void raster_eval_derivatives(const struct raster *r, double u, double v, struct raster_derivatives *out);
void raster_pixel(const struct raster *r, uint32_t x, uint32_t y, double rgb[3]);
bool raster_is_grey(const struct raster *r);
double raster_max(const struct raster *r);

#endif
