/*
 * A rough boundary between two transparent media: Walter et al. 2007, eqs. 19-21, visible normals sampled, the mode
 * chosen by Fresnel's factor at the microfacet. Everything is mirrored so that wo is on the side of the normal.
 */
#include "worker/bsdf/fresnel.h"
#include "worker/bsdf/glass.h"
#include "worker/bsdf/microfacet.h"

struct roughdielectric {
	struct glass glass; /* first: with equal indices the data is that of a smooth dielectric */
	struct microfacet facets;
};

/* A pair of directions as the facets see it. */
struct facet {
	vec3 h;      /* on wo's side */
	double d;    /* distribution x G1(wo) / |wo.z| */
	double eta;  /* index beyond over index on wo's side */
	struct fresnel fresnel;
	double cos_o, cos_i; /* against h; cos_i < 0 when refracted */
	double jacobian;     /* solid angle of h over that of wi */
};

/* wo.z > 0. false: no facet connects the two. */
static bool facet_of(const struct roughdielectric *r, double eta, vec3 wo, vec3 wi, struct facet *f)
{
	bool reflect = wi.z > 0;
	vec3 sum = reflect ? vec3_add(wo, wi) : vec3_madd(wo, eta, wi);
	if (wi.z == 0 || !microfacet_half(sum, &f->h))
		return false;
	if (f->h.z < 0)
		f->h = vec3_neg(f->h);
	f->eta = eta;
	f->cos_o = vec3_dot(wo, f->h);
	f->cos_i = vec3_dot(wi, f->h);
	/* Facets are seen from the side that the surface is seen from. */
	if (!(f->cos_o > 0) || (reflect ? !(f->cos_i > 0) : !(f->cos_i < 0)))
		return false;
	f->fresnel = fresnel_dielectric(fmin(f->cos_o, 1), eta);
	f->d = microfacet_d(&r->facets, f->h) * microfacet_g1_over_cos(&r->facets, wo);
	double root = f->cos_o + eta * f->cos_i;
	f->jacobian = reflect ? 0.25 / f->cos_o : eta * eta * -f->cos_i / (root * root);
	return f->d > 0 && isfinite(f->jacobian);
}

static vec3 mirror(vec3 v, bool below)
{
	return below ? (vec3){v.x, v.y, -v.z} : v;
}

static spectrum facet_f(const struct bsdf *b, const struct bsdf_point *p, const struct facet *f, vec3 wi)
{
	const struct roughdielectric *r = b->data;
	double common = f->d * microfacet_g1_over_cos(&r->facets, (vec3){wi.x, wi.y, fabs(wi.z)}) * f->cos_o * f->jacobian;
	if (wi.z > 0)
		return spectrum_scale(common * f->fresnel.reflected, texture_eval(&r->glass.reflectance, p->u, p->v, p->w));
	if (p->transport == TRANSPORT_RADIANCE)
		common /= f->eta * f->eta;
	return spectrum_scale(common * f->fresnel.transmitted, texture_eval(&r->glass.transmittance, p->u, p->v, p->w));
}

static double facet_pdf(const struct facet *f, vec3 wi)
{
	return f->d * f->cos_o * f->jacobian * (wi.z > 0 ? f->fresnel.reflected : f->fresnel.transmitted);
}

static spectrum roughdielectric_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	bool below = wo.z < 0;
	struct facet f;
	wi = mirror(wi, below);
	if (wo.z == 0 || !facet_of(b->data, below ? 1 / b->eta : b->eta, mirror(wo, below), wi, &f))
		return spectrum_of(0);
	return facet_f(b, p, &f, wi);
}

static double roughdielectric_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)p;
	bool below = wo.z < 0;
	struct facet f;
	wi = mirror(wi, below);
	if (wo.z == 0 || !facet_of(b->data, below ? 1 / b->eta : b->eta, mirror(wo, below), wi, &f))
		return 0;
	return facet_pdf(&f, wi);
}

static bool roughdielectric_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
				   struct bsdf_sample *out)
{
	const struct roughdielectric *r = b->data;
	bool below = wo.z < 0;
	if (wo.z == 0)
		return false;
	wo = mirror(wo, below);
	double eta = below ? 1 / b->eta : b->eta;
	vec3 h = microfacet_sample_visible(&r->facets, wo, u[0], u[1]), wi;
	double c = fmin(vec3_dot(wo, h), 1);
	if (!(c > 0))
		return false;
	struct fresnel at_h = fresnel_dielectric(c, eta);
	bool reflect = u[2] < at_h.reflected;
	if (reflect)
		wi = vec3_sub(vec3_scale(2 * c, h), wo);
	else
		wi = vec3_madd(vec3_scale(-1 / eta, wo), c / eta - at_h.cos_t, h);
	wi = vec3_normalize(wi);
	struct facet f;
	if (reflect != (wi.z > 0) || !facet_of(r, eta, wo, wi, &f))
		return false;
	double pdf = facet_pdf(&f, wi);
	if (!(pdf > 0))
		return false;
	*out = (struct bsdf_sample){.wi = mirror(wi, below), .mode = reflect ? BSDF_REFLECT : BSDF_TRANSMIT, .pdf = pdf,
				    .f = facet_f(b, p, &f, wi), .eta = reflect ? 1 : eta};
	return true;
}

static int roughdielectric_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
				  struct error *e)
{
	struct roughdielectric *r = bsdf_data(b, n, build, sizeof *r, e);
	if (!r)
		return -ENOMEM;
	int code = microfacet_read(&r->facets, n, e);
	if (!code)
		code = glass_read(&r->glass, b, n, build, e);
	if (code)
		return code;
	b->modes = BSDF_REFLECT | BSDF_TRANSMIT;
	b->has_smooth = true;
	b->alpha = b->alpha_mean = r->facets.alpha;
	if (b->eta == 1) {
		/* No facet bends light: all of it goes straight on. */
		extern const struct bsdf_ops bsdf_ops_dielectric;
		b->ops = &bsdf_ops_dielectric;
		b->modes |= BSDF_DELTA;
		b->has_smooth = false;
		b->has_delta = true;
		b->alpha = b->alpha_mean = 0;
	}
	return 0;
}

static const struct param roughdielectric_params[] = {GLASS_PARAMS, MICROFACET_PARAMS, {.name = NULL}};

const struct bsdf_ops bsdf_ops_roughdielectric = {
	.type = "roughdielectric",
	.params = roughdielectric_params,
	.create = roughdielectric_create,
	.eval = roughdielectric_eval,
	.pdf_solid = roughdielectric_pdf,
	.sample = roughdielectric_sample,
};
