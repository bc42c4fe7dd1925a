/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The thin form of `principled`: a sheet without thickness, the same on both sides (Burley 2015, section 5.3), with the
 * parameters and defaults of Mitsuba 3's plug-in. With t = spec_trans, d = diff_trans / 2 and c = base_color,
 *
 *   reflected     t D G1 G1 F / 4 + (1 - t) (1 - d) (diffuse + sheen)
 *   transmitted   t c D' G1' G1' (1 - F) / 4 + (1 - t) d c / pi
 *
 * where transmitted light is modelled as reflected light mirrored to the other side, with facets D' whose roughness is
 * multiplied by 0.65 eta - 0.35. Light is not refracted: both sides have the same index.
 *
 * Creation fails if `diff_trans` is outside [0, 2] or `eta` outside [1, 10]. A sample fails if the facet's direction is
 * on the wrong side.
 */
#include "worker/render/bsdf/principled.h"

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/warp.h"

#include <string.h>

enum { THIN_REFLECT, THIN_TRANSMIT, THIN_DIFFUSE_REFLECT, THIN_DIFFUSE_TRANSMIT, THIN_LOBES };

#define THIN_ETA_MIN 1
#define THIN_ETA_MAX 10

struct thin {
	struct principled p;
	struct texture diff_trans;  /* without ops: the constant `diffuse_transmitted` is used instead */
	double diffuse_transmitted; /* d of the comment at the top */
	struct texture eta;	    /* without ops: the constant p.eta is used instead */
};

static double eval_diffuse_transmitted(const struct thin *t, const struct bsdf_point *p)
{
	return 0.5 * fmin(fmax(spectrum_mean(texture_eval(&t->diff_trans, &p->texture_point, p->wavelengths)), 0), 2);
}

static double eval_eta(const struct thin *t, const struct bsdf_point *p)
{
	return fmin(fmax(spectrum_mean(texture_eval(&t->eta, &p->texture_point, p->wavelengths)), THIN_ETA_MIN),
		    THIN_ETA_MAX);
}

static double transmit_roughness(double eta, double roughness)
{
	return (0.65 * eta - 0.35) * roughness;
}

/* A point of the surface, and the parameters for a direction from it, whose side counts as the upper one. */
struct thin_point {
	const struct thin *t;
	struct principled_point s;
	double spec_trans, diffuse_transmitted; /* t and d of the comment at the top */
	struct microfacet transmit_facets;	/* D' */
	double lobe_probability[THIN_LOBES];	/* probability of sampling each lobe */
};

static void compute_lobe_probabilities(struct thin_point *x, double cosine)
{
	const struct thin *t = x->t;
	double base = t->p.max_base, diffuse = 1 - x->spec_trans, sum = 0;
	double reflected = fresnel_dielectric(min_of(cosine, 1), x->s.eta).reflectance;
	/* Facets reflect a different share than the plane of the surface, so neither lobe may have a probability of
	 * 0. */
	x->lobe_probability[THIN_REFLECT] = x->spec_trans * (0.25 + 0.5 * reflected);
	x->lobe_probability[THIN_TRANSMIT] = x->spec_trans * base * (0.75 - 0.5 * reflected);
	x->lobe_probability[THIN_DIFFUSE_REFLECT] =
		diffuse * (1 - x->diffuse_transmitted) * fmax(base, 0.2 * x->s.share[PRINCIPLED_SHEEN]);
	x->lobe_probability[THIN_DIFFUSE_TRANSMIT] = diffuse * x->diffuse_transmitted * base;
	for (int i = 0; i < THIN_LOBES; i++)
		sum += x->lobe_probability[i];
	for (int i = 0; i < THIN_LOBES; i++)
		x->lobe_probability[i] = sum > 0 ? x->lobe_probability[i] / sum : 0;
}

static struct thin_point thin_point_at(const struct bsdf *b, const struct bsdf_point *p, vec3 wo)
{
	const struct thin *t = b->data;
	struct thin_point x = {.t = t, .s = principled_point_at(&t->p, p)};
	x.diffuse_transmitted = t->diff_trans.ops ? eval_diffuse_transmitted(t, p) : t->diffuse_transmitted;
	if (t->eta.ops)
		x.s.eta = eval_eta(t, p);
	/* principled_eval_diffuse must not multiply by 1 - spec_trans: evaluate does. */
	x.spec_trans = x.s.share[PRINCIPLED_TRANSMISSION];
	x.s.share[PRINCIPLED_TRANSMISSION] = 0;
	x.transmit_facets =
		principled_facets(x.s.share[PRINCIPLED_ANISOTROPIC], transmit_roughness(x.s.eta, x.s.roughness));
	compute_lobe_probabilities(&x, fabs(wo.z));
	return x;
}

static vec3 facing_up(vec3 v)
{
	return (vec3){v.x, v.y, fabs(v.z)};
}

/* The value and the density for a pair of directions. */
struct evaluation {
	spectrum f;
	double pdf;
};

static struct evaluation evaluate(const struct thin_point *x, vec3 wo, vec3 wi)
{
	struct evaluation out = {spectrum_constant(0), 0};
	bool reflect = wo.z * wi.z > 0;
	const struct microfacet *m = reflect ? &x->s.facets : &x->transmit_facets;
	vec3 h, o = facing_up(wo), i = facing_up(wi);
	double length;
	if (!(o.z > 0 && i.z > 0) || !microfacet_half_vector(o, 1, i, &h, &length))
		return out;
	double cosine = min_of(0.5 * length, 1), facet_pdf = 0.25 * microfacet_d(m, h) * microfacet_g1_over_cos(m, o),
	       both = x->spec_trans * facet_pdf * microfacet_g1_over_cos(m, i), diffuse = 1 - x->spec_trans;
	if (reflect) {
		spectrum boundary = principled_boundary_fresnel(&x->s, cosine),
			 d = principled_eval_diffuse(&x->s, boundary, o, i, cosine);
		out.f = spectrum_add(spectrum_scale(both, principled_fresnel(&x->s, boundary, cosine)),
				     spectrum_scale(diffuse * (1 - x->diffuse_transmitted), d));
		out.pdf = x->lobe_probability[THIN_REFLECT] * facet_pdf +
			  x->lobe_probability[THIN_DIFFUSE_REFLECT] * i.z / WARP_PI;
	} else {
		double passes = both * fresnel_dielectric(cosine, x->s.eta).transmittance;
		out.f = spectrum_scale(passes + diffuse * x->diffuse_transmitted / WARP_PI, x->s.base);
		out.pdf = x->lobe_probability[THIN_TRANSMIT] * facet_pdf +
			  x->lobe_probability[THIN_DIFFUSE_TRANSMIT] * i.z / WARP_PI;
	}
	return out;
}

static spectrum thin_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct thin_point x = thin_point_at(b, p, wo);
	return evaluate(&x, wo, wi).f;
}

static double thin_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct thin_point x = thin_point_at(b, p, wo);
	return evaluate(&x, wo, wi).pdf;
}

static bool thin_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	struct thin_point x = thin_point_at(b, p, wo);
	vec3 o = facing_up(wo), wi;
	double rest = u[2];
	int lobe = 0;
	if (wo.z == 0)
		return false;
	while (lobe < THIN_LOBES - 1 && rest >= x.lobe_probability[lobe])
		rest -= x.lobe_probability[lobe++];
	if (!(x.lobe_probability[lobe] > 0))
		return false;
	if (lobe == THIN_DIFFUSE_REFLECT || lobe == THIN_DIFFUSE_TRANSMIT) {
		wi = warp_cosine_hemisphere(u[0], u[1]);
	} else {
		wi = microfacet_sample_mirrored(lobe == THIN_REFLECT ? &x.s.facets : &x.transmit_facets, o, u[0], u[1]);
	}
	bool transmits = lobe == THIN_TRANSMIT || lobe == THIN_DIFFUSE_TRANSMIT;
	if (!(wi.z > 0))
		return false;
	wi.z = (wo.z > 0) == transmits ? -wi.z : wi.z;
	struct evaluation evaluation = evaluate(&x, wo, wi);
	*out = (struct bsdf_sample){.wi = wi,
				    .mode = transmits ? BSDF_TRANSMIT : BSDF_REFLECT,
				    .pdf = evaluation.pdf,
				    .f = evaluation.f,
				    .eta = 1};
	return evaluation.pdf > 0;
}

/* The values of textures are limited to 1, except those of a checkerboard, which may go up to 2 like the parameter
 * itself. */
static int read_diffuse_transmitted(struct bsdf *b, struct thin *t, const struct scene_node *n,
				    const struct bsdf_build *build, struct error *e)
{
	const struct scene_node *texture = node_ref(n, "diff_trans");
	t->diffuse_transmitted = 0.5 * node_float(n, "diff_trans", 0);
	if (!texture)
		return 0;
	if (strcmp(texture->type, "checkerboard") != 0)
		return bsdf_read_number(b, &t->diff_trans, n, "diff_trans", 0, build, e);
	int code = bsdf_read_quantity(b, &t->diff_trans, n, "diff_trans", 0, true, build, e);
	if (code)
		return code;
	double max_value = texture_max(&t->diff_trans);
	return max_value <= 2 ? 0 : node_error(n, e, ERANGE, "diff_trans=%g is outside [0, 2]", max_value);
}

/* Reads eta. p.eta becomes the smallest index, at which transmission is sharpest. */
static int read_index(struct bsdf *b, struct thin *t, const struct scene_node *n, const struct bsdf_build *build,
		      struct error *e)
{
	if (!node_ref(n, "eta")) {
		t->p.eta = node_float(n, "eta", 1.5);
		return 0;
	}
	int code = bsdf_read_quantity(b, &t->eta, n, "eta", 0, true, build, e);
	if (code)
		return code;
	const struct bsdf_range r = bsdf_probe_range(&t->eta, build);
	if (!(r.min >= THIN_ETA_MIN && texture_max(&t->eta) <= THIN_ETA_MAX))
		return node_error(n, e, ERANGE, "eta=%g is outside [%d, %d]",
				  r.min >= THIN_ETA_MIN ? texture_max(&t->eta) : r.min, THIN_ETA_MIN, THIN_ETA_MAX);
	t->p.eta = r.min;
	return 0;
}

static int thin_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct thin *t = b->data;
	struct principled *p = &t->p;
	int code = bsdf_read_texture(b, &p->base, n, "base_color", 0.5, build, e);
	if (!code)
		code = bsdf_read_number(b, &p->roughness, n, "roughness", 0.5, build, e);
	if (!code)
		code = principled_read_shares(p, b, n, build, e);
	if (!code)
		code = read_diffuse_transmitted(b, t, n, build, e);
	if (!code)
		code = read_index(b, t, n, build, e);
	if (code)
		return code;
	p->metallic = (struct texture){.color = color_constant(0)};
	p->max_base = texture_max(&p->base);
	principled_precompute(p, build);
	double spec_trans = p->max_share[PRINCIPLED_TRANSMISSION];
	double min_roughness = principled_min_value(&p->roughness, build);
	struct microfacet reflect_facets = principled_facets(p->max_share[PRINCIPLED_ANISOTROPIC], min_roughness),
			  transmit_facets = principled_facets(p->max_share[PRINCIPLED_ANISOTROPIC],
							      transmit_roughness(p->eta, min_roughness));
	b->modes =
		BSDF_REFLECT | (spec_trans > 0 || t->diff_trans.ops || t->diffuse_transmitted > 0 ? BSDF_TRANSMIT : 0);
	b->has_smooth = true;
	b->is_two_sided = true;
	b->min_alpha = spec_trans > 0
			       ? fmin(microfacet_min_alpha(&reflect_facets), microfacet_min_alpha(&transmit_facets))
			       : INFINITY;
	b->mean_alpha = 1 - spec_trans + spec_trans * microfacet_mean_alpha(&reflect_facets);
	return 0;
}

const struct bsdf_ops bsdf_ops_principledthin = {
	.decl = PLUGIN(BSDF, "principledthin", {.name = "base_color", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		       {.name = "roughness", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		       PRINCIPLED_SHARE("anisotropic"), PRINCIPLED_SHARE("spec_trans"), PRINCIPLED_SHARE("spec_tint"),
		       PRINCIPLED_SHARE("sheen"), PRINCIPLED_SHARE("sheen_tint"), PRINCIPLED_SHARE("flatness"),
		       {.name = "diff_trans", .types = VALUE_FLOAT | VALUE_INT | VALUE_NODE, .min = 0, .max = 2},
		       {.name = "eta",
			.types = VALUE_FLOAT | VALUE_INT | VALUE_NODE,
			.min = THIN_ETA_MIN,
			.max = THIN_ETA_MAX},
		       {.name = "diffuse_reflectance_sampling_rate",
			.types = VALUE_FLOAT | VALUE_INT,
			.status = PARAM_IGNORED},
		       {.name = "specular_reflectance_sampling_rate",
			.types = VALUE_FLOAT | VALUE_INT,
			.status = PARAM_IGNORED},
		       {.name = "specular_transmittance_sampling_rate",
			.types = VALUE_FLOAT | VALUE_INT,
			.status = PARAM_IGNORED},
		       {.name = "diffuse_transmittance_sampling_rate",
			.types = VALUE_FLOAT | VALUE_INT,
			.status = PARAM_IGNORED}),
	.data_size = sizeof(struct thin),
	.create = thin_create,
	.eval = thin_eval,
	.pdf_solid = thin_pdf,
	.sample = thin_sample,
};
