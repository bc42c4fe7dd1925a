/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An image file. (u,v) = (0,0) is the upper left corner of the image in both dialects: Mitsuba's OBJ loaders invert v
 * (flip_tex_coords), and its bitmaps do not. Reflectances are clamped to [0,1]. Interpolation is in linear RGB. The
 * filters trilinear, anisotropic and ewa are treated as bilinear: there are no footprints, and sampling filters
 * instead. `isotropic` and `none` are names from before 0.5.
 *
 * Creation fails if the file is not an image, or if the mesh does not have the attribute that `coordinates` names.
 * Evaluation cannot fail: outside [0,1] the wrap mode applies.
 */
#include "common/base/color.h"
#include "worker/render/texture/attribute_table.h"
#include "worker/render/texture/raster.h"
#include "worker/render/texture/texture.h"
#include "worker/render/texture/uv.h"

#include <float.h>
#include <string.h>

enum { BOUND_PIXELS_MAX = 1 << 22 }; /* with more pixels, the upper bound is 1 without a search */

struct bitmap {
	struct raster raster;
	struct uv_map map;
	const float *coordinates; /* (u,v) at each vertex; NULL: those of the shape */
	const uint32_t (*index)[3];
	enum color_role role;
	enum color_kind color_kind;
	double max;
};

/* In the order of enum raster_wrap. `zero` and `one` are names of 0.6 for `black` and `white`. */
#define WRAP_MODES "repeat|mirror|clamp|black|white|zero|one"

static enum raster_wrap parse_wrap_mode(const char *mode)
{
	static const char *const names[] = {"repeat", "mirror", "clamp", "black", "white"};
	if (strcmp(mode, "zero") == 0)
		return RASTER_BLACK;
	if (strcmp(mode, "one") == 0)
		return RASTER_WHITE;
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (strcmp(mode, names[i]) == 0)
			return (enum raster_wrap)i;
	return RASTER_REPEAT;
}

static bool is_nearest(const char *filter)
{
	return strcmp(filter, "nearest") == 0 || strcmp(filter, "none") == 0;
}

static double compute_upper_bound(const struct bitmap *b)
{
	bool white = b->raster.wrap_u == RASTER_WHITE || b->raster.wrap_v == RASTER_WHITE;
	double largest = fmax(raster_max(&b->raster), white ? 1 : 0);
	if (b->role == COLOR_ILLUMINANT)
		return largest * color_max_d65();
	if (b->color_kind == COLOR_KIND_CONSTANT || white)
		return largest;
	uint32_t w = b->raster.image.width, h = b->raster.image.height;
	double bound = 0, *cached_bound = b->raster.shared ? &b->raster.shared->spectrum_bound : NULL;
	if (cached_bound && *cached_bound >= 0)
		return *cached_bound;
	for (uint32_t y = 0; y < h; y++)
		for (uint32_t x = 0; x < w; x++) {
			double rgb[3];
			if ((uint64_t)w * h > BOUND_PIXELS_MAX)
				return 1;
			raster_pixel(&b->raster, x, y, rgb);
			bound = fmax(bound, color_max_rgb_reflectance(rgb));
		}
	if (cached_bound)
		*cached_bound = bound;
	return bound;
}

/* Reads `coordinates`, the name of a mesh attribute that replaces (u,v). */
static int read_coordinates(struct bitmap *b, const struct scene_node *n, const struct texture_build *build,
			    struct error *e)
{
	const char *name = node_string(n, "coordinates", NULL);
	struct attribute_table *table = build->attributes;
	if (!name)
		return 0;
	if (color_role_is_number(b->role))
		return node_error(n, e, ENOTSUP, "a map of heights or normals cannot have `coordinates`");
	if (!table)
		return node_error(n, e, EINVAL, "attributes are only available on a mesh");
	const struct attribute *a = attribute_find(table, name, ATTRIBUTE_COORDINATES, n, e);
	if (!a)
		return -EINVAL;
	const struct attribute_values *v = attribute_values_intern(table, a, false, build->arena);
	if (!v)
		return node_error(n, e, ENOMEM, "out of memory");
	b->coordinates = v->value;
	b->index = table->index;
	return 0;
}

static int bitmap_create(struct texture *t, const struct scene_node *n, enum color_role role,
			 const struct texture_build *build, struct error *e)
{
	struct bitmap *b = t->data;
	if (role == COLOR_UNBOUNDED) /* as in Mitsuba, whose images are limited to 1 unless emitters use them */
		role = COLOR_REFLECTANCE;
	const struct raster_options range = {color_role_is_number(role) ? -DBL_MAX : 0,
					     role == COLOR_REFLECTANCE ? 1 : DBL_MAX, role == COLOR_HEIGHT,
					     !build->is_number	   ? IMAGE_ALL
					     : build->is_dialect_3 ? IMAGE_LUMINANCE
								   : IMAGE_MEAN};
	int code = raster_read(&b->raster, n, build->assets, &range, build->arena, e);
	if (code)
		return code;
	const char *both = node_string(n, "wrap_mode", "repeat");
	b->raster.wrap_u = parse_wrap_mode(node_string(n, "wrap_mode_u", both));
	b->raster.wrap_v = parse_wrap_mode(node_string(n, "wrap_mode_v", both));
	b->raster.is_nearest = is_nearest(node_string(n, "filter_type", "bilinear"));
	b->map = uv_map_read(n);
	b->role = role;
	code = read_coordinates(b, n, build, e);
	if (code || color_role_is_number(role))
		return code;
	b->color_kind = !raster_is_grey(&b->raster) ? COLOR_KIND_OTHER
			: role == COLOR_ILLUMINANT  ? COLOR_KIND_D65
						    : COLOR_KIND_CONSTANT;
	b->max = compute_upper_bound(b);
	return 0;
}

static spectrum bitmap_eval(const struct texture *t, const struct texture_point *point, const struct wavelengths *w)
{
	const struct bitmap *b = t->data;
	double rgb[3], u = point->u, v = point->v;
	if (b->coordinates) {
		u = texture_interpolate(b->coordinates, 2, b->index, point, 0);
		v = texture_interpolate(b->coordinates, 2, b->index, point, 1);
	}
	uv_map_apply(&b->map, &u, &v);
	raster_eval(&b->raster, u, v, rgb);
	return b->role == COLOR_ILLUMINANT ? color_eval_rgb_illuminant(rgb, w) : color_eval_rgb_reflectance(rgb, w);
}

/* The height of a coloured image is its luminance. */
static double bitmap_height(const struct texture *t, double u, double v)
{
	const struct bitmap *b = t->data;
	double rgb[3];
	uv_map_apply(&b->map, &u, &v);
	raster_eval(&b->raster, u, v, rgb);
	return b->raster.image.channels == 1 ? rgb[0] : rec709_luminance(rgb);
}

static void bitmap_eval_derivatives(const struct texture *t, double u, double v, struct texture_derivatives *j)
{
	const struct bitmap *b = t->data;
	const double(*m)[3] = b->map.m;
	struct raster_derivatives p;
	uv_map_apply(&b->map, &u, &v);
	raster_eval_derivatives(&b->raster, u, v, &p);
	j->is_grey = b->raster.image.channels == 1;
	for (int k = 0; k < 3; k++) {
		j->x[k] = p.x[k];
		j->du[k] = m[0][0] * p.du[k] + m[1][0] * p.dv[k];
		j->dv[k] = m[0][1] * p.du[k] + m[1][1] * p.dv[k];
		j->duu[k] = 2 * m[0][0] * m[1][0] * p.duv[k];
		j->duv[k] = (m[0][0] * m[1][1] + m[0][1] * m[1][0]) * p.duv[k];
		j->dvv[k] = 2 * m[0][1] * m[1][1] * p.duv[k];
	}
}

static double bitmap_max(const struct texture *t)
{
	return ((const struct bitmap *)t->data)->max;
}

static double bitmap_aspect(const struct texture *t)
{
	const struct indexed_image *i = &((const struct bitmap *)t->data)->raster.image;
	return (double)i->width / i->height;
}

static enum color_kind bitmap_color_kind(const struct texture *t)
{
	return ((const struct bitmap *)t->data)->color_kind;
}

const struct texture_ops texture_ops_bitmap = {
	.decl = PLUGIN(TEXTURE, "bitmap", RASTER_PARAMS, UV_PARAMS, {.name = "coordinates", .types = VALUE_STRING},
		       {.name = "filter_type",
			.types = VALUE_STRING,
			.choices = "bilinear|nearest|trilinear|anisotropic|ewa|isotropic|none"},
		       {.name = "wrap_mode", .types = VALUE_STRING, .choices = WRAP_MODES},
		       {.name = "wrap_mode_u", .types = VALUE_STRING, .choices = WRAP_MODES},
		       {.name = "wrap_mode_v", .types = VALUE_STRING, .choices = WRAP_MODES},
		       {.name = "max_anisotropy", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED},
		       {.name = "format", .types = VALUE_STRING, .status = PARAM_IGNORED},
		       {.name = "accel", .types = VALUE_BOOL, .status = PARAM_IGNORED}),
	.data_size = sizeof(struct bitmap),
	.create = bitmap_create,
	.eval = bitmap_eval,
	.height = bitmap_height,
	.eval_derivatives = bitmap_eval_derivatives,
	.max = bitmap_max,
	.color_kind = bitmap_color_kind,
	.aspect = bitmap_aspect,
};
