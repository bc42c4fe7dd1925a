/* A smooth boundary between two transparent media: Fresnel's reflection and Snell's refraction. */
#include "worker/bsdf/fresnel.h"
#include "worker/bsdf/glass.h"
#include "worker/bsdf/ior.h"

#include <float.h>

static spectrum dielectric_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return spectrum_of(0);
}

static double dielectric_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return 0;
}

static bool dielectric_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			      struct bsdf_sample *out)
{
	const struct glass *g = b->data;
	double eta = wo.z > 0 ? b->eta : 1 / b->eta, c = fmin(fabs(wo.z), 1);
	struct fresnel f = fresnel_dielectric(c, eta);
	if (u[2] < f.reflected) {
		if (!(c >= DBL_MIN)) /* 1 / c must be finite */
			return false;
		*out = (struct bsdf_sample){.wi = {-wo.x, -wo.y, wo.z}, .mode = BSDF_REFLECT | BSDF_DELTA, .pdf = f.reflected,
					    .eta = 1};
		out->f = spectrum_scale(f.reflected / c, texture_eval(&g->reflectance, p->u, p->v, p->w));
		return true;
	}
	if (!(f.cos_t >= DBL_MIN && f.transmitted > 0))
		return false;
	double scale = p->transport == TRANSPORT_RADIANCE ? 1 / (eta * eta) : 1;
	*out = (struct bsdf_sample){.wi = {-wo.x / eta, -wo.y / eta, -copysign(f.cos_t, wo.z)},
				    .mode = BSDF_TRANSMIT | BSDF_DELTA, .pdf = f.transmitted, .eta = eta};
	out->f = spectrum_scale(f.transmitted * scale / f.cos_t, texture_eval(&g->transmittance, p->u, p->v, p->w));
	return true;
}

int glass_read(struct glass *g, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
	       struct error *e)
{
	double inside, outside;
	int code = ior_read(n, "int_ior", IOR_BK7_DEFAULT, &inside, e);
	if (!code)
		code = ior_read(n, "ext_ior", IOR_AIR_DEFAULT, &outside, e);
	if (!code)
		code = bsdf_texture(b, &g->reflectance, n, "specular_reflectance", 1, build, e);
	if (!code)
		code = bsdf_texture(b, &g->transmittance, n, "specular_transmittance", 1, build, e);
	if (code)
		return code;
	b->eta = inside / outside;
	b->two_sided = true;
	return 0;
}

static int dielectric_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct glass *g = bsdf_data(b, n, build, sizeof *g, e);
	if (!g)
		return -ENOMEM;
	b->modes = BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA;
	b->has_delta = true;
	b->alpha = 0;
	return glass_read(g, b, n, build, e);
}

static const struct param dielectric_params[] = {GLASS_PARAMS, {.name = NULL}};

const struct bsdf_ops bsdf_ops_dielectric = {
	.type = "dielectric",
	.params = dielectric_params,
	.create = dielectric_create,
	.eval = dielectric_eval,
	.pdf_solid = dielectric_pdf,
	.sample = dielectric_sample,
};
