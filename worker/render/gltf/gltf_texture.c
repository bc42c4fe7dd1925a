/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A texture becomes a `bitmap` with the sampler's wrap modes and the transform of KHR_texture_transform, inside a
 * `scale` if it has a factor. One of the material's sets of texture coordinates becomes the shape's own, whose tangents
 * normal maps use, and a second one its attribute vertex_texcoord.
 *
 * Failures: indices without an entry, textures without an index. A third set becomes a property that no table has, and
 * an image in an unsupported format a texture of such a type: both are refused with that name, or left out with
 * --lenient.
 */
#include "worker/render/gltf/gltf_texture.h"
#include "worker/render/gltf/gltf_buffer.h"

#include <limits.h>
#include <string.h>

enum { NEAREST = 9728, CLAMP = 33071, MIRROR = 33648, REPEAT = 10497 };

static const char *wrap_name(uint64_t mode)
{
	return mode == CLAMP ? "clamp" : mode == MIRROR ? "mirror" : "repeat";
}

static void put_sampler(struct gltf *g, struct xml_element *el, const struct gltf_at *texture)
{
	struct gltf_at s;
	if (gltf_follow(g, texture, texture->json, "sampler", GLTF_SAMPLERS, &s) <= 0)
		return;
	gltf_put_text(g, el, &s, "wrap_mode_u", wrap_name(gltf_whole(g, &s, s.json, "wrapS", REPEAT)));
	gltf_put_text(g, el, &s, "wrap_mode_v", wrap_name(gltf_whole(g, &s, s.json, "wrapT", REPEAT)));
	if (gltf_whole(g, &s, s.json, "magFilter", 0) == NEAREST)
		gltf_put_text(g, el, &s, "filter_type", "nearest");
}

/* KHR_texture_transform: uv' = T R S uv. The rotation is by -r, because v points down. */
static void put_transform(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const json_t *info)
{
	const json_t *t = gltf_extension(g, at, info, "KHR_texture_transform");
	double offset[2] = {0, 0}, scale[2] = {1, 1};
	if (!t)
		return;
	double r = gltf_number(g, at, t, "rotation", 0);
	gltf_numbers(g, at, t, "offset", offset, 2);
	gltf_numbers(g, at, t, "scale", scale, 2);
	mat4 m = mat4_identity();
	m.m[0][0] = cos(r) * scale[0];
	m.m[0][1] = sin(r) * scale[1];
	m.m[1][0] = -sin(r) * scale[0];
	m.m[1][1] = cos(r) * scale[1];
	m.m[0][3] = offset[0];
	m.m[1][3] = offset[1];
	gltf_put_matrix(g, el, at, "to_uv", &m);
}

static uint64_t set_of(struct gltf *g, const struct gltf_at *at, const json_t *info)
{
	const json_t *t = gltf_extension(g, at, info, "KHR_texture_transform");
	uint64_t own = gltf_whole(g, at, info, "texCoord", 0);
	return t ? gltf_whole(g, at, t, "texCoord", own) : own;
}

struct gltf_sets gltf_texture_sets(struct gltf *g, const struct gltf_at *at)
{
	const json_t *metal = json_object_get(at->json, "pbrMetallicRoughness");
	const json_t *gloss = gltf_extension(g, at, at->json, "KHR_materials_pbrSpecularGlossiness");
	const json_t *through = gltf_extension(g, at, at->json, "KHR_materials_diffuse_transmission");
	const json_t *coat = gltf_extension(g, at, at->json, "KHR_materials_clearcoat");
	const json_t *specular = gltf_extension(g, at, at->json, "KHR_materials_specular");
	const json_t *infos[] = {
		json_object_get(at->json, "normalTexture"),
		metal ? NULL : json_object_get(gloss, "diffuseTexture"),
		json_object_get(metal, "baseColorTexture"),
		json_object_get(metal, "metallicRoughnessTexture"),
		json_object_get(at->json, "emissiveTexture"),
		json_object_get(gltf_extension(g, at, at->json, "KHR_materials_transmission"), "transmissionTexture"),
		json_object_get(through, "diffuseTransmissionTexture"),
		json_object_get(through, "diffuseTransmissionColorTexture"),
		json_object_get(coat, "clearcoatTexture"),
		json_object_get(coat, "clearcoatRoughnessTexture"),
		json_object_get(specular, "specularTexture"),
		json_object_get(specular, "specularColorTexture")};
	struct gltf_sets sets = {{0, 0}, 0};
	for (size_t i = 0; i < sizeof infos / sizeof *infos && sets.count < 2; i++) {
		uint64_t own = infos[i] ? set_of(g, at, infos[i]) : 0;
		if (infos[i] && own < UINT_MAX && (sets.count == 0 || own != sets.set[0]))
			sets.set[sets.count++] = (unsigned)own;
	}
	return sets;
}

/* Returns the extension that names the image of a texture without another image, in a format that is not supported:
 * it is refused by this name, or left out. NULL if none is known. */
static const char *foreign_format(const struct gltf_at *texture)
{
	static const char *const formats[] = {"KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"};
	for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
		if (json_object_get(json_object_get(texture->json, "extensions"), formats[i]))
			return formats[i];
	return NULL;
}

void gltf_put_texture(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *name,
		      const json_t *info, const struct gltf_channel *c)
{
	struct gltf_at texture, image;
	struct gltf_range range;
	if (gltf_follow(g, at, info, "index", GLTF_TEXTURES, &texture) <= 0) {
		gltf_fail(g, at, EINVAL, "a texture without an index");
		return;
	}
	/* If the texture has two images, the other one is for readers without WebP. */
	const json_t *webp = gltf_extension(g, &texture, texture.json, "EXT_texture_webp");
	int found = gltf_follow(g, &texture, webp ? webp : texture.json, "source", GLTF_IMAGES, &image);
	if (found == 0 && foreign_format(&texture)) {
		gltf_plugin(g, el, &texture, "texture", foreign_format(&texture), name);
		return;
	}
	/* The exporter lost the image, or it belongs to an unknown extension: refused, or left out with `lenient`. */
	if (found <= 0) {
		gltf_plugin(g, el, &texture, "texture", "unknown_format", name);
		return;
	}
	if (gltf_image_range(g, &image, &range))
		return;
	bool plain = c->factor[0] == 1 && (!c->colour || (c->factor[1] == 1 && c->factor[2] == 1));
	struct xml_element *outer = plain ? NULL : gltf_plugin(g, el, at, "texture", "scale", name);
	if (!plain && c->colour)
		gltf_put_rgb(g, outer, at, "scale", c->factor);
	else if (!plain)
		gltf_put_number(g, outer, at, "scale", c->factor[0]);
	struct xml_element *bitmap =
		gltf_plugin(g, plain ? el : outer, &texture, "texture", "bitmap", plain ? name : NULL);
	gltf_put_range(g, bitmap, &image, &range);
	if (!c->colour)
		gltf_put_bool(g, bitmap, &texture, "raw", true);
	if (c->name)
		gltf_put_text(g, bitmap, &texture, "channel", c->name);
	if (c->cutoff >= 0)
		gltf_put_number(g, bitmap, &texture, "threshold", c->cutoff);
	put_sampler(g, bitmap, &texture);
	put_transform(g, bitmap, at, info);
	const struct gltf_sets sets = gltf_texture_sets(g, at);
	uint64_t own = set_of(g, at, info);
	if (own == sets.set[0])
		return;
	if (sets.count > 1 && own == sets.set[1])
		gltf_put_text(g, bitmap, &texture, "coordinates", "vertex_texcoord");
	else
		gltf_put_text(g, bitmap, at, "texCoord", ELEMENT_UNSUPPORTED);
}

void gltf_put_colour(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *name,
		     const double rgb[3], const json_t *texture)
{
	const struct gltf_channel c = {.colour = true, .factor = {rgb[0], rgb[1], rgb[2]}, .cutoff = -1};
	if (texture)
		gltf_put_texture(g, el, at, name, texture, &c);
	else
		gltf_put_rgb(g, el, at, name, rgb);
}

void gltf_put_share(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *name, double x,
		    const json_t *texture, const char *channel)
{
	const struct gltf_channel c = {.name = channel, .factor = {x}, .cutoff = -1};
	if (texture)
		gltf_put_texture(g, el, at, name, texture, &c);
	else
		gltf_put_number(g, el, at, name, x);
}
