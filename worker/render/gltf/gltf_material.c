/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes a metallic-roughness material into a `principled` BSDF, inside a `normalmap` and a `mask` if it has these, and
 * an area emitter if it emits. Clear dispersive glass becomes a dielectric. Extensions are in gltf_layers.c.
 *
 * A wrong value sets g->error_code, with its place, and nothing is added after it. Features that the plug-ins lack are
 * left out with a note.
 */
#include "worker/render/gltf/gltf_material.h"
#include "worker/render/gltf/gltf_layers.h"
#include "worker/render/gltf/gltf_texture.h"

#include <stdio.h>
#include <string.h>

#define ATTENUATION_COLOUR_MIN 1e-6 /* black would have an infinite coefficient */

/* ---- the surface below the layers */

struct gltf_surface {
	double base_colour[4]; /* with alpha */
	double metallic, roughness;
	const json_t *base_texture;		  /* multiplies the base colour; NULL: none */
	const json_t *roughness_metallic_texture; /* multiplies roughness (green) and metallic (blue); NULL: none */
};

static const double dielectric_reflectance = 0.04;

/* Returns a perceived brightness: weighted as by the eye, with squares and a root as a rough gamma. */
static double brightness(const double c[3])
{
	return sqrt(0.299 * c[0] * c[0] + 0.587 * c[1] * c[1] + 0.114 * c[2] * c[2]);
}

static double metallic_fraction(const double diffuse[3], const double specular[3], double rest)
{
	double r = dielectric_reflectance, s = brightness(specular);
	if (s <= r)
		return 0;
	double p = brightness(diffuse) * rest / (1 - r) + s - 2 * r, q = r - s;
	return fmin(fmax((sqrt(p * p - 4 * r * q) - p) / (2 * r), 0), 1);
}

static void surface_from_glossiness(struct gltf *g, const struct gltf_entry *material, const json_t *o,
				    struct gltf_surface *s)
{
	double specular[3] = {1, 1, 1};
	gltf_numbers(g, material, o, "diffuseFactor", s->base_colour, 4);
	gltf_numbers(g, material, o, "specularFactor", specular, 3);
	s->base_texture = gltf_object(g, material, o, "diffuseTexture");
	s->roughness = 1 - fmin(fmax(gltf_number(g, material, o, "glossinessFactor", 1), 0), 1);
	s->metallic = 0;
	if (gltf_object(g, material, o, "specularGlossinessTexture")) {
		gltf_note(
			g,
			"textures of KHR_materials_pbrSpecularGlossiness are left out, except that of the diffuse colour; "
			"such materials are not metallic");
		return;
	}
	double rest = 1 - fmin(fmax(specular[0], fmax(specular[1], specular[2])), 1);
	double m = s->metallic = metallic_fraction(s->base_colour, specular, rest);
	for (int i = 0; i < 3; i++) {
		double base_from_diffuse = s->base_colour[i] * rest / (1 - dielectric_reflectance) / fmax(1 - m, 1e-6),
		       base_from_specular = (specular[i] - dielectric_reflectance * (1 - m)) / fmax(m, 1e-6);
		/* m weights the better determined value. */
		double b = base_from_diffuse + m * m * (base_from_specular - base_from_diffuse);
		s->base_colour[i] = fmin(fmax(b, 0), 1);
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
static struct gltf_surface read_surface(struct gltf *g, const struct gltf_entry *material)
{
	struct gltf_surface s = {.base_colour = {1, 1, 1, 1}, .metallic = 1, .roughness = 1};
	const json_t *metal = gltf_object(g, material, material->json, "pbrMetallicRoughness"),
		     *gloss = gltf_extension(g, material, material->json, "KHR_materials_pbrSpecularGlossiness");
	if (metal) {
		gltf_numbers(g, material, metal, "baseColorFactor", s.base_colour, 4);
		s.metallic = gltf_number(g, material, metal, "metallicFactor", 1);
		s.roughness = gltf_number(g, material, metal, "roughnessFactor", 1);
		s.base_texture = gltf_object(g, material, metal, "baseColorTexture");
		s.roughness_metallic_texture = gltf_object(g, material, metal, "metallicRoughnessTexture");
	} else if (gloss) {
		surface_from_glossiness(g, material, gloss, &s);
	}
	return s;
}

/* ---- its textures */

static void put_attribute(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const char *name,
			  const char *attribute)
{
	gltf_put_string(g, gltf_add_plugin(g, el, material, "texture", "mesh_attribute", name), material, "name",
			attribute);
}

/* Adds a texture as `name` of el and returns it: its unnamed child, still to be added, will be multiplied by an
 * attribute of the mesh. */
static struct xml_element *put_attribute_product(struct gltf *g, struct xml_element *el,
						 const struct gltf_entry *material, const char *name,
						 const char *attribute)
{
	struct xml_element *scale = gltf_add_plugin(g, el, material, "texture", "scale", name);
	put_attribute(g, scale, material, "scale", attribute);
	return scale;
}

static void put_base_colour(struct gltf *g, struct xml_element *el, const struct gltf_entry *material,
			    const double rgb[3], const json_t *texture, enum gltf_vertex_colours colours)
{
	const struct gltf_channel c = {.is_colour = true, .factor = {rgb[0], rgb[1], rgb[2]}, .cutoff = -1};
	if (!colours) {
		gltf_put_colour(g, el, material, "base_color", rgb, texture);
	} else if (texture) {
		gltf_put_texture(g, put_attribute_product(g, el, material, "base_color", "vertex_color"), material,
				 NULL, texture, &c);
	} else {
		struct xml_element *scale = gltf_add_plugin(g, el, material, "texture", "scale", "base_color");
		gltf_put_rgb(g, scale, material, "scale", rgb);
		put_attribute(g, scale, material, NULL, "vertex_color");
	}
}

/* ---- the material */

/* A mode that the format does not have is refused; a lenient reader leaves it out, and the material is opaque. */
static struct xml_element *put_unknown_mode(struct gltf *g, struct xml_element *parent,
					    const struct gltf_entry *material, const char *mode)
{
	char name[64];
	struct xml_element *mask = gltf_add_plugin(g, parent, material, "bsdf", "mask", NULL);
	snprintf(name, sizeof name, "alphaMode \"%.32s\"", mode);
	gltf_put_string(g, mask, material, name, ELEMENT_UNSUPPORTED);
	gltf_put_number(g, mask, material, "opacity", 1);
	return mask;
}

/* Wraps the BSDF in a mask, which lets a part of the light through unchanged, if the material has one. */
static struct xml_element *put_mask(struct gltf *g, struct xml_element *parent, const struct gltf_entry *material,
				    const json_t *texture, double alpha, bool vertex_alpha)
{
	const char *mode = gltf_string(g, material, material->json, "alphaMode", "OPAQUE");
	bool is_cutout = strcmp(mode, "MASK") == 0;
	if (!is_cutout && strcmp(mode, "OPAQUE") != 0 && strcmp(mode, "BLEND") != 0)
		return put_unknown_mode(g, parent, material, mode);
	if (strcmp(mode, "OPAQUE") == 0 || (!texture && !is_cutout && alpha == 1 && !vertex_alpha))
		return parent;
	double cutoff = gltf_number(g, material, material->json, "alphaCutoff", 0.5);
	if (!texture && is_cutout && alpha >= cutoff && !vertex_alpha)
		return parent;
	struct xml_element *mask = gltf_add_plugin(g, parent, material, "bsdf", "mask", NULL);
	if (is_cutout && vertex_alpha) /* the threshold would apply to a product: not supported */
		gltf_put_string(g, mask, material, "alpha_of_COLOR_0_with_MASK", ELEMENT_UNSUPPORTED);
	/* The product of alpha and the texture's is cut off at `cutoff`. */
	const struct gltf_channel c = {.name = "a",
				       .factor = {is_cutout ? 1 : alpha},
				       .cutoff = !is_cutout  ? -1
						 : alpha > 0 ? fmin(cutoff / alpha, 2)
							     : 2};
	if (texture && vertex_alpha) {
		gltf_put_texture(g, put_attribute_product(g, mask, material, "opacity", "vertex_alpha"), material, NULL,
				 texture, &c);
	} else if (texture) {
		gltf_put_texture(g, mask, material, "opacity", texture, &c);
	} else if (vertex_alpha) {
		struct xml_element *scale = gltf_add_plugin(g, mask, material, "texture", "scale", "opacity");
		gltf_put_number(g, scale, material, "scale", alpha);
		put_attribute(g, scale, material, NULL, "vertex_alpha");
	} else {
		gltf_put_number(g, mask, material, "opacity", is_cutout ? 0 : alpha);
	}
	return mask;
}

static struct xml_element *put_normal_map(struct gltf *g, struct xml_element *parent, const struct gltf_entry *material)
{
	const json_t *info = gltf_object(g, material, material->json, "normalTexture");
	if (!info)
		return parent;
	struct xml_element *map = gltf_add_plugin(g, parent, material, "bsdf", "normalmap", NULL);
	const struct gltf_channel c = {.factor = {1}, .cutoff = -1};
	/* Features of Mitsuba's normal maps that the format does not have. */
	gltf_put_bool(g, map, material, "flip_invalid_normals", false);
	gltf_put_bool(g, map, material, "use_shadowing_function", false);
	gltf_put_bool(g, map, material, "handedness", true);
	gltf_put_texture(g, map, material, NULL, info, &c);
	double scale = gltf_number(g, material, info, "scale", 1);
	if (scale != 1)
		gltf_put_number(g, map, material, "scale", scale);
	return map;
}

/* Gives an id to the <bsdf>, <emitter> or <medium> at the top level, by which shapes refer to it. */
static void put_id(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const char *kind,
		   enum gltf_vertex_colours colours)
{
	static const char *const suffixes[] = {"", " with COLOR_0", " with COLOR_0 and alpha"};
	gltf_add_attribute(g, el, "id", "%s of materials[%zu]%s", kind, material->index, suffixes[colours]);
}

static struct xml_element *put_ref(struct gltf *g, struct xml_element *shape, const struct gltf_entry *material,
				   const char *kind, enum gltf_vertex_colours colours)
{
	struct xml_element *ref = gltf_add_element(g, shape, material, "ref");
	put_id(g, ref, material, kind, colours);
	return ref;
}

bool gltf_material_emits(struct gltf *g, const struct gltf_entry *material, double rgb[3])
{
	const json_t *extension = gltf_extension(g, material, material->json, "KHR_materials_emissive_strength");
	double strength = extension ? gltf_number(g, material, extension, "emissiveStrength", 1) : 1;
	rgb[0] = rgb[1] = rgb[2] = 0;
	gltf_numbers(g, material, material->json, "emissiveFactor", rgb, 3);
	for (int k = 0; k < 3; k++)
		rgb[k] *= strength;
	return rgb[0] > 0 || rgb[1] > 0 || rgb[2] > 0;
}

/* Makes clear glass with a varying index: a dielectric with Cauchy's law for the Abbe number 20 / dispersion. As in
 * `principled`, each boundary colours light by the square root of the base colour. Returns false if it is another
 * material. */
static bool put_dispersive_glass(struct gltf *g, const struct gltf_entry *material, const struct gltf_surface *s)
{
	static const double f_line = 0.48613, c_line = 0.65627; /* micrometres */
	const json_t *t = gltf_extension(g, material, material->json, "KHR_materials_transmission"),
		     *dispersion = gltf_extension(g, material, material->json, "KHR_materials_dispersion"),
		     *ior = gltf_extension(g, material, material->json, "KHR_materials_ior");
	double strength = dispersion ? gltf_number(g, material, dispersion, "dispersion", 0) : 0;
	bool is_clear = s->metallic == 0 && !s->base_texture && !s->roughness_metallic_texture, is_white = true;
	double boundary_colour[3];
	for (int k = 0; k < 3; k++) {
		/* Negative values are refused later. */
		boundary_colour[k] = s->base_colour[k] > 0 ? sqrt(s->base_colour[k]) : s->base_colour[k];
		is_white &= s->base_colour[k] == 1;
	}
	if (!(strength > 0) || !is_clear || !t || gltf_number(g, material, t, "transmissionFactor", 0) != 1 ||
	    json_object_get(t, "transmissionTexture") ||
	    gltf_extension(g, material, material->json, "KHR_materials_clearcoat") ||
	    gltf_extension(g, material, material->json, "KHR_materials_specular"))
		return false;
	double n = ior ? gltf_number(g, material, ior, "ior", 1.5) : 1.5;
	double spread = 1 / (f_line * f_line) - 1 / (c_line * c_line);
	struct xml_element *parent = put_normal_map(g, g->scene, material),
			   *bsdf = gltf_add_plugin(g, parent, material, "bsdf",
						   s->roughness > 0 ? "roughdielectric" : "dielectric", NULL);
	gltf_put_number(g, bsdf, material, "int_ior", n);
	gltf_put_number(g, bsdf, material, "ext_ior", 1);
	gltf_put_number(g, bsdf, material, "int_cauchy_b", (n - 1) * strength / 20 / spread);
	if (!is_white)
		gltf_put_colour(g, bsdf, material, "specular_transmittance", boundary_colour, NULL);
	if (s->roughness > 0) {
		gltf_put_string(g, bsdf, material, "distribution", "ggx");
		gltf_put_number(g, bsdf, material, "alpha", s->roughness * s->roughness);
	}
	gltf_note_unlisted_extensions(g, material);
	if (!g->error_code)
		put_id(g, parent == g->scene ? bsdf : parent, material, "bsdf", GLTF_NO_COLOURS);
	return true;
}

/* Adds a blend for diffuse transmission, which takes a fraction of the light that metal does not reflect.
 * put_diffuse_transmission adds it as a second BSDF beside the material's own, so the boundary reflects less than in
 * the format, by that fraction. */
static struct xml_element *put_transmission_blend(struct gltf *g, struct xml_element *parent,
						  const struct gltf_entry *material, const json_t *diffuse_transmission,
						  double metallic)
{
	const json_t *t = gltf_extension(g, material, material->json, "KHR_materials_transmission");
	double factor = diffuse_transmission
				? gltf_number(g, material, diffuse_transmission, "diffuseTransmissionFactor", 0) *
					  (1 - metallic)
				: 0;
	if (!(factor > 0))
		return parent;
	if (t && gltf_number(g, material, t, "transmissionFactor", 0) > 0) {
		gltf_note(
			g,
			"KHR_materials_diffuse_transmission is left out if the material also transmits light otherwise");
		return parent;
	}
	struct xml_element *blend = gltf_add_plugin(g, parent, material, "bsdf", "blendbsdf", NULL);
	gltf_put_factor(g, blend, material, "weight", factor,
			gltf_object(g, material, diffuse_transmission, "diffuseTransmissionTexture"), "a");
	return blend;
}

static void put_diffuse_transmission(struct gltf *g, struct xml_element *blend, const struct gltf_entry *material,
				     const json_t *diffuse_transmission)
{
	double rgb[3] = {1, 1, 1};
	struct xml_element *sheet = gltf_add_plugin(g, blend, material, "bsdf", "difftrans", NULL);
	gltf_numbers(g, material, diffuse_transmission, "diffuseTransmissionColorFactor", rgb, 3);
	gltf_put_colour(g, sheet, material, "transmittance", rgb,
			gltf_object(g, material, diffuse_transmission, "diffuseTransmissionColorTexture"));
}

static void put_principled(struct gltf *g, const struct gltf_entry *material, enum gltf_vertex_colours colours)
{
	const struct gltf_surface s = read_surface(g, material);
	if (!colours && put_dispersive_glass(g, material, &s))
		return;
	const json_t *diffuse_transmission =
		gltf_extension(g, material, material->json, "KHR_materials_diffuse_transmission");
	struct xml_element *mask = put_mask(g, g->scene, material, s.base_texture, s.base_colour[3],
					    colours == GLTF_COLOURS_AND_ALPHA),
			   *map = put_normal_map(g, mask, material),
			   *blend = put_transmission_blend(g, map, material, diffuse_transmission,
							   s.roughness_metallic_texture ? 0 : s.metallic),
			   *bsdf = gltf_add_plugin(g, blend, material, "bsdf", "principled", NULL);
	put_base_colour(g, bsdf, material, s.base_colour, s.base_texture, colours);
	gltf_put_factor(g, bsdf, material, "metallic", s.metallic, s.metallic > 0 ? s.roughness_metallic_texture : NULL,
			"b");
	gltf_put_layers(g, bsdf, material, s.roughness, s.roughness_metallic_texture);
	if (!g->uses_burley_diffuse)
		gltf_put_bool(g, bsdf, material, "lambertian", true);
	if (blend != map)
		put_diffuse_transmission(g, blend, material, diffuse_transmission);
	if (g->error_code)
		return;
	while (bsdf->parent != g->scene)
		bsdf = bsdf->parent;
	put_id(g, bsdf, material, "bsdf", colours);
}

static void put_emitter(struct gltf *g, const struct gltf_entry *material)
{
	double rgb[3];
	if (!gltf_material_emits(g, material, rgb))
		return;
	struct xml_element *emitter = gltf_add_plugin(g, g->scene, material, "emitter", "area", NULL);
	gltf_put_colour(g, emitter, material, "radiance", rgb,
			gltf_object(g, material, material->json, "emissiveTexture"));
	if (json_is_true(json_object_get(material->json, "doubleSided")))
		gltf_put_bool(g, emitter, material, "two_sided", true);
	put_id(g, emitter, material, "emitter", GLTF_NO_COLOURS);
	/* Emission of at most 1 is like a screen's and does not light a room: then an environment is added, as by
	 * viewers. */
	g->has_light |= rgb[0] > 1 || rgb[1] > 1 || rgb[2] > 1;
}

/* Computes the coefficients of Beer's law with which white light has the given colour after `distance`. Returns
 * whether any is above 0. Without thickness a volume is a thin sheet, which absorbs nothing. */
static bool compute_absorption(struct gltf *g, const struct gltf_entry *material, double sigma_a[3])
{
	const json_t *volume = gltf_extension(g, material, material->json, "KHR_materials_volume"),
		     *t = gltf_extension(g, material, material->json, "KHR_materials_transmission");
	double distance = volume ? gltf_number(g, material, volume, "attenuationDistance", 0) : 0,
	       colour[3] = {1, 1, 1};
	if (!(distance > 0) || !t || !(gltf_number(g, material, t, "transmissionFactor", 0) > 0) ||
	    !(gltf_number(g, material, volume, "thicknessFactor", 0) > 0))
		return false;
	gltf_numbers(g, material, volume, "attenuationColor", colour, 3);
	for (int k = 0; k < 3; k++)
		sigma_a[k] = -log(fmin(fmax(colour[k], ATTENUATION_COLOUR_MIN), 1)) / distance;
	return sigma_a[0] > 0 || sigma_a[1] > 0 || sigma_a[2] > 0;
}

static void put_medium(struct gltf *g, const struct gltf_entry *material)
{
	double sigma_a[3];
	if (!compute_absorption(g, material, sigma_a))
		return;
	struct xml_element *medium = gltf_add_plugin(g, g->scene, material, "medium", "homogeneous", NULL);
	gltf_put_rgb(g, medium, material, "sigma_t", sigma_a);
	gltf_put_number(g, medium, material, "albedo", 0);
	put_id(g, medium, material, "medium", GLTF_NO_COLOURS);
}

void gltf_add_material(struct gltf *g, struct xml_element *shape, const struct gltf_entry *material,
		       enum gltf_vertex_colours colours)
{
	double rgb[3];
	if (!(g->is_material_made[material->index] >> colours & 1))
		put_principled(g, material, colours);
	if (!g->is_material_made[material->index]) {
		put_emitter(g, material);
		put_medium(g, material);
	}
	g->is_material_made[material->index] |= (unsigned char)(1u << colours);
	put_ref(g, shape, material, "bsdf", colours);
	if (gltf_material_emits(g, material, rgb))
		put_ref(g, shape, material, "emitter", GLTF_NO_COLOURS);
	if (compute_absorption(g, material, rgb))
		gltf_add_attribute(g, put_ref(g, shape, material, "medium", GLTF_NO_COLOURS), "name", "interior");
}

/* For shapes without a material: the format's default is a rough white metal, but Blender shows such objects in
 * grey, so they are grey in its files. */
void gltf_add_default_material(struct gltf *g, struct xml_element *shape, enum gltf_vertex_colours colours)
{
	static const char grey[] =
		"{\"pbrMetallicRoughness\": {\"baseColorFactor\": [0.8, 0.8, 0.8, 1], \"metallicFactor\": 0,"
		"\"roughnessFactor\": 0.5},"
		"\"extensions\": {\"KHR_materials_specular\": {\"specularFactor\": 0}}}";
	json_t *material = json_loads(g->is_from_blender ? grey : "{}", 0, NULL);
	size_t count = json_array_size(json_object_get(g->root, "materials"));
	if (material)
		gltf_add_material(g, shape, &(struct gltf_entry){GLTF_MATERIALS, count, material}, colours);
	else
		gltf_fail(g, NULL, ENOMEM, "out of memory");
	json_decref(material);
}
