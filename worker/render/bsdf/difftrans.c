/* SPDX-License-Identifier: Apache-2.0 */
/* A sheet that transmits light diffusely to its other side and reflects none, such as paper or leaves (in a blend with
 * `diffuse`). */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/warp.h"

struct difftrans {
	struct texture transmittance;
};

static spectrum difftrans_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct difftrans *d = b->data;
	if (!(wo.z * wi.z < 0))
		return spectrum_constant(0);
	return spectrum_scale(1 / WARP_PI, texture_eval(&d->transmittance, &p->texture_point, p->wavelengths));
}

static double difftrans_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p;
	return wo.z * wi.z < 0 ? fabs(wi.z) / WARP_PI : 0;
}

static bool difftrans_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			     struct bsdf_sample *out)
{
	vec3 wi = warp_cosine_hemisphere(u[0], u[1]);
	if (wo.z > 0)
		wi.z = -wi.z;
	return bsdf_sample_smooth(b, p, wo, wi, out);
}

static int difftrans_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct difftrans *d = b->data;
	int code = bsdf_read_texture(b, &d->transmittance, n, "transmittance", 0.5, build, e);
	b->is_black = !code && texture_max(&d->transmittance) == 0;
	b->modes = BSDF_TRANSMIT;
	b->has_smooth = true;
	b->is_two_sided = true;
	b->mean_alpha = 1;
	return code;
}

const struct bsdf_ops bsdf_ops_difftrans = {
	.decl = {PLUGIN_BSDF, "difftrans", PARAMS({.name = "transmittance", .types = VALUE_TEXTURE, .max = 1}), 0,
		 PARAM_UNDERSTOOD},
	.data_size = sizeof(struct difftrans),
	.create = difftrans_create,
	.eval = difftrans_eval,
	.pdf_solid = difftrans_pdf,
	.sample = difftrans_sample,
};
