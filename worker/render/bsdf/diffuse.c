/* SPDX-License-Identifier: Apache-2.0 */
/* Lambertian reflection on the side of the normal. */
#include "worker/render/bsdf/diffuse.h"
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/warp.h"

static spectrum diffuse_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_constant(0);
	return spectrum_scale(1 / WARP_PI, texture_eval(b->data, &p->texture_point, p->wavelengths));
}

double diffuse_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p;
	return wo.z > 0 && wi.z > 0 ? wi.z / WARP_PI : 0;
}

bool diffuse_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		    struct bsdf_sample *out)
{
	return bsdf_sample_smooth(b, p, wo, warp_cosine_hemisphere(u[0], u[1]), out);
}

static int diffuse_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct texture *t = b->data;
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	b->mean_alpha = 1;
	int code = bsdf_read_texture(b, t, n, "reflectance", 0.5, build, e);
	b->is_black = !code && texture_max(t) == 0;
	return code;
}

const struct bsdf_ops bsdf_ops_diffuse = {
	.decl = {PLUGIN_BSDF, "diffuse", PARAMS({.name = "reflectance", .types = VALUE_TEXTURE, .max = 1}), 0,
		 PARAM_UNDERSTOOD},
	.data_size = sizeof(struct texture),
	.create = diffuse_create,
	.eval = diffuse_eval,
	.pdf_solid = diffuse_pdf,
	.sample = diffuse_sample,
};

void bsdf_make_default(struct bsdf *b)
{
	static struct texture half = {.color = {.kind = COLOR_KIND_CONSTANT, .scale = 0.5}};
	*b = (struct bsdf){.ops = &bsdf_ops_diffuse,
			   .modes = BSDF_REFLECT,
			   .has_smooth = true,
			   .min_alpha = INFINITY,
			   .mean_alpha = 1,
			   .eta = 1,
			   .color_kind = COLOR_KIND_CONSTANT,
			   .data = &half};
}
