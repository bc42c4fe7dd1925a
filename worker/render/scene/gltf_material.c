/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A metallic-roughness material as a `principled` BSDF, inside a `normalmap` and a `mask` if it has these, and an area
 * emitter if it emits. Transmission refracts, as in importers of modelling tools: thin walls are not distinguished from
 * solids. The clear coat's strength is four times the parameter of `principled`, which ends at a quarter of the
 * format's.
 *
 * What `principled` does not have (sheen, iridescence, attenuation, two sets of texture coordinates, ...) becomes a
 * property that its table does not know: refused with its name, or left out with --lenient.
 */
#include "worker/render/scene/gltf_material.h"
#include "worker/render/scene/gltf_buffer.h"
#include "worker/render/scene/gltf_tree.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { NEAREST = 9728, CLAMP = 33071, MIRROR = 33648, REPEAT = 10497 };

/* How an image is read: which numbers of a pixel, and whether they are colours. */
struct channel {
	const char *name; /* "r", "g", "b", "a"; NULL: all three */
	bool colour;
	double factor[3]; /* factor of colours; otherwise the first is used */
	double cutoff;	  /* factor of alpha; negative: none */
};

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

/* KHR_texture_transform: uv' = T R S uv, the rotation by -r as v points down. */
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

unsigned gltf_material_set(struct gltf *g, const struct gltf_at *at)
{
	const json_t *metal = json_object_get(at->json, "pbrMetallicRoughness");
	const json_t *infos[] = {
		json_object_get(metal, "baseColorTexture"), json_object_get(metal, "metallicRoughnessTexture"),
		json_object_get(at->json, "normalTexture"), json_object_get(at->json, "emissiveTexture")};
	uint64_t set = 0;
	bool any = false;
	for (size_t i = 0; i < sizeof infos / sizeof *infos; i++) {
		if (!infos[i])
			continue;
		uint64_t own = set_of(g, at, infos[i]);
		if (any && own != set)
			return 0;
		set = own;
		any = true;
	}
	return set < UINT_MAX ? (unsigned)set : 0;
}

/* The texture that `info` names as the property `name` of el. */
static void put_texture(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *name,
			const json_t *info, const struct channel *c)
{
	struct gltf_at texture, image;
	struct gltf_range range;
	if (gltf_follow(g, at, info, "index", GLTF_TEXTURES, &texture) <= 0) {
		gltf_fail(g, at, EINVAL, "a texture without an index");
		return;
	}
	if (gltf_follow(g, &texture, texture.json, "source", GLTF_IMAGES, &image) <= 0) {
		gltf_fail(g, &texture, ENOTSUP, "it has no source that is PNG or JPEG");
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
	if (set_of(g, at, info) != gltf_material_set(g, at))
		gltf_put_text(g, bitmap, at, "texCoord", ELEMENT_UNSUPPORTED);
}

static void put_colour(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *name,
		       const double rgb[3], const json_t *texture)
{
	const struct channel c = {.colour = true, .factor = {rgb[0], rgb[1], rgb[2]}, .cutoff = -1};
	if (texture)
		put_texture(g, el, at, name, texture, &c);
	else
		gltf_put_rgb(g, el, at, name, rgb);
}

static void put_attribute(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *name,
			  const char *attribute)
{
	gltf_put_text(g, gltf_plugin(g, el, at, "texture", "mesh_attribute", name), at, "name", attribute);
}

/* An element whose unnamed child will be, as `name` of el, multiplied by an attribute of the mesh. */
static struct xml_element *put_product(struct gltf *g, struct xml_element *el, const struct gltf_at *at,
				       const char *name, const char *attribute)
{
	struct xml_element *scale = gltf_plugin(g, el, at, "texture", "scale", name);
	put_attribute(g, scale, at, "scale", attribute);
	return scale;
}

static void put_base_colour(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const double rgb[3],
			    const json_t *texture, enum gltf_colours colours)
{
	const struct channel c = {.colour = true, .factor = {rgb[0], rgb[1], rgb[2]}, .cutoff = -1};
	if (!colours) {
		put_colour(g, el, at, "base_color", rgb, texture);
	} else if (texture) {
		put_texture(g, put_product(g, el, at, "base_color", "vertex_color"), at, NULL, texture, &c);
	} else {
		struct xml_element *scale = gltf_plugin(g, el, at, "texture", "scale", "base_color");
		gltf_put_rgb(g, scale, at, "scale", rgb);
		put_attribute(g, scale, at, NULL, "vertex_color");
	}
}

static void put_share(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *name, double x,
		      const json_t *texture, const char *channel)
{
	const struct channel c = {.name = channel, .factor = {x}, .cutoff = -1};
	if (texture)
		put_texture(g, el, at, name, texture, &c);
	else
		gltf_put_number(g, el, at, name, x);
}

/* ---- extensions */

/* Members of an extension without counterpart, as properties that no table has. */
static void put_unsupported(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const json_t *extension,
			    const char *const *members)
{
	for (; *members; members++)
		if (json_object_get(extension, *members))
			gltf_put_text(g, el, at, *members, ELEMENT_UNSUPPORTED);
}

static void put_index(struct gltf *g, struct xml_element *el, const struct gltf_at *at)
{
	static const char *const others[] = {"specularTexture", "specularColorTexture", NULL};
	const json_t *ior = gltf_extension(g, at, at->json, "KHR_materials_ior"),
		     *specular = gltf_extension(g, at, at->json, "KHR_materials_specular");
	double eta = ior ? gltf_number(g, at, ior, "ior", 1.5) : 1.5,
	       factor = specular ? gltf_number(g, at, specular, "specularFactor", 1) : 1;
	/* The reflectance at normal incidence, scaled; an index of 0 means total reflection in the format. */
	double root = eta > 0 ? (eta - 1) / (eta + 1) : 1, scaled = fabs(root) * sqrt(fmin(fmax(factor, 0), 1));
	gltf_put_number(g, el, at, "eta", fmin((1 + scaled) / fmax(1 - scaled, 0.1), 10));
	double tint[3] = {1, 1, 1};
	if (specular)
		gltf_numbers(g, at, specular, "specularColorFactor", tint, 3);
	if (tint[0] != 1 || tint[1] != 1 || tint[2] != 1)
		gltf_put_text(g, el, at, "specularColorFactor", ELEMENT_UNSUPPORTED);
	put_unsupported(g, el, at, specular, others);
}

static void put_coat(struct gltf *g, struct xml_element *el, const struct gltf_at *at)
{
	static const char *const others[] = {"clearcoatTexture", "clearcoatRoughnessTexture", "clearcoatNormalTexture",
					     NULL};
	const json_t *coat = gltf_extension(g, at, at->json, "KHR_materials_clearcoat");
	double factor = coat ? gltf_number(g, at, coat, "clearcoatFactor", 0) : 0;
	if (!(factor > 0))
		return;
	double roughness = gltf_number(g, at, coat, "clearcoatRoughnessFactor", 0);
	gltf_note(g, "clear coats reflect a quarter of what the format says, the maximum of `principled`");
	gltf_put_number(g, el, at, "clearcoat", factor);
	gltf_put_number(g, el, at, "clearcoat_gloss", fmin(fmax((0.1 - roughness * roughness) / 0.099, 0), 1));
	put_unsupported(g, el, at, coat, others);
}

static void put_transmission(struct gltf *g, struct xml_element *el, const struct gltf_at *at)
{
	const json_t *t = gltf_extension(g, at, at->json, "KHR_materials_transmission"),
		     *volume = gltf_extension(g, at, at->json, "KHR_materials_volume"),
		     *dispersion = gltf_extension(g, at, at->json, "KHR_materials_dispersion");
	double factor = t ? gltf_number(g, at, t, "transmissionFactor", 0) : 0;
	if (factor > 0) {
		gltf_put_number(g, el, at, "spec_trans", factor);
		put_unsupported(g, el, at, t, (const char *const[]){"transmissionTexture", NULL});
		put_unsupported(g, el, at, volume, (const char *const[]){"attenuationDistance", NULL});
		if (dispersion && gltf_number(g, at, dispersion, "dispersion", 0) > 0)
			put_unsupported(g, el, at, dispersion, (const char *const[]){"dispersion", NULL});
	}
}

/* Unknown extensions that would change the image. */
static void put_foreign(struct gltf *g, struct xml_element *el, const struct gltf_at *at)
{
	static const char *const known[] = {"KHR_materials_clearcoat",
					    "KHR_materials_dispersion",
					    "KHR_materials_emissive_strength",
					    "KHR_materials_ior",
					    "KHR_materials_specular",
					    "KHR_materials_transmission",
					    "KHR_materials_volume",
					    NULL};
	const json_t *all = json_object_get(at->json, "extensions");
	for (void *i = json_object_iter((json_t *)(uintptr_t)all); i;
	     i = json_object_iter_next((json_t *)(uintptr_t)all, i)) {
		const char *name = json_object_iter_key(i);
		size_t k = 0;
		while (known[k] && strcmp(known[k], name) != 0)
			k++;
		if (!known[k])
			gltf_put_text(g, el, at, name, ELEMENT_UNSUPPORTED);
	}
}

/* ---- the material */

/* Wraps the BSDF in what transmits a part of the light. */
static struct xml_element *put_mask(struct gltf *g, struct xml_element *parent, const struct gltf_at *at,
				    const json_t *metal, double alpha, bool vertex_alpha)
{
	const char *mode = gltf_text(g, at, at->json, "alphaMode", "OPAQUE");
	const json_t *texture = metal ? gltf_object(g, at, metal, "baseColorTexture") : NULL;
	bool cut = strcmp(mode, "MASK") == 0;
	if (strcmp(mode, "OPAQUE") == 0 || (!texture && !cut && alpha == 1 && !vertex_alpha))
		return parent;
	double cutoff = gltf_number(g, at, at->json, "alphaCutoff", 0.5);
	if (!texture && cut && alpha >= cutoff && !vertex_alpha)
		return parent;
	struct xml_element *mask = gltf_plugin(g, parent, at, "bsdf", "mask", NULL);
	if (cut && vertex_alpha) /* no threshold of a product: not supported */
		gltf_put_text(g, mask, at, "alpha_of_COLOR_0_with_MASK", ELEMENT_UNSUPPORTED);
	/* alpha times the texture's is cut off at `cutoff` */
	const struct channel c = {.name = "a",
				  .factor = {cut ? 1 : alpha},
				  .cutoff = !cut	? -1
					    : alpha > 0 ? fmin(cutoff / alpha, 2)
							: 2};
	if (texture && vertex_alpha) {
		put_texture(g, put_product(g, mask, at, "opacity", "vertex_alpha"), at, NULL, texture, &c);
	} else if (texture) {
		put_texture(g, mask, at, "opacity", texture, &c);
	} else if (vertex_alpha) {
		struct xml_element *scale = gltf_plugin(g, mask, at, "texture", "scale", "opacity");
		gltf_put_number(g, scale, at, "scale", alpha);
		put_attribute(g, scale, at, NULL, "vertex_alpha");
	} else {
		gltf_put_number(g, mask, at, "opacity", cut ? 0 : alpha);
	}
	return mask;
}

static struct xml_element *put_normal_map(struct gltf *g, struct xml_element *parent, const struct gltf_at *at)
{
	const json_t *info = gltf_object(g, at, at->json, "normalTexture");
	if (!info)
		return parent;
	struct xml_element *map = gltf_plugin(g, parent, at, "bsdf", "normalmap", NULL);
	const struct channel c = {.factor = {1}, .cutoff = -1};
	put_texture(g, map, at, NULL, info, &c);
	gltf_put_bool(g, map, at, "handedness", true);
	double scale = gltf_number(g, at, info, "scale", 1);
	if (scale != 1)
		gltf_put_number(g, map, at, "scale", scale);
	return map;
}

/* <bsdf id="..."> and <emitter id="..."> at the top level, for shapes to refer to. */
static void put_id(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *what,
		   enum gltf_colours colours)
{
	static const char *const with[] = {"", " with COLOR_0", " with COLOR_0 and alpha"};
	gltf_attribute(g, el, "id", "%s of materials[%zu]%s", what, at->index, with[colours]);
}

static void put_ref(struct gltf *g, struct xml_element *shape, const struct gltf_at *at, const char *what,
		    enum gltf_colours colours)
{
	put_id(g, gltf_element(g, shape, at, "ref"), at, what, colours);
}

static bool shines(struct gltf *g, const struct gltf_at *at, double rgb[3])
{
	const json_t *more = gltf_extension(g, at, at->json, "KHR_materials_emissive_strength");
	double strength = more ? gltf_number(g, at, more, "emissiveStrength", 1) : 1;
	rgb[0] = rgb[1] = rgb[2] = 0;
	gltf_numbers(g, at, at->json, "emissiveFactor", rgb, 3);
	for (int k = 0; k < 3; k++)
		rgb[k] *= strength;
	return rgb[0] > 0 || rgb[1] > 0 || rgb[2] > 0;
}

/* Clear glass with a varying index: a dielectric, with Cauchy's law for the Abbe number 20 / dispersion. false:
 * another material. */
static bool put_dispersive(struct gltf *g, const struct gltf_at *at, const double base[4], double metallic,
			   double roughness)
{
	static const double f_line = 0.48613, c_line = 0.65627; /* micrometres */
	const json_t *t = gltf_extension(g, at, at->json, "KHR_materials_transmission"),
		     *dispersion = gltf_extension(g, at, at->json, "KHR_materials_dispersion"),
		     *ior = gltf_extension(g, at, at->json, "KHR_materials_ior"),
		     *metal = json_object_get(at->json, "pbrMetallicRoughness");
	double strength = dispersion ? gltf_number(g, at, dispersion, "dispersion", 0) : 0;
	bool clear = base[0] == 1 && base[1] == 1 && base[2] == 1 && metallic == 0 &&
		     !json_object_get(metal, "baseColorTexture") && !json_object_get(metal, "metallicRoughnessTexture");
	if (!(strength > 0) || !clear || !t || gltf_number(g, at, t, "transmissionFactor", 0) != 1 ||
	    gltf_extension(g, at, at->json, "KHR_materials_clearcoat") ||
	    gltf_extension(g, at, at->json, "KHR_materials_specular"))
		return false;
	double n = ior ? gltf_number(g, at, ior, "ior", 1.5) : 1.5;
	double spread = 1 / (f_line * f_line) - 1 / (c_line * c_line);
	struct xml_element *parent = put_normal_map(g, g->scene, at),
			   *bsdf = gltf_plugin(g, parent, at, "bsdf", roughness > 0 ? "roughdielectric" : "dielectric",
					       NULL);
	gltf_put_number(g, bsdf, at, "int_ior", n);
	gltf_put_number(g, bsdf, at, "ext_ior", 1);
	gltf_put_number(g, bsdf, at, "int_cauchy_b", (n - 1) * strength / 20 / spread);
	if (roughness > 0) {
		gltf_put_text(g, bsdf, at, "distribution", "ggx");
		gltf_put_number(g, bsdf, at, "alpha", roughness * roughness);
	}
	put_unsupported(g, bsdf, at, t, (const char *const[]){"transmissionTexture", NULL});
	put_unsupported(g, bsdf, at, gltf_extension(g, at, at->json, "KHR_materials_volume"),
			(const char *const[]){"attenuationDistance", NULL});
	put_foreign(g, bsdf, at);
	if (!g->failed)
		put_id(g, parent == g->scene ? bsdf : parent, at, "bsdf", GLTF_NO_COLOURS);
	return true;
}

static void put_principled(struct gltf *g, const struct gltf_at *at, enum gltf_colours colours)
{
	const json_t *metal = gltf_object(g, at, at->json, "pbrMetallicRoughness");
	double base[4] = {1, 1, 1, 1}, metallic = 1, roughness = 1;
	if (metal) {
		gltf_numbers(g, at, metal, "baseColorFactor", base, 4);
		metallic = gltf_number(g, at, metal, "metallicFactor", 1);
		roughness = gltf_number(g, at, metal, "roughnessFactor", 1);
	}
	if (!colours && put_dispersive(g, at, base, metallic, roughness))
		return;
	struct xml_element *parent = put_normal_map(
				   g, put_mask(g, g->scene, at, metal, base[3], colours == GLTF_COLOURS_AND_ALPHA), at),
			   *bsdf = gltf_plugin(g, parent, at, "bsdf", "principled", NULL);
	const json_t *colour = metal ? gltf_object(g, at, metal, "baseColorTexture") : NULL,
		     *both = metal ? gltf_object(g, at, metal, "metallicRoughnessTexture") : NULL;
	put_base_colour(g, bsdf, at, base, colour, colours);
	put_share(g, bsdf, at, "metallic", metallic, metallic > 0 ? both : NULL, "b");
	put_share(g, bsdf, at, "roughness", roughness, roughness > 0 ? both : NULL, "g");
	put_index(g, bsdf, at);
	put_coat(g, bsdf, at);
	put_transmission(g, bsdf, at);
	put_foreign(g, bsdf, at);
	if (g->failed)
		return;
	while (bsdf->parent != g->scene)
		bsdf = bsdf->parent;
	put_id(g, bsdf, at, "bsdf", colours);
}

static void put_emitter(struct gltf *g, const struct gltf_at *at)
{
	double rgb[3];
	if (!shines(g, at, rgb))
		return;
	struct xml_element *emitter = gltf_plugin(g, g->scene, at, "emitter", "area", NULL);
	put_colour(g, emitter, at, "radiance", rgb, gltf_object(g, at, at->json, "emissiveTexture"));
	put_id(g, emitter, at, "emitter", GLTF_NO_COLOURS);
	/* Emission of at most 1 is that of a screen, which does not light a room: viewers show such files in
	 * surroundings that do. */
	g->has_light |= rgb[0] > 1 || rgb[1] > 1 || rgb[2] > 1;
}

void gltf_material(struct gltf *g, struct xml_element *shape, const struct gltf_at *at, enum gltf_colours colours)
{
	double rgb[3];
	if (!(g->material_made[at->index] >> colours & 1))
		put_principled(g, at, colours);
	if (!g->material_made[at->index])
		put_emitter(g, at);
	g->material_made[at->index] |= (unsigned char)(1u << colours);
	put_ref(g, shape, at, "bsdf", colours);
	if (shines(g, at, rgb))
		put_ref(g, shape, at, "emitter", GLTF_NO_COLOURS);
}

void gltf_default_material(struct gltf *g, struct xml_element *shape, enum gltf_colours colours)
{
	json_t *empty = json_object();
	size_t count = json_array_size(json_object_get(g->root, "materials"));
	if (empty)
		gltf_material(g, shape, &(struct gltf_at){GLTF_MATERIALS, count, empty}, colours);
	else
		gltf_fail(g, NULL, ENOMEM, "out of memory");
	json_decref(empty);
}
