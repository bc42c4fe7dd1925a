/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes a metallic-roughness material into a `principled` BSDF, inside a `normalmap` and a `mask` if it has these, and
 * an area emitter if it emits. Clear dispersive glass becomes a dielectric. Extensions are in gltf_layers.c.
 *
 * A wrong value sets g->failed, with its place, and nothing is added after it. Features that the plug-ins lack are left
 * out with a note.
 */
#include "worker/render/gltf/gltf_material.h"
#include "worker/render/gltf/gltf_layers.h"
#include "worker/render/gltf/gltf_texture.h"

#include <stdio.h>
#include <string.h>

#define DARKEST 1e-6 /* black would have an infinite coefficient */

/* ---- the surface below the layers */

struct gltf_surface {
	double base[4]; /* base colour and alpha */
	double metallic, roughness;
	const json_t *colour; /* texture that multiplies the base; NULL: none */
	const json_t *both;   /* texture that multiplies roughness (green) and metallic (blue); NULL: none */
};

static const double dielectric = 0.04;

/* Returns a perceived brightness: weighted as by the eye, with squares and a root as a rough gamma. */
static double brightness(const double c[3])
{
	return sqrt(0.299 * c[0] * c[0] + 0.587 * c[1] * c[1] + 0.114 * c[2] * c[2]);
}

static double metal_share(const double diffuse[3], const double specular[3], double rest)
{
	double r = dielectric, s = brightness(specular);
	if (s <= r)
		return 0;
	double p = brightness(diffuse) * rest / (1 - r) + s - 2 * r, q = r - s;
	return fmin(fmax((sqrt(p * p - 4 * r * q) - p) / (2 * r), 0), 1);
}

static void from_glossiness(struct gltf *g, const struct gltf_at *at, const json_t *o, struct gltf_surface *s)
{
	double specular[3] = {1, 1, 1};
	gltf_numbers(g, at, o, "diffuseFactor", s->base, 4);
	gltf_numbers(g, at, o, "specularFactor", specular, 3);
	s->colour = gltf_object(g, at, o, "diffuseTexture");
	s->roughness = 1 - fmin(fmax(gltf_number(g, at, o, "glossinessFactor", 1), 0), 1);
	s->metallic = 0;
	if (gltf_object(g, at, o, "specularGlossinessTexture")) {
		gltf_note(
			g,
			"textures of KHR_materials_pbrSpecularGlossiness are left out, except that of the diffuse colour; "
			"such materials are not metallic");
		return;
	}
	double rest = 1 - fmin(fmax(specular[0], fmax(specular[1], specular[2])), 1);
	double m = s->metallic = metal_share(s->base, specular, rest);
	for (int i = 0; i < 3; i++) {
		double of_diffuse = s->base[i] * rest / (1 - dielectric) / fmax(1 - m, 1e-6),
		       of_specular = (specular[i] - dielectric * (1 - m)) / fmax(m, 1e-6);
		double b = of_diffuse + m * m * (of_specular - of_diffuse); /* m weights the better determined value */
		s->base[i] = fmin(fmax(b, 0), 1);
	}
}

/*
 * Returns the surface of a metallic-roughness material or, if it has none, of KHR_materials_pbrSpecularGlossiness. The
 * latter has a diffuse colour d and a reflectance s at normal incidence, for which a base colour b and a metallic
 * fraction m are found. A dielectric reflects r = 0.04 of each colour, so that
 *
 *   s = r (1 - m) + b m,   d = b (1 - m) (1 - r) / (1 - max s)
 *
 * for the brightness of both; eliminating b leaves r m^2 + p m + r - s = 0 with p = d (1 - max s) / (1 - r) + s - 2 r.
 * If s has a texture, the material is taken for a dielectric, with a note.
 */
static struct gltf_surface surface_of(struct gltf *g, const struct gltf_at *at)
{
	struct gltf_surface s = {.base = {1, 1, 1, 1}, .metallic = 1, .roughness = 1};
	const json_t *metal = gltf_object(g, at, at->json, "pbrMetallicRoughness"),
		     *gloss = gltf_extension(g, at, at->json, "KHR_materials_pbrSpecularGlossiness");
	if (metal) {
		gltf_numbers(g, at, metal, "baseColorFactor", s.base, 4);
		s.metallic = gltf_number(g, at, metal, "metallicFactor", 1);
		s.roughness = gltf_number(g, at, metal, "roughnessFactor", 1);
		s.colour = gltf_object(g, at, metal, "baseColorTexture");
		s.both = gltf_object(g, at, metal, "metallicRoughnessTexture");
	} else if (gloss) {
		from_glossiness(g, at, gloss, &s);
	}
	return s;
}

/* ---- its textures */

static void put_attribute(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *name,
			  const char *attribute)
{
	gltf_put_text(g, gltf_plugin(g, el, at, "texture", "mesh_attribute", name), at, "name", attribute);
}

/* Adds a texture as `name` of el and returns it: its unnamed child, still to be added, will be multiplied by an
 * attribute of the mesh. */
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
	const struct gltf_channel c = {.colour = true, .factor = {rgb[0], rgb[1], rgb[2]}, .cutoff = -1};
	if (!colours) {
		gltf_put_colour(g, el, at, "base_color", rgb, texture);
	} else if (texture) {
		gltf_put_texture(g, put_product(g, el, at, "base_color", "vertex_color"), at, NULL, texture, &c);
	} else {
		struct xml_element *scale = gltf_plugin(g, el, at, "texture", "scale", "base_color");
		gltf_put_rgb(g, scale, at, "scale", rgb);
		put_attribute(g, scale, at, NULL, "vertex_color");
	}
}

/* ---- the material */

/* A mode that the format does not have is refused; a lenient reader leaves it out, and the material is opaque. */
static struct xml_element *put_unknown_mode(struct gltf *g, struct xml_element *parent, const struct gltf_at *at,
					    const char *mode)
{
	char name[64];
	struct xml_element *mask = gltf_plugin(g, parent, at, "bsdf", "mask", NULL);
	snprintf(name, sizeof name, "alphaMode \"%.32s\"", mode);
	gltf_put_text(g, mask, at, name, ELEMENT_UNSUPPORTED);
	gltf_put_number(g, mask, at, "opacity", 1);
	return mask;
}

/* Wraps the BSDF in a mask, which lets a part of the light through unchanged, if the material has one. */
static struct xml_element *put_mask(struct gltf *g, struct xml_element *parent, const struct gltf_at *at,
				    const json_t *texture, double alpha, bool vertex_alpha)
{
	const char *mode = gltf_text(g, at, at->json, "alphaMode", "OPAQUE");
	bool cut = strcmp(mode, "MASK") == 0;
	if (!cut && strcmp(mode, "OPAQUE") != 0 && strcmp(mode, "BLEND") != 0)
		return put_unknown_mode(g, parent, at, mode);
	if (strcmp(mode, "OPAQUE") == 0 || (!texture && !cut && alpha == 1 && !vertex_alpha))
		return parent;
	double cutoff = gltf_number(g, at, at->json, "alphaCutoff", 0.5);
	if (!texture && cut && alpha >= cutoff && !vertex_alpha)
		return parent;
	struct xml_element *mask = gltf_plugin(g, parent, at, "bsdf", "mask", NULL);
	if (cut && vertex_alpha) /* the threshold would apply to a product: not supported */
		gltf_put_text(g, mask, at, "alpha_of_COLOR_0_with_MASK", ELEMENT_UNSUPPORTED);
	/* The product of alpha and the texture's is cut off at `cutoff`. */
	const struct gltf_channel c = {.name = "a",
				       .factor = {cut ? 1 : alpha},
				       .cutoff = !cut	     ? -1
						 : alpha > 0 ? fmin(cutoff / alpha, 2)
							     : 2};
	if (texture && vertex_alpha) {
		gltf_put_texture(g, put_product(g, mask, at, "opacity", "vertex_alpha"), at, NULL, texture, &c);
	} else if (texture) {
		gltf_put_texture(g, mask, at, "opacity", texture, &c);
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
	const struct gltf_channel c = {.factor = {1}, .cutoff = -1};
	/* Features of Mitsuba's normal maps that the format does not have. */
	gltf_put_bool(g, map, at, "flip_invalid_normals", false);
	gltf_put_bool(g, map, at, "use_shadowing_function", false);
	gltf_put_bool(g, map, at, "handedness", true);
	gltf_put_texture(g, map, at, NULL, info, &c);
	double scale = gltf_number(g, at, info, "scale", 1);
	if (scale != 1)
		gltf_put_number(g, map, at, "scale", scale);
	return map;
}

/* Gives an id to the <bsdf>, <emitter> or <medium> at the top level, by which shapes refer to it. */
static void put_id(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const char *what,
		   enum gltf_colours colours)
{
	static const char *const with[] = {"", " with COLOR_0", " with COLOR_0 and alpha"};
	gltf_attribute(g, el, "id", "%s of materials[%zu]%s", what, at->index, with[colours]);
}

static struct xml_element *put_ref(struct gltf *g, struct xml_element *shape, const struct gltf_at *at,
				   const char *what, enum gltf_colours colours)
{
	struct xml_element *ref = gltf_element(g, shape, at, "ref");
	put_id(g, ref, at, what, colours);
	return ref;
}

bool gltf_material_shines(struct gltf *g, const struct gltf_at *at, double rgb[3])
{
	const json_t *more = gltf_extension(g, at, at->json, "KHR_materials_emissive_strength");
	double strength = more ? gltf_number(g, at, more, "emissiveStrength", 1) : 1;
	rgb[0] = rgb[1] = rgb[2] = 0;
	gltf_numbers(g, at, at->json, "emissiveFactor", rgb, 3);
	for (int k = 0; k < 3; k++)
		rgb[k] *= strength;
	return rgb[0] > 0 || rgb[1] > 0 || rgb[2] > 0;
}

/* Makes clear glass with a varying index: a dielectric with Cauchy's law for the Abbe number 20 / dispersion. As in
 * `principled`, each boundary colours light by the square root of the base colour. Returns false if it is another
 * material. */
static bool put_dispersive(struct gltf *g, const struct gltf_at *at, const struct gltf_surface *s)
{
	static const double f_line = 0.48613, c_line = 0.65627; /* micrometres */
	const json_t *t = gltf_extension(g, at, at->json, "KHR_materials_transmission"),
		     *dispersion = gltf_extension(g, at, at->json, "KHR_materials_dispersion"),
		     *ior = gltf_extension(g, at, at->json, "KHR_materials_ior");
	double strength = dispersion ? gltf_number(g, at, dispersion, "dispersion", 0) : 0;
	bool clear = s->metallic == 0 && !s->colour && !s->both, white = true;
	double root[3];
	for (int k = 0; k < 3; k++) {
		root[k] = s->base[k] > 0 ? sqrt(s->base[k]) : s->base[k]; /* negative values are refused later */
		white &= s->base[k] == 1;
	}
	if (!(strength > 0) || !clear || !t || gltf_number(g, at, t, "transmissionFactor", 0) != 1 ||
	    json_object_get(t, "transmissionTexture") || gltf_extension(g, at, at->json, "KHR_materials_clearcoat") ||
	    gltf_extension(g, at, at->json, "KHR_materials_specular"))
		return false;
	double n = ior ? gltf_number(g, at, ior, "ior", 1.5) : 1.5;
	double spread = 1 / (f_line * f_line) - 1 / (c_line * c_line);
	struct xml_element *parent = put_normal_map(g, g->scene, at),
			   *bsdf = gltf_plugin(g, parent, at, "bsdf",
					       s->roughness > 0 ? "roughdielectric" : "dielectric", NULL);
	gltf_put_number(g, bsdf, at, "int_ior", n);
	gltf_put_number(g, bsdf, at, "ext_ior", 1);
	gltf_put_number(g, bsdf, at, "int_cauchy_b", (n - 1) * strength / 20 / spread);
	if (!white)
		gltf_put_colour(g, bsdf, at, "specular_transmittance", root, NULL);
	if (s->roughness > 0) {
		gltf_put_text(g, bsdf, at, "distribution", "ggx");
		gltf_put_number(g, bsdf, at, "alpha", s->roughness * s->roughness);
	}
	gltf_note_foreign(g, at);
	if (!g->failed)
		put_id(g, parent == g->scene ? bsdf : parent, at, "bsdf", GLTF_NO_COLOURS);
	return true;
}

/* Adds a blend for diffuse transmission, which takes a fraction of the light that metal does not reflect.
 * put_through adds it as a second BSDF beside the material's own, so the boundary reflects less than in the format, by
 * that fraction. */
static struct xml_element *put_sheet(struct gltf *g, struct xml_element *parent, const struct gltf_at *at,
				     const json_t *through, double metallic)
{
	const json_t *t = gltf_extension(g, at, at->json, "KHR_materials_transmission");
	double factor = through ? gltf_number(g, at, through, "diffuseTransmissionFactor", 0) * (1 - metallic) : 0;
	if (!(factor > 0))
		return parent;
	if (t && gltf_number(g, at, t, "transmissionFactor", 0) > 0) {
		gltf_note(
			g,
			"KHR_materials_diffuse_transmission is left out if the material also transmits light otherwise");
		return parent;
	}
	struct xml_element *blend = gltf_plugin(g, parent, at, "bsdf", "blendbsdf", NULL);
	gltf_put_share(g, blend, at, "weight", factor, gltf_object(g, at, through, "diffuseTransmissionTexture"), "a");
	return blend;
}

static void put_through(struct gltf *g, struct xml_element *blend, const struct gltf_at *at, const json_t *through)
{
	double rgb[3] = {1, 1, 1};
	struct xml_element *sheet = gltf_plugin(g, blend, at, "bsdf", "difftrans", NULL);
	gltf_numbers(g, at, through, "diffuseTransmissionColorFactor", rgb, 3);
	gltf_put_colour(g, sheet, at, "transmittance", rgb,
			gltf_object(g, at, through, "diffuseTransmissionColorTexture"));
}

static void put_principled(struct gltf *g, const struct gltf_at *at, enum gltf_colours colours)
{
	const struct gltf_surface s = surface_of(g, at);
	if (!colours && put_dispersive(g, at, &s))
		return;
	const json_t *through = gltf_extension(g, at, at->json, "KHR_materials_diffuse_transmission");
	struct xml_element *mask = put_mask(g, g->scene, at, s.colour, s.base[3], colours == GLTF_COLOURS_AND_ALPHA),
			   *map = put_normal_map(g, mask, at),
			   *sheet = put_sheet(g, map, at, through, s.both ? 0 : s.metallic),
			   *bsdf = gltf_plugin(g, sheet, at, "bsdf", "principled", NULL);
	put_base_colour(g, bsdf, at, s.base, s.colour, colours);
	gltf_put_share(g, bsdf, at, "metallic", s.metallic, s.metallic > 0 ? s.both : NULL, "b");
	gltf_put_layers(g, bsdf, at, s.roughness, s.both);
	if (!g->is_burleys)
		gltf_put_bool(g, bsdf, at, "lambertian", true);
	if (sheet != map)
		put_through(g, sheet, at, through);
	if (g->failed)
		return;
	while (bsdf->parent != g->scene)
		bsdf = bsdf->parent;
	put_id(g, bsdf, at, "bsdf", colours);
}

static void put_emitter(struct gltf *g, const struct gltf_at *at)
{
	double rgb[3];
	if (!gltf_material_shines(g, at, rgb))
		return;
	struct xml_element *emitter = gltf_plugin(g, g->scene, at, "emitter", "area", NULL);
	gltf_put_colour(g, emitter, at, "radiance", rgb, gltf_object(g, at, at->json, "emissiveTexture"));
	if (json_is_true(json_object_get(at->json, "doubleSided")))
		gltf_put_bool(g, emitter, at, "two_sided", true);
	put_id(g, emitter, at, "emitter", GLTF_NO_COLOURS);
	/* Emission of at most 1 is like a screen's and does not light a room: then an environment is added, as by
	 * viewers. */
	g->has_light |= rgb[0] > 1 || rgb[1] > 1 || rgb[2] > 1;
}

/* Computes the coefficients of Beer's law with which white light has the given colour after `distance`. Returns
 * whether any is above 0. Without thickness a volume is a thin sheet, which absorbs nothing. */
static bool absorbs(struct gltf *g, const struct gltf_at *at, double sigma_a[3])
{
	const json_t *volume = gltf_extension(g, at, at->json, "KHR_materials_volume"),
		     *t = gltf_extension(g, at, at->json, "KHR_materials_transmission");
	double distance = volume ? gltf_number(g, at, volume, "attenuationDistance", 0) : 0, left[3] = {1, 1, 1};
	if (!(distance > 0) || !t || !(gltf_number(g, at, t, "transmissionFactor", 0) > 0) ||
	    !(gltf_number(g, at, volume, "thicknessFactor", 0) > 0))
		return false;
	gltf_numbers(g, at, volume, "attenuationColor", left, 3);
	for (int k = 0; k < 3; k++)
		sigma_a[k] = -log(fmin(fmax(left[k], DARKEST), 1)) / distance;
	return sigma_a[0] > 0 || sigma_a[1] > 0 || sigma_a[2] > 0;
}

static void put_medium(struct gltf *g, const struct gltf_at *at)
{
	double sigma_a[3];
	if (!absorbs(g, at, sigma_a))
		return;
	struct xml_element *medium = gltf_plugin(g, g->scene, at, "medium", "homogeneous", NULL);
	gltf_put_rgb(g, medium, at, "sigma_t", sigma_a);
	gltf_put_number(g, medium, at, "albedo", 0);
	put_id(g, medium, at, "medium", GLTF_NO_COLOURS);
}

void gltf_material(struct gltf *g, struct xml_element *shape, const struct gltf_at *at, enum gltf_colours colours)
{
	double rgb[3];
	if (!(g->material_made[at->index] >> colours & 1))
		put_principled(g, at, colours);
	if (!g->material_made[at->index]) {
		put_emitter(g, at);
		put_medium(g, at);
	}
	g->material_made[at->index] |= (unsigned char)(1u << colours);
	put_ref(g, shape, at, "bsdf", colours);
	if (gltf_material_shines(g, at, rgb))
		put_ref(g, shape, at, "emitter", GLTF_NO_COLOURS);
	if (absorbs(g, at, rgb))
		gltf_attribute(g, put_ref(g, shape, at, "medium", GLTF_NO_COLOURS), "name", "interior");
}

/* For shapes without a material: the format's default is a rough white metal, but Blender shows such objects in
 * grey, so they are grey in its files. */
void gltf_default_material(struct gltf *g, struct xml_element *shape, enum gltf_colours colours)
{
	static const char grey[] =
		"{\"pbrMetallicRoughness\": {\"baseColorFactor\": [0.8, 0.8, 0.8, 1], \"metallicFactor\": 0,"
		"\"roughnessFactor\": 0.5},"
		"\"extensions\": {\"KHR_materials_specular\": {\"specularFactor\": 0}}}";
	json_t *material = json_loads(g->is_blenders ? grey : "{}", 0, NULL);
	size_t count = json_array_size(json_object_get(g->root, "materials"));
	if (material)
		gltf_material(g, shape, &(struct gltf_at){GLTF_MATERIALS, count, material}, colours);
	else
		gltf_fail(g, NULL, ENOMEM, "out of memory");
	json_decref(material);
}
