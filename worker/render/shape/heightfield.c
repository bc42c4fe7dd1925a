/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The height field of Mitsuba 0.6: the luminance of an image, times `scale`, is the height along z over the square from
 * (-1,-1) to (1,1). Each pixel is a vertex, the top row is at y = -1, and texture coordinates run over the square with
 * x and y. Between four pixels there are two triangles, where Mitsuba has a bilinear patch.
 *
 * Shading normals are those of Mitsuba: in units of pixels, the mean of the unit normals that the adjacent patches have
 * at the vertex. Mitsuba first resamples images to sides of 2^n + 1 pixels; here they are used unchanged.
 *
 * Creation fails if there is neither a file nor a bitmap, or both, or if the image has less than 2 x 2 pixels or more
 * than a mesh may have.
 */
#include "worker/render/image/image.h"
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"

#include "common/base/liveness.h"

#include <string.h>

struct height_field {
	struct image image;
	double scale;
};

static double height_at(const struct height_field *f, uint32_t x, uint32_t y)
{
	const float *p = f->image.pixels + ((size_t)y * f->image.width + x) * f->image.channels;
	double z = (double)p[0];
	if (f->image.channels == 3)
		z = 0.212671 * (double)p[0] + 0.71516 * (double)p[1] + 0.072169 * (double)p[2];
	return f->scale * z;
}

/* Returns the texture inside nested `scale` textures, and multiplies *scale by their factors. */
static const struct scene_node *unwrap_scale(const struct scene_node *texture, double *scale)
{
	while (texture && strcmp(texture->type, "scale") == 0) {
		const struct property *factor = node_find_property(texture, "scale");
		if (factor && factor->value.type != VALUE_FLOAT && factor->value.type != VALUE_INT)
			break;
		*scale *= node_float(texture, "scale", 1);
		texture = node_child(texture, PLUGIN_TEXTURE, 0);
	}
	return texture;
}

/* Reads the image, which is decoded like colours unless the node says that it contains raw numbers. */
static int read_image(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		      struct height_field *f, struct error *e)
{
	const struct scene_node *texture = unwrap_scale(node_child(n, PLUGIN_TEXTURE, 0), &f->scale),
				*source = texture ? texture : n;
	if ((texture != NULL) == (node_find_property(n, "filename") != NULL))
		return node_error(n, e, EINVAL, "needs either a filename or a bitmap inside");
	if (texture && strcmp(texture->type, "bitmap") != 0)
		return node_error(texture, e, ENOTSUP, "the heights of a heightfield come from a bitmap");
	enum image_channel channel = image_channel_named(node_string(source, "channel", "all"));
	struct asset a;
	int r = mesh_open_file(source, assets, &a, e);
	if (r)
		return r;
	struct error inner;
	double gamma = node_float(source, "gamma", -1);
	bool raw = node_bool(source, "raw", gamma > 0);
	r = image_decode(a.bytes, a.size, node_string(source, "filename", ""), raw, channel, arena, &f->image, &inner);
	assets->close(assets->user, &a);
	if (!r)
		r = image_apply_power(&f->image, raw && gamma > 0 ? gamma : 1, &inner);
	return r ? node_error(source, e, -r, "%s", inner.text) : 0;
}

static void add_normal(double *normal, double x, double y)
{
	double length = sqrt(x * x + y * y + 1);
	normal[0] += x / length;
	normal[1] += y / length;
	normal[2] += 1 / length;
}

/* Computes the normals, first in units of pixels, then of the square, in which pixels are at distances of `step_x` and
 * `step_y`. */
static void set_normals(const struct height_field *f, struct mesh *m, double step_x, double step_y)
{
	uint32_t width = f->image.width, height = f->image.height;
	for (uint32_t y = 0; y + 1 < height; y++)
		for (uint32_t x = 0; x + 1 < width; x++) {
			double(*n)[3] = m->normal + (size_t)y * width + x;
			double z00 = height_at(f, x, y), z10 = height_at(f, x + 1, y), z01 = height_at(f, x, y + 1),
			       z11 = height_at(f, x + 1, y + 1);
			add_normal(n[0], z00 - z10, z00 - z01);
			add_normal(n[1], z00 - z10, z10 - z11);
			add_normal(n[width], z01 - z11, z00 - z01);
			add_normal(n[width + 1], z01 - z11, z10 - z11);
		}
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		vec3 n = {m->normal[i][0] / step_x, m->normal[i][1] / step_y, m->normal[i][2]};
		vec3_store(m->normal[i], vec3_unit_or_zero(n));
	}
}

static void set_triangles(const struct height_field *f, struct mesh *m)
{
	uint32_t width = f->image.width, height = f->image.height, k = 0;
	for (uint32_t y = 0; y + 1 < height; y++)
		for (uint32_t x = 0; x + 1 < width; x++) {
			uint32_t corner = y * width + x;
			memcpy(m->index[k++], (uint32_t[3]){corner + width, corner, corner + width + 1},
			       sizeof *m->index);
			memcpy(m->index[k++], (uint32_t[3]){corner + width + 1, corner, corner + 1}, sizeof *m->index);
		}
}

static int make_mesh(const struct height_field *f, bool smooth, const struct scene_node *n, struct arena *arena,
		     struct mesh *m, struct error *e)
{
	uint32_t width = f->image.width, height = f->image.height;
	if (width < 2 || height < 2)
		return node_error(n, e, EINVAL, "an image of %u x %u pixels is too small; heights need 2 x 2", width,
				  height);
	uint64_t triangles = 2 * (uint64_t)(width - 1) * (height - 1);
	if (triangles > MESH_TRIANGLES_MAX)
		return node_error(n, e, EFBIG, "an image of %u x %u pixels makes more than %d triangles", width, height,
				  MESH_TRIANGLES_MAX);
	if (!mesh_alloc(m, width * height, (uint32_t)triangles, smooth, true, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	double step_x = 2.0 / (width - 1), step_y = 2.0 / (height - 1);
	for (uint32_t y = 0; y < height; y++) {
		liveness_tick();
		for (uint32_t x = 0; x < width; x++) {
			uint32_t i = y * width + x;
			vec3_store(m->position[i], (vec3){step_x * x - 1, step_y * y - 1, height_at(f, x, y)});
			m->uv[i][0] = 0.5 * step_x * x;
			m->uv[i][1] = 0.5 * step_y * y;
		}
	}
	set_triangles(f, m);
	if (smooth)
		set_normals(f, m, step_x, step_y);
	return 0;
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct arena decoded = {0};
	struct height_field f = {.scale = node_float(n, "scale", 1)};
	bool smooth = node_bool(n, "shading_normals", true);
	int r = read_image(n, assets, &decoded, &f, e);
	if (!r)
		r = make_mesh(&f, smooth, n, arena, &out->mesh, e);
	out->has_face_normals = !smooth;
	arena_fini(&decoded);
	return r;
}

const struct shape_ops shape_ops_heightfield = {
	.decl = {PLUGIN_SHAPE, "heightfield",
		 PARAMS({"filename", UNDERSTOOD(VALUE_STRING)},
			{"scale", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, -PARAM_LENGTH_MAX, PARAM_LENGTH_MAX, NULL},
			{"shading_normals", UNDERSTOOD(VALUE_BOOL)},
			{"width", IGNORED}, /* only for textures that are not images, which are refused */
			{"height", IGNORED}, SHAPE_PARAMS),
		 1u << PLUGIN_BSDF | 1u << PLUGIN_EMITTER | 1u << PLUGIN_TEXTURE, PARAM_UNDERSTOOD},
	.build = build,
};
