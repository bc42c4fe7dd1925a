/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A rough boundary between two transparent media: Walter et al. 2007, eqs. 19-21. Sampling draws a visible normal and
 * chooses between reflection and transmission by the Fresnel factor at that microfacet. Directions are mirrored such
 * that wo is on the side of the normal.
 */
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/glass.h"
#include "worker/render/bsdf/rough_map.h"

struct roughdielectric {
	struct glass glass; /* first: if created as smooth, the data is that of a `dielectric` */
	struct rough_map roughness;
};

/* A pair of directions relative to the microfacet. */
struct facet {
	vec3 h;	    /* on wo's side */
	double d;   /* distribution x G1(wo) / |wo.z| */
	double eta; /* index beyond over index on wo's side */
	struct fresnel fresnel;
	double cos_o, cos_i; /* cosines to h; cos_i < 0 if refracted */
	double length;	     /* of wo + wi or wo + eta wi */
};

/* Finds the facet that scatters light between wo, with wo.z > 0, and wi. Returns false if there is none. The Fresnel
 * factors are computed from both cosines: near the critical angle, neither determines the other precisely. */
static bool find_facet(const struct microfacet *m, double eta, vec3 wo, vec3 wi, struct facet *f)
{
	bool reflect = wi.z > 0;
	if (wi.z == 0 || (!reflect && eta == 1) ||
	    !microfacet_half_vector(wo, reflect ? 1 : eta, wi, &f->h, &f->length))
		return false;
	if (f->h.z < 0)
		f->h = vec3_neg(f->h);
	f->eta = eta;
	if (reflect) {
		f->cos_o = f->cos_i = 0.5 * f->length;
		f->fresnel = fresnel_dielectric(fmin(f->cos_o, 1), eta);
	} else {
		f->cos_o = vec3_dot(wo, f->h);
		f->cos_i = vec3_dot(wi, f->h);
		/* Both directions must see the facet from the same side as the surface. */
		if (!(f->cos_o > 0 && f->cos_i < 0))
			return false;
		f->fresnel = fresnel_between(fmin(f->cos_o, 1), fmin(-f->cos_i, 1), eta);
	}
	f->d = microfacet_d(m, f->h) * microfacet_g1_over_cos(m, wo);
	return f->d > 0;
}

/* Returns the cosine of wo to h times the solid angle of h over that of wi. */
static double facet_spread(const struct facet *f, bool reflect)
{
	if (reflect)
		return 0.25;
	double root = f->eta / f->length;
	return f->cos_o * -f->cos_i * root * root;
}

static vec3 mirror_if_below(vec3 v, bool below)
{
	return below ? (vec3){v.x, v.y, -v.z} : v;
}

/* Returns the Fresnel factor, with the reflectance or transmittance and the scaling of radiance. */
static spectrum fresnel_factor(const struct roughdielectric *r, const struct bsdf_point *p, const struct facet *f,
			       bool reflect, enum transport transport)
{
	if (reflect)
		return spectrum_scale(f->fresnel.reflectance,
				      texture_eval(&r->glass.reflectance, &p->texture_point, p->wavelengths));
	double scale = transport == TRANSPORT_RADIANCE ? 1 / (f->eta * f->eta) : 1;
	return spectrum_scale(f->fresnel.transmittance * scale,
			      texture_eval(&r->glass.transmittance, &p->texture_point, p->wavelengths));
}

/* Returns G1(wi) / |wi.z| for wi on either side. */
static double g1_over_cos(const struct microfacet *m, vec3 wi)
{
	return microfacet_g1_over_cos(m, (vec3){wi.x, wi.y, fabs(wi.z)});
}

static spectrum eval_facet(const struct roughdielectric *r, const struct microfacet *m, const struct bsdf_point *p,
			   const struct facet *f, vec3 wi)
{
	double common = f->d * g1_over_cos(m, wi) * facet_spread(f, wi.z > 0);
	return spectrum_scale(common, fresnel_factor(r, p, f, wi.z > 0, p->transport));
}

static double facet_pdf(const struct facet *f, vec3 wi)
{
	return f->d * facet_spread(f, wi.z > 0) * (wi.z > 0 ? f->fresnel.reflectance : f->fresnel.transmittance);
}

/* Calls find_facet() for directions on any side; mirrors *wi such that wo is on the side of the normal. */
static bool find_facet_on_any_side(const struct bsdf *b, const struct microfacet *m, const struct bsdf_point *p,
				   vec3 wo, vec3 *wi, struct facet *f)
{
	bool below = wo.z < 0;
	double eta = bsdf_eta(b, p->wavelengths);
	*wi = mirror_if_below(*wi, below);
	return wo.z != 0 && find_facet(m, below ? 1 / eta : eta, mirror_if_below(wo, below), *wi, f);
}

static spectrum roughdielectric_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughdielectric *r = b->data;
	struct microfacet m = rough_map_at(&r->roughness, p);
	struct facet f;
	return find_facet_on_any_side(b, &m, p, wo, &wi, &f) ? eval_facet(r, &m, p, &f, wi) : spectrum_constant(0);
}

/* The solid angle of h over that of wi has been cancelled with its inverse: they diverge or vanish as eta approaches
 * 1. */
static spectrum roughdielectric_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughdielectric *r = b->data;
	struct microfacet m = rough_map_at(&r->roughness, p);
	struct facet f;
	if (!find_facet_on_any_side(b, &m, p, wo, &wi, &f))
		return spectrum_constant(0);
	double common = f.d * f.h.z * f.h.z * f.h.z * f.cos_o * g1_over_cos(&m, wi) * fabs(wi.z);
	return spectrum_scale(common, fresnel_factor(r, p, &f, wi.z > 0, TRANSPORT_RADIANCE));
}

static double roughdielectric_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughdielectric *r = b->data;
	struct microfacet m = rough_map_at(&r->roughness, p);
	struct facet f;
	return find_facet_on_any_side(b, &m, p, wo, &wi, &f) ? facet_pdf(&f, wi) : 0;
}

static bool roughdielectric_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
				   struct bsdf_sample *out)
{
	const struct roughdielectric *r = b->data;
	bool below = wo.z < 0;
	if (wo.z == 0)
		return false;
	wo = mirror_if_below(wo, below);
	double ratio = bsdf_eta(b, p->wavelengths), eta = below ? 1 / ratio : ratio;
	struct microfacet m = rough_map_at(&r->roughness, p);
	vec3 h = microfacet_sample_visible(&m, wo, u[0], u[1]), wi;
	double c = fmin(vec3_dot(wo, h), 1);
	if (!(c > 0))
		return false;
	struct fresnel at_h = fresnel_dielectric(c, eta);
	bool reflect = u[2] < at_h.reflectance;
	if (reflect)
		wi = vec3_sub(vec3_scale(2 * c, h), wo);
	else
		wi = vec3_madd(vec3_scale(-1 / eta, wo), c / eta - at_h.cos_t, h);
	wi = vec3_normalize(wi);
	struct facet f;
	if (reflect != (wi.z > 0) || !find_facet(&m, eta, wo, wi, &f))
		return false;
	double pdf = facet_pdf(&f, wi);
	if (!(pdf > 0))
		return false;
	*out = (struct bsdf_sample){.wi = mirror_if_below(wi, below),
				    .mode = reflect ? BSDF_REFLECT : BSDF_TRANSMIT,
				    .pdf = pdf,
				    .f = eval_facet(r, &m, p, &f, wi),
				    .eta = reflect ? 1 : eta};
	return true;
}

static int roughdielectric_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
				  struct error *e)
{
	struct roughdielectric *r = b->data;
	int code = rough_map_read(&r->roughness, b, n, build, e);
	if (!code)
		code = glass_read(&r->glass, b, n, build, e);
	if (code)
		return code;
	b->modes = BSDF_REFLECT | BSDF_TRANSMIT;
	b->has_smooth = true;
	/* With equal indices no facet refracts: all light passes straight through. */
	if ((b->eta == 1 && !b->is_dispersive) || (!r->roughness.is_textured && b->min_alpha < build->min_roughness)) {
		extern const struct bsdf_ops bsdf_ops_dielectric;
		bsdf_make_specular(b, &bsdf_ops_dielectric);
	}
	return 0;
}

const struct bsdf_ops bsdf_ops_roughdielectric = {
	.decl = PLUGIN(BSDF, "roughdielectric", GLASS_PARAMS, ROUGH_MAP_PARAMS),
	.data_size = sizeof(struct roughdielectric),
	.create = roughdielectric_create,
	.eval = roughdielectric_eval,
	.pdf_solid = roughdielectric_pdf,
	.eval_halfvec = roughdielectric_eval_halfvec,
	.sample = roughdielectric_sample,
};
