/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The extensions of materials as properties of `principled`. Transmission refracts, as modelling tools import it: thin
 * walls are not distinguished from solids. The clear coat becomes the parameter `coat`, since the original model's
 * `clearcoat` reaches only a quarter of the format's. Anisotropic roughness is exact as long as the two roughnesses
 * differ by less than a factor of ten.
 *
 * Details that `principled` does not have are left out with a note: normals of a coat, textures of a sheen. Unknown
 * extensions are also left out, as the format demands unless the file requires them. Dispersion of anything but clear
 * glass is left out as well; if the file requires it, it becomes a property that the table does not have: refused with
 * its name, or left out with --lenient.
 */
#include "worker/render/gltf/gltf_layers.h"
#include "worker/render/gltf/gltf_texture.h"

#include <stdio.h>
#include <string.h>

/* Notes that members are left out, if there are any. note: which layer they belong to, and why that matters little. */
static void note_unsupported_members(struct gltf *g, const json_t *extension, const char *const *members,
				     const char *note)
{
	for (; *members; members++)
		if (json_object_get(extension, *members)) {
			gltf_note(g, note);
			return;
		}
}

/* Sets the boundary's reflectance. In the format it is f (F0 + (1 - F0) (1 - cos)^5) with F0 = min(r^2 c, 1), where r^2
 * is the reflectance of the index at normal incidence, f a strength and c a colour. Here f is `specular_strength` and c
 * `specular_color`. If c's factor has a component above 1, the largest is included in the index, and the colour is
 * relative to it; for materials that transmit light the index stays as it is, and the components are at most 1. */
static void put_reflection(struct gltf *g, struct xml_element *el, const struct gltf_entry *material)
{
	const json_t *ior = gltf_extension(g, material, material->json, "KHR_materials_ior"),
		     *specular = gltf_extension(g, material, material->json, "KHR_materials_specular"),
		     *transmission = gltf_extension(g, material, material->json, "KHR_materials_transmission");
	double eta = ior ? gltf_number(g, material, ior, "ior", 1.5) : 1.5, strength = 1, rgb[3] = {1, 1, 1};
	if (specular) {
		strength = fmin(fmax(gltf_number(g, material, specular, "specularFactor", 1), 0), 1);
		gltf_numbers(g, material, specular, "specularColorFactor", rgb, 3);
	}
	const json_t *texture = specular ? gltf_object(g, material, specular, "specularTexture") : NULL,
		     *colour = specular ? gltf_object(g, material, specular, "specularColorTexture") : NULL;
	double largest = fmax(rgb[0], fmax(rgb[1], rgb[2])), divisor = fmax(largest, 1);
	bool transmits = transmission && gltf_number(g, material, transmission, "transmissionFactor", 0) > 0;
	if (transmits && divisor > 1) {
		gltf_note(g, "specular colours above 1 of materials that transmit light count as 1");
		divisor = 1;
	}
	for (int k = 0; k < 3; k++)
		rgb[k] = fmin(fmax(rgb[k], 0) / divisor, 1);
	bool is_coloured = colour || rgb[0] != 1 || rgb[1] != 1 || rgb[2] != 1;
	/* In the format an index of 0 means total reflection. */
	double root = eta > 0 ? fabs((eta - 1) / (eta + 1)) : 1, scaled = fmin(root * sqrt(divisor), 1);
	gltf_put_number(g, el, material, "eta", fmin((1 + scaled) / fmax(1 - scaled, 0.1), 10));
	if (strength < 1 || texture)
		gltf_put_factor(g, el, material, "specular_strength", strength, strength > 0 ? texture : NULL, "a");
	if (is_coloured)
		gltf_put_colour(g, el, material, "specular_color", rgb, largest > 0 ? colour : NULL);
}

static void put_coat(struct gltf *g, struct xml_element *el, const struct gltf_entry *material)
{
	const json_t *coat = gltf_extension(g, material, material->json, "KHR_materials_clearcoat");
	double factor = coat ? gltf_number(g, material, coat, "clearcoatFactor", 0) : 0;
	if (!(factor > 0))
		return;
	double roughness = gltf_number(g, material, coat, "clearcoatRoughnessFactor", 0);
	gltf_put_factor(g, el, material, "coat", factor, gltf_object(g, material, coat, "clearcoatTexture"), "r");
	gltf_put_factor(g, el, material, "coat_roughness", roughness,
			roughness > 0 ? gltf_object(g, material, coat, "clearcoatRoughnessTexture") : NULL, "g");
	note_unsupported_members(g, coat, (const char *const[]){"clearcoatNormalTexture", NULL},
				 "clear coats use the normals of the surface: their own normal maps are left out");
}

/* The format's sheen is that of cloth (Estevez and Kulla 2017); Burley's is a brightening at grazing angles. */
static void put_sheen(struct gltf *g, struct xml_element *el, const struct gltf_entry *material)
{
	const json_t *sheen = gltf_extension(g, material, material->json, "KHR_materials_sheen");
	double rgb[3] = {0, 0, 0};
	if (sheen)
		gltf_numbers(g, material, sheen, "sheenColorFactor", rgb, 3);
	double largest = fmax(rgb[0], fmax(rgb[1], rgb[2])), smallest = fmin(rgb[0], fmin(rgb[1], rgb[2]));
	if (!(largest > 0))
		return;
	gltf_note(g,
		  "sheen is that of `principled`, which differs from the format's: no roughness, no textures, and its "
		  "colour is white or the surface's");
	gltf_put_number(g, el, material, "sheen", fmin(largest, 1));
	gltf_put_number(g, el, material, "sheen_tint", fmin(1 - smallest / largest, 1));
}

/* The format widens the roughness along the tangent to a_t = a + (1 - a) s^2, and keeps a across it; `principled`
 * divides and multiplies a by sqrt(1 - 0.9 x). With their ratio r = a_t / a: x = (1 - 1 / r) / 0.9, and a becomes
 * sqrt(a_t a). */
static void put_anisotropy(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, double *roughness,
			   bool has_texture)
{
	const json_t *o = gltf_extension(g, material, material->json, "KHR_materials_anisotropy");
	double s = o ? gltf_number(g, material, o, "anisotropyStrength", 0) : 0,
	       rotation = o ? gltf_number(g, material, o, "anisotropyRotation", 0) : 0, a = *roughness * *roughness;
	if (s == 0)
		return;
	double tangent_alpha = a + (1 - a) * s * s, ratio = a > 0 ? tangent_alpha / a : INFINITY;
	if (has_texture || rotation != 0 || json_object_get(o, "anisotropyTexture") || !(ratio < 10)) {
		gltf_note(g, "anisotropy is left out if it has a texture or a rotation, or if the surface is smooth");
		return;
	}
	gltf_put_number(g, el, material, "anisotropic", (1 - 1 / ratio) / 0.9);
	*roughness = sqrt(sqrt(tangent_alpha * a));
}

/* Unlit surfaces show their colour whatever the light, which no BSDF can do. They are lit with a note, and refused
 * if the file requires the extension. */
static void put_unlit(struct gltf *g, struct xml_element *el, const struct gltf_entry *material)
{
	const char *name = "KHR_materials_unlit";
	if (!gltf_extension(g, material, material->json, name))
		return;
	if (gltf_lists_extension(g, "extensionsRequired", name))
		gltf_put_string(g, el, material, name, ELEMENT_UNSUPPORTED);
	else
		gltf_note(g, "surfaces of KHR_materials_unlit are lit like others");
}

static void note_iridescence(struct gltf *g, const struct gltf_entry *material)
{
	const json_t *o = gltf_extension(g, material, material->json, "KHR_materials_iridescence");
	if (o && gltf_number(g, material, o, "iridescenceFactor", 0) > 0)
		gltf_note(g, "the colours of thin films (KHR_materials_iridescence) are left out");
}

/* Leaves out the dispersion of materials other than clear glass: `principled` has a single index of refraction. */
static void put_dispersion(struct gltf *g, struct xml_element *el, const struct gltf_entry *material)
{
	if (gltf_lists_extension(g, "extensionsRequired", "KHR_materials_dispersion"))
		gltf_put_string(g, el, material, "dispersion", ELEMENT_UNSUPPORTED);
	else
		gltf_note(g, "only clear glass without textures disperses light: KHR_materials_dispersion of other "
			     "materials is left out");
}

static void put_transmission(struct gltf *g, struct xml_element *el, const struct gltf_entry *material)
{
	const json_t *t = gltf_extension(g, material, material->json, "KHR_materials_transmission"),
		     *dispersion = gltf_extension(g, material, material->json, "KHR_materials_dispersion");
	double factor = t ? gltf_number(g, material, t, "transmissionFactor", 0) : 0;
	if (factor > 0) {
		gltf_put_factor(g, el, material, "spec_trans", factor,
				gltf_object(g, material, t, "transmissionTexture"), "r");
		if (dispersion && gltf_number(g, material, dispersion, "dispersion", 0) > 0)
			put_dispersion(g, el, material);
	}
}

void gltf_note_unlisted_extensions(struct gltf *g, const struct gltf_entry *material)
{
	json_t *all = json_object_get(material->json, "extensions");
	for (void *i = json_object_iter(all); i; i = json_object_iter_next(all, i)) {
		const char *name = json_object_iter_key(i);
		char text[160];
		if (gltf_is_known_extension(name) || gltf_lists_extension(g, "extensionsUsed", name))
			continue;
		snprintf(
			text, sizeof text,
			"the extension %.64s of a material is not supported and ignored; it is not listed in `extensionsUsed`",
			name);
		gltf_note(g, text);
	}
}

void gltf_put_layers(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, double roughness,
		     const json_t *texture)
{
	put_anisotropy(g, el, material, &roughness, roughness > 0 && texture);
	gltf_put_factor(g, el, material, "roughness", roughness, roughness > 0 ? texture : NULL, "g");
	put_sheen(g, el, material);
	note_iridescence(g, material);
	put_unlit(g, el, material);
	put_reflection(g, el, material);
	put_coat(g, el, material);
	put_transmission(g, el, material);
	gltf_note_unlisted_extensions(g, material);
}
