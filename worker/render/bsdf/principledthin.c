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

enum { THIN_REFLECT, THIN_TRANSMIT, THIN_DIFFUSE, THIN_THROUGH, THIN_LOBES };

#define THIN_ETA_MIN 1
#define THIN_ETA_MAX 10

struct thin {
	struct principled p;
	struct texture diff_trans; /* without ops: the constant `through` is used instead */
	double through;		   /* d of the comment at the top */
	struct texture eta;	   /* without ops: the constant p.eta is used instead */
};

static double through_at(const struct thin *t, const struct bsdf_point *p)
{
	return 0.5 * fmin(fmax(spectrum_mean(texture_eval(&t->diff_trans, &p->where, p->w)), 0), 2);
}

static double eta_at(const struct thin *t, const struct bsdf_point *p)
{
	return fmin(fmax(spectrum_mean(texture_eval(&t->eta, &p->where, p->w)), THIN_ETA_MIN), THIN_ETA_MAX);
}

static double passing_roughness(double eta, double roughness)
{
	return (0.65 * eta - 0.35) * roughness;
}

/* A point of the surface, and the parameters for a direction from it, whose side counts as the upper one. */
struct thin_point {
	const struct thin *t;
	struct principled_point s;
	double spec_trans, through; /* t and d of the comment at the top */
	struct microfacet passing;  /* D' */
	double chance[THIN_LOBES];  /* probability of sampling each lobe */
};

static void find_chances(struct thin_point *x, double cosine)
{
	const struct thin *t = x->t;
	double base = t->p.base_max, diffuse = 1 - x->spec_trans, sum = 0;
	double reflected = fresnel_dielectric(min_of(cosine, 1), x->s.eta).reflected;
	/* Facets reflect a different share than the plane of the surface, so neither lobe may have a probability of
	 * 0. */
	x->chance[THIN_REFLECT] = x->spec_trans * (0.25 + 0.5 * reflected);
	x->chance[THIN_TRANSMIT] = x->spec_trans * base * (0.75 - 0.5 * reflected);
	x->chance[THIN_DIFFUSE] = diffuse * (1 - x->through) * fmax(base, 0.2 * x->s.share[SHEEN]);
	x->chance[THIN_THROUGH] = diffuse * x->through * base;
	for (int i = 0; i < THIN_LOBES; i++)
		sum += x->chance[i];
	for (int i = 0; i < THIN_LOBES; i++)
		x->chance[i] = sum > 0 ? x->chance[i] / sum : 0;
}

static struct thin_point thin_at(const struct bsdf *b, const struct bsdf_point *p, vec3 wo)
{
	const struct thin *t = b->data;
	struct thin_point x = {.t = t, .s = principled_at(&t->p, p)};
	x.through = t->diff_trans.ops ? through_at(t, p) : t->through;
	if (t->eta.ops)
		x.s.eta = eta_at(t, p);
	/* principled_diffuse must not multiply by 1 - spec_trans: pair_of does. */
	x.spec_trans = x.s.share[TRANSMISSION];
	x.s.share[TRANSMISSION] = 0;
	x.passing = principled_facets(x.s.share[ANISOTROPIC], passing_roughness(x.s.eta, x.s.roughness));
	find_chances(&x, fabs(wo.z));
	return x;
}

static vec3 facing_up(vec3 v)
{
	return (vec3){v.x, v.y, fabs(v.z)};
}

/* The value and the density for a pair of directions. */
struct pair {
	spectrum f;
	double pdf;
};

static struct pair pair_of(const struct thin_point *x, vec3 wo, vec3 wi)
{
	struct pair out = {spectrum_of(0), 0};
	bool reflect = wo.z * wi.z > 0;
	const struct microfacet *m = reflect ? &x->s.facets : &x->passing;
	vec3 h, o = facing_up(wo), i = facing_up(wi);
	double length;
	if (!(o.z > 0 && i.z > 0) || !microfacet_half(o, 1, i, &h, &length))
		return out;
	double cosine = min_of(0.5 * length, 1), seen = 0.25 * microfacet_d(m, h) * microfacet_g1_over_cos(m, o),
	       both = x->spec_trans * seen * microfacet_g1_over_cos(m, i), diffuse = 1 - x->spec_trans;
	if (reflect) {
		spectrum boundary = principled_boundary(&x->s, cosine),
			 d = principled_diffuse(&x->s, boundary, o, i, cosine);
		out.f = spectrum_add(spectrum_scale(both, principled_fresnel(&x->s, boundary, cosine)),
				     spectrum_scale(diffuse * (1 - x->through), d));
		out.pdf = x->chance[THIN_REFLECT] * seen + x->chance[THIN_DIFFUSE] * i.z / WARP_PI;
	} else {
		double passes = both * fresnel_dielectric(cosine, x->s.eta).transmitted;
		out.f = spectrum_scale(passes + diffuse * x->through / WARP_PI, x->s.base);
		out.pdf = x->chance[THIN_TRANSMIT] * seen + x->chance[THIN_THROUGH] * i.z / WARP_PI;
	}
	return out;
}

static spectrum thin_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct thin_point x = thin_at(b, p, wo);
	return pair_of(&x, wo, wi).f;
}

static double thin_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct thin_point x = thin_at(b, p, wo);
	return pair_of(&x, wo, wi).pdf;
}

static bool thin_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	struct thin_point x = thin_at(b, p, wo);
	vec3 o = facing_up(wo), wi;
	double rest = u[2];
	int lobe = 0;
	if (wo.z == 0)
		return false;
	while (lobe < THIN_LOBES - 1 && rest >= x.chance[lobe])
		rest -= x.chance[lobe++];
	if (!(x.chance[lobe] > 0))
		return false;
	if (lobe == THIN_DIFFUSE || lobe == THIN_THROUGH) {
		wi = warp_cosine_hemisphere(u[0], u[1]);
	} else {
		wi = microfacet_sample_mirrored(lobe == THIN_REFLECT ? &x.s.facets : &x.passing, o, u[0], u[1]);
	}
	bool through = lobe == THIN_TRANSMIT || lobe == THIN_THROUGH;
	if (!(wi.z > 0))
		return false;
	wi.z = (wo.z > 0) == through ? -wi.z : wi.z;
	struct pair pair = pair_of(&x, wo, wi);
	*out = (struct bsdf_sample){
		.wi = wi, .mode = through ? BSDF_TRANSMIT : BSDF_REFLECT, .pdf = pair.pdf, .f = pair.f, .eta = 1};
	return pair.pdf > 0;
}

/* The values of textures are limited to 1, except those of a checkerboard, which may go up to 2 like the parameter
 * itself. */
static int read_through(struct bsdf *b, struct thin *t, const struct scene_node *n, const struct bsdf_build *build,
			struct error *e)
{
	const struct scene_node *texture = node_ref(n, "diff_trans");
	t->through = 0.5 * node_float(n, "diff_trans", 0);
	if (!texture)
		return 0;
	if (strcmp(texture->type, "checkerboard") != 0)
		return bsdf_number(b, &t->diff_trans, n, "diff_trans", 0, build, e);
	int code = bsdf_quantity(b, &t->diff_trans, n, "diff_trans", 0, true, build, e);
	if (code)
		return code;
	double most = texture_max(&t->diff_trans);
	return most <= 2 ? 0 : node_error(n, e, ERANGE, "diff_trans=%g is outside [0, 2]", most);
}

/* Reads eta. p.eta becomes the smallest index, at which transmission is sharpest. */
static int read_index(struct bsdf *b, struct thin *t, const struct scene_node *n, const struct bsdf_build *build,
		      struct error *e)
{
	if (!node_ref(n, "eta")) {
		t->p.eta = node_float(n, "eta", 1.5);
		return 0;
	}
	int code = bsdf_quantity(b, &t->eta, n, "eta", 0, true, build, e);
	if (code)
		return code;
	const struct bsdf_range r = bsdf_probe_range(&t->eta, build);
	if (!(r.least >= THIN_ETA_MIN && texture_max(&t->eta) <= THIN_ETA_MAX))
		return node_error(n, e, ERANGE, "eta=%g is outside [%d, %d]",
				  r.least >= THIN_ETA_MIN ? texture_max(&t->eta) : r.least, THIN_ETA_MIN, THIN_ETA_MAX);
	t->p.eta = r.least;
	return 0;
}

static int thin_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct thin *t = b->data;
	struct principled *p = &t->p;
	int code = bsdf_texture(b, &p->base, n, "base_color", 0.5, build, e);
	if (!code)
		code = bsdf_number(b, &p->roughness, n, "roughness", 0.5, build, e);
	if (!code)
		code = principled_shares(p, b, n, build, e);
	if (!code)
		code = read_through(b, t, n, build, e);
	if (!code)
		code = read_index(b, t, n, build, e);
	if (code)
		return code;
	p->metallic = (struct texture){.color = color_constant(0)};
	p->base_max = texture_max(&p->base);
	principled_know(p, build);
	double spec_trans = p->most[TRANSMISSION];
	double rough = principled_least(&p->roughness, build);
	struct microfacet facets = principled_facets(p->most[ANISOTROPIC], rough),
			  passing = principled_facets(p->most[ANISOTROPIC], passing_roughness(p->eta, rough));
	b->modes = BSDF_REFLECT | (spec_trans > 0 || t->diff_trans.ops || t->through > 0 ? BSDF_TRANSMIT : 0);
	b->has_smooth = true;
	b->two_sided = true;
	b->alpha = spec_trans > 0 ? fmin(microfacet_least(&facets), microfacet_least(&passing)) : INFINITY;
	b->alpha_mean = 1 - spec_trans + spec_trans * microfacet_mean(&facets);
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
