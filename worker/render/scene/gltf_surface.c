/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Metallic-roughness, or, of a material without it, KHR_materials_pbrSpecularGlossiness: a diffuse colour d, and a
 * reflectance s at normal incidence, for which a base b and a share m of metal are found. A dielectric reflects r =
 * 0.04 of each colour, so that
 *
 *   s = r (1 - m) + b m,   d = b (1 - m) (1 - r) / (1 - max s)
 *
 * for the brightness of both; eliminating b leaves r m^2 + p m + r - s = 0 with p = d (1 - max s) / (1 - r) + s - 2 r.
 * Where s has a texture it is taken for a dielectric's, with a note.
 */
#include "worker/render/scene/gltf_surface.h"

static const double dielectric = 0.04;

/* As the eye weighs them, with a square root as a rough gamma. */
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
			"textures of KHR_materials_pbrSpecularGlossiness are left out except for the diffuse colour's; "
			"such materials are no metals");
		return;
	}
	double rest = 1 - fmin(fmax(specular[0], fmax(specular[1], specular[2])), 1);
	double m = s->metallic = metal_share(s->base, specular, rest);
	for (int i = 0; i < 3; i++) {
		double of_diffuse = s->base[i] * rest / (1 - dielectric) / fmax(1 - m, 1e-6),
		       of_specular = (specular[i] - dielectric * (1 - m)) / fmax(m, 1e-6);
		double b = of_diffuse + m * m * (of_specular - of_diffuse); /* the better known of the two */
		s->base[i] = fmin(fmax(b, 0), 1);
	}
}

struct gltf_surface gltf_surface_read(struct gltf *g, const struct gltf_at *at)
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
