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

enum { FILTER_NEAREST = 9728, WRAP_CLAMP = 33071, WRAP_MIRROR = 33648, WRAP_REPEAT = 10497 };

static const char *wrap_name(uint64_t mode)
{
	return mode == WRAP_CLAMP ? "clamp" : mode == WRAP_MIRROR ? "mirror" : "repeat";
}

static void put_sampler(struct gltf *g, struct xml_element *el, const struct gltf_entry *texture)
{
	struct gltf_entry s;
	if (gltf_resolve(g, texture, texture->json, "sampler", GLTF_SAMPLERS, &s) <= 0)
		return;
	gltf_put_string(g, el, &s, "wrap_mode_u", wrap_name(gltf_integer(g, &s, s.json, "wrapS", WRAP_REPEAT)));
	gltf_put_string(g, el, &s, "wrap_mode_v", wrap_name(gltf_integer(g, &s, s.json, "wrapT", WRAP_REPEAT)));
	if (gltf_integer(g, &s, s.json, "magFilter", 0) == FILTER_NEAREST)
		gltf_put_string(g, el, &s, "filter_type", "nearest");
}

/* KHR_texture_transform: uv' = T R S uv. The rotation is by -r, because v points down. */
static void put_transform(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const json_t *info)
{
	const json_t *t = gltf_extension(g, material, info, "KHR_texture_transform");
	double offset[2] = {0, 0}, scale[2] = {1, 1};
	if (!t)
		return;
	double r = gltf_number(g, material, t, "rotation", 0);
	gltf_numbers(g, material, t, "offset", offset, 2);
	gltf_numbers(g, material, t, "scale", scale, 2);
	mat4 m = mat4_identity();
	m.m[0][0] = cos(r) * scale[0];
	m.m[0][1] = sin(r) * scale[1];
	m.m[1][0] = -sin(r) * scale[0];
	m.m[1][1] = cos(r) * scale[1];
	m.m[0][3] = offset[0];
	m.m[1][3] = offset[1];
	gltf_put_matrix(g, el, material, "to_uv", &m);
}

static uint64_t texcoord_set(struct gltf *g, const struct gltf_entry *material, const json_t *info)
{
	const json_t *t = gltf_extension(g, material, info, "KHR_texture_transform");
	uint64_t set = gltf_integer(g, material, info, "texCoord", 0);
	return t ? gltf_integer(g, material, t, "texCoord", set) : set;
}

struct gltf_texcoord_sets gltf_material_texcoord_sets(struct gltf *g, const struct gltf_entry *material)
{
	const json_t *metal = json_object_get(material->json, "pbrMetallicRoughness");
	const json_t *gloss = gltf_extension(g, material, material->json, "KHR_materials_pbrSpecularGlossiness");
	const json_t *diffuse_transmission =
		gltf_extension(g, material, material->json, "KHR_materials_diffuse_transmission");
	const json_t *coat = gltf_extension(g, material, material->json, "KHR_materials_clearcoat");
	const json_t *specular = gltf_extension(g, material, material->json, "KHR_materials_specular");
	const json_t *infos[] = {
		json_object_get(material->json, "normalTexture"),
		metal ? NULL : json_object_get(gloss, "diffuseTexture"),
		json_object_get(metal, "baseColorTexture"),
		json_object_get(metal, "metallicRoughnessTexture"),
		json_object_get(material->json, "emissiveTexture"),
		json_object_get(gltf_extension(g, material, material->json, "KHR_materials_transmission"),
				"transmissionTexture"),
		json_object_get(diffuse_transmission, "diffuseTransmissionTexture"),
		json_object_get(diffuse_transmission, "diffuseTransmissionColorTexture"),
		json_object_get(coat, "clearcoatTexture"),
		json_object_get(coat, "clearcoatRoughnessTexture"),
		json_object_get(specular, "specularTexture"),
		json_object_get(specular, "specularColorTexture")};
	struct gltf_texcoord_sets sets = {{0, 0}, 0};
	for (size_t i = 0; i < sizeof infos / sizeof *infos && sets.count < 2; i++) {
		uint64_t set = infos[i] ? texcoord_set(g, material, infos[i]) : 0;
		if (infos[i] && set < UINT_MAX && (sets.count == 0 || set != sets.sets[0]))
			sets.sets[sets.count++] = (unsigned)set;
	}
	return sets;
}

/* Returns the extension that names the image of a texture without another image, in a format that is not supported:
 * it is refused by this name, or left out. NULL if none is known. */
static const char *unsupported_format(const struct gltf_entry *texture)
{
	static const char *const formats[] = {"KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"};
	for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
		if (json_object_get(json_object_get(texture->json, "extensions"), formats[i]))
			return formats[i];
	return NULL;
}

void gltf_put_texture(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const char *name,
		      const json_t *info, const struct gltf_channel *c)
{
	struct gltf_entry texture, image;
	struct gltf_range range;
	if (gltf_resolve(g, material, info, "index", GLTF_TEXTURES, &texture) <= 0) {
		gltf_fail(g, material, EINVAL, "a texture without an index");
		return;
	}
	/* If the texture has two images, the other one is for readers without WebP. */
	const json_t *webp = gltf_extension(g, &texture, texture.json, "EXT_texture_webp");
	int found = gltf_resolve(g, &texture, webp ? webp : texture.json, "source", GLTF_IMAGES, &image);
	if (found == 0 && unsupported_format(&texture)) {
		gltf_add_plugin(g, el, &texture, "texture", unsupported_format(&texture), name);
		return;
	}
	/* The exporter lost the image, or it belongs to an unknown extension: refused, or left out with --lenient. */
	if (found <= 0) {
		gltf_add_plugin(g, el, &texture, "texture", "unknown_format", name);
		return;
	}
	if (gltf_locate_image(g, &image, &range))
		return;
	bool is_unscaled = c->factor[0] == 1 && (!c->is_colour || (c->factor[1] == 1 && c->factor[2] == 1));
	struct xml_element *outer = is_unscaled ? NULL : gltf_add_plugin(g, el, material, "texture", "scale", name);
	if (!is_unscaled && c->is_colour)
		gltf_put_rgb(g, outer, material, "scale", c->factor);
	else if (!is_unscaled)
		gltf_put_number(g, outer, material, "scale", c->factor[0]);
	struct xml_element *bitmap =
		gltf_add_plugin(g, is_unscaled ? el : outer, &texture, "texture", "bitmap", is_unscaled ? name : NULL);
	gltf_put_range(g, bitmap, &image, &range);
	if (!c->is_colour)
		gltf_put_bool(g, bitmap, &texture, "raw", true);
	if (c->name)
		gltf_put_string(g, bitmap, &texture, "channel", c->name);
	if (c->cutoff >= 0)
		gltf_put_number(g, bitmap, &texture, "threshold", c->cutoff);
	put_sampler(g, bitmap, &texture);
	put_transform(g, bitmap, material, info);
	const struct gltf_texcoord_sets sets = gltf_material_texcoord_sets(g, material);
	uint64_t set = texcoord_set(g, material, info);
	if (set == sets.sets[0])
		return;
	if (sets.count > 1 && set == sets.sets[1])
		gltf_put_string(g, bitmap, &texture, "coordinates", "vertex_texcoord");
	else
		gltf_put_string(g, bitmap, material, "texCoord", ELEMENT_UNSUPPORTED);
}

void gltf_put_colour(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const char *name,
		     const double rgb[3], const json_t *texture)
{
	const struct gltf_channel c = {.is_colour = true, .factor = {rgb[0], rgb[1], rgb[2]}, .cutoff = -1};
	if (texture)
		gltf_put_texture(g, el, material, name, texture, &c);
	else
		gltf_put_rgb(g, el, material, name, rgb);
}

void gltf_put_factor(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const char *name,
		     double x, const json_t *texture, const char *channel)
{
	const struct gltf_channel c = {.name = channel, .factor = {x}, .cutoff = -1};
	if (texture)
		gltf_put_texture(g, el, material, name, texture, &c);
	else
		gltf_put_number(g, el, material, name, x);
}
