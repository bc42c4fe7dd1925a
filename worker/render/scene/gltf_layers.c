/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The extensions of materials as properties of `principled`. Transmission refracts, as in importers of modelling tools:
 * thin walls are not distinguished from solids. The clear coat's strength is four times the parameter of `principled`,
 * which ends at a quarter of the format's.
 *
 * What `principled` does not have becomes a property that its table does not know: refused with its name, or left out
 * with --lenient.
 */
#include "worker/render/scene/gltf_layers.h"
#include "worker/render/scene/gltf_texture.h"

#include <math.h>
#include <string.h>

/* Members of an extension without counterpart, as properties that no table has. */
void gltf_put_unsupported(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const json_t *extension,
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
	gltf_put_unsupported(g, el, at, specular, others);
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
	gltf_put_unsupported(g, el, at, coat, others);
}

static void put_transmission(struct gltf *g, struct xml_element *el, const struct gltf_at *at)
{
	const json_t *t = gltf_extension(g, at, at->json, "KHR_materials_transmission"),
		     *volume = gltf_extension(g, at, at->json, "KHR_materials_volume"),
		     *dispersion = gltf_extension(g, at, at->json, "KHR_materials_dispersion");
	double factor = t ? gltf_number(g, at, t, "transmissionFactor", 0) : 0;
	if (factor > 0) {
		gltf_put_number(g, el, at, "spec_trans", factor);
		gltf_put_unsupported(g, el, at, t, (const char *const[]){"transmissionTexture", NULL});
		gltf_put_unsupported(g, el, at, volume, (const char *const[]){"attenuationDistance", NULL});
		if (dispersion && gltf_number(g, at, dispersion, "dispersion", 0) > 0)
			gltf_put_unsupported(g, el, at, dispersion, (const char *const[]){"dispersion", NULL});
	}
}

void gltf_put_foreign(struct gltf *g, struct xml_element *el, const struct gltf_at *at)
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

void gltf_put_layers(struct gltf *g, struct xml_element *el, const struct gltf_at *at)
{
	put_index(g, el, at);
	put_coat(g, el, at);
	put_transmission(g, el, at);
	gltf_put_foreign(g, el, at);
}
