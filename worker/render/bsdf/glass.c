/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/glass.h"

/* Compares the indices themselves: equal laws on both sides, or coefficients of zero, refract all wavelengths alike. */
static bool varies_with_wavelength(const struct ior side[2], double eta)
{
	for (double nm = WAVELENGTH_MIN; nm <= WAVELENGTH_MAX; nm++)
		if (ior_eta(side, nm) != eta)
			return true;
	return false;
}

static int read_index(struct glass *g, struct bsdf *b, const struct scene_node *n, struct error *e)
{
	int code = ior_read_law(n, IOR_INT, &g->side[IOR_INT], e);
	if (!code)
		code = ior_read_law(n, IOR_EXT, &g->side[IOR_EXT], e);
	if (code)
		return code;
	if (node_bool(n, "dispersion", false) && !ior_has_coefficients(n) && !g->side[IOR_INT].term_count &&
	    !g->side[IOR_EXT].term_count) {
		char names[128];
		return node_error(
			n, e, EINVAL,
			"dispersion: a number does not depend on the wavelength; name one of %s or give coefficients",
			ior_dispersive_names(names, sizeof names));
	}
	b->ior = g->side;
	b->eta = ior_eta(b->ior, IOR_REFERENCE_NM);
	b->is_dispersive = varies_with_wavelength(b->ior, b->eta);
	if (b->is_dispersive)
		bsdf_add_color_kind(b, COLOR_KIND_OTHER);
	return 0;
}

int glass_read(struct glass *g, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
	       struct error *e)
{
	int code = read_index(g, b, n, e);
	if (!code)
		code = bsdf_read_texture(b, &g->reflectance, n, "specular_reflectance", 1, build, e);
	if (!code)
		code = bsdf_read_texture(b, &g->transmittance, n, "specular_transmittance", 1, build, e);
	b->is_two_sided = true;
	b->is_black = !code && texture_max(&g->reflectance) == 0 && texture_max(&g->transmittance) == 0;
	return code;
}
