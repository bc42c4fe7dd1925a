/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A clear layer over another opaque BSDF, as in Mitsuba 0.6: `coating` is smooth, `roughcoating` rough. Let w' be the
 * direction to which w is refracted (with n = h), T the transmittance of the boundary, eta the layer's index over the
 * one outside, and a the transmittance of the absorbing layer, exp(-sigma_a thickness (1 / |cos wo'| + 1 / |cos wi'|)),
 *
 *   f = boundary's reflection + T(wo) T(wi) a / eta^2 f_inner(wo', wi')
 *
 * Light that the boundary reflects back into the layer is lost, unlike in `plastic`. The specular lobes of the boundary
 * and of the inner BSDF have the same direction and are treated as one lobe. The layer is two-sided if the inner BSDF
 * is.
 *
 * Creation fails if the inner BSDF transmits light. A sample fails if that of the inner BSDF fails, or if its direction
 * cannot leave the layer because of total reflection.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ior.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/rough_boundary.h"

#include <float.h>

struct coat {
	struct bsdf inner;
	struct texture specular;
	struct texture absorption; /* sigma_a */
	double thickness, eta, specular_max;
	struct rough_boundary boundary;
	struct rough_boundary *rough; /* points to `boundary`; NULL: the layer is smooth */
};

/* The layer at a point. */
struct layer {
	const struct coat *c;
	struct boundary_point boundary;
};
/* A direction inside the layer, and the share of the light that the boundary transmits to it. */
struct passage {
	vec3 inside;
	double transmitted;
};

static struct layer layer_at(const struct bsdf *b, const struct bsdf_point *p)
{
	struct layer l = {.c = b->data};
	if (l.c->rough)
		l.boundary = rough_boundary_at(l.c->rough, p);
	return l;
}

static vec3 facing_up(vec3 v)
{
	return (vec3){v.x, v.y, fabs(v.z)};
}

static double transmitted_at(const struct layer *l, double cosine)
{
	return l->c->rough ? boundary_transmitted(&l->boundary, cosine)
			   : fresnel_dielectric(fmin(cosine, 1), l->c->eta).transmitted;
}

/* Returns false if no light enters the layer from w. */
static bool refract_into(const struct layer *l, vec3 w, struct passage *out)
{
	struct fresnel f = fresnel_dielectric(fmin(fabs(w.z), 1), l->c->eta);
	if (!(f.transmitted > 0 && f.cos_t > 0))
		return false;
	out->transmitted = transmitted_at(l, fabs(w.z));
	out->inside = vec3_normalize((vec3){w.x / l->c->eta, w.y / l->c->eta, copysign(f.cos_t, w.z)});
	return out->inside.z != 0;
}

static spectrum absorbed_by(const struct coat *c, const struct bsdf_point *p, vec3 a, vec3 b)
{
	double way = c->thickness * (1 / fabs(a.z) + 1 / fabs(b.z));
	if (!(c->thickness > 0) || texture_max(&c->absorption) == 0)
		return spectrum_of(1);
	spectrum s = texture_eval(&c->absorption, &p->where, p->w);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		s.v[i] = s.v[i] > 0 ? exp(-fmin(s.v[i] * way, 800)) : 1;
	return s;
}

/* Returns whether wo and wi are on the same side of the surface, and light is scattered on that side. */
static bool is_same_side(const struct bsdf *b, vec3 wo, vec3 wi)
{
	return wo.z * wi.z > 0 && (wo.z > 0 || b->two_sided);
}

static spectrum coat_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!is_same_side(b, wo, wi))
		return spectrum_of(0);
	struct layer l = layer_at(b, p);
	const struct coat *c = l.c;
	spectrum f = spectrum_of(0);
	struct passage o, i;
	double pdf;
	if (c->rough)
		f = spectrum_scale(boundary_reflect(&l.boundary, facing_up(wo), facing_up(wi), &pdf),
				   texture_eval(&c->specular, &p->where, p->w));
	if (!c->inner.has_smooth || !refract_into(&l, wo, &o) || !refract_into(&l, wi, &i))
		return f;
	spectrum below = spectrum_mul(c->inner.ops->eval(&c->inner, p, o.inside, i.inside),
				      absorbed_by(c, p, o.inside, i.inside));
	return spectrum_add(f, spectrum_scale(o.transmitted * i.transmitted / (c->eta * c->eta), below));
}

/* Returns the probability of sampling the boundary's own reflection. */
static double boundary_chance(const struct layer *l, vec3 wo)
{
	double t = transmitted_at(l, fabs(wo.z)), r = (1 - t) * l->c->specular_max;
	return r + t > 0 ? r / (r + t) : 0;
}

static double coat_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!is_same_side(b, wo, wi))
		return 0;
	struct layer l = layer_at(b, p);
	const struct coat *c = l.c;
	struct passage o, i;
	double chance = boundary_chance(&l, wo), lobe = 0, below = 0;
	if (c->rough)
		boundary_reflect(&l.boundary, facing_up(wo), facing_up(wi), &lobe);
	if (c->inner.has_smooth && refract_into(&l, wo, &o) && refract_into(&l, wi, &i))
		below = c->inner.ops->pdf_solid(&c->inner, p, o.inside, i.inside) *
			(wi.z / i.inside.z / (c->eta * c->eta));
	return chance * lobe + (1 - chance) * below;
}

static spectrum coat_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				double *chance)
{
	struct layer l = layer_at(b, p);
	const struct coat *c = l.c;
	struct passage o;
	vec3 unused;
	spectrum f = spectrum_of(0);
	double one, all = 0;
	if (!(mode & BSDF_REFLECT) || !(fabs(wo.z) >= DBL_MIN) || (wo.z < 0 && !b->two_sided))
		return f;
	double first = boundary_chance(&l, wo);
	*wi = (vec3){-wo.x, -wo.y, wo.z};
	if (!c->rough) {
		all = first;
		f = spectrum_scale(1 - transmitted_at(&l, fabs(wo.z)), texture_eval(&c->specular, &p->where, p->w));
	}
	if (c->inner.has_delta && refract_into(&l, wo, &o)) {
		spectrum below = bsdf_eval_delta(&c->inner, p, o.inside, BSDF_REFLECT, &unused, &one);
		if (!spectrum_is_zero(below)) {
			all += (1 - first) * one;
			below = spectrum_mul(below, absorbed_by(c, p, o.inside, o.inside));
			f = spectrum_add(f, spectrum_scale(o.transmitted * o.transmitted, below));
		}
	}
	*chance = all;
	return f;
}

/* Refracts a direction out of the layer. Returns false at total reflection. */
static bool refract_out(const struct coat *c, vec3 inside, vec3 *out)
{
	double x = c->eta * inside.x, y = c->eta * inside.y, cos2 = 1 - x * x - y * y;
	if (!(cos2 > 0))
		return false;
	*out = vec3_normalize((vec3){x, y, copysign(sqrt(cos2), inside.z)});
	return out->z != 0;
}

/* Samples the direction wi of a lobe that is not specular. Returns false if the sample is specular (*delta is set), or
 * absorbed. */
static bool sample_lobe(const struct bsdf *b, const struct layer *l, const struct bsdf_point *p, vec3 wo,
			const double u[3], bool *delta, vec3 *wi)
{
	const struct coat *c = l->c;
	struct bsdf_sample inner;
	struct passage o;
	double chance = boundary_chance(l, wo);
	*delta = false;
	if (u[2] < chance) {
		*delta = !c->rough;
		if (*delta)
			return false;
		*wi = microfacet_sample_mirrored(&l->boundary.facets, facing_up(wo), u[0], u[1]);
		wi->z = copysign(1, wo.z) * wi->z;
		return is_same_side(b, wo, *wi);
	}
	const double rest[3] = {u[0], u[1], fmin((u[2] - chance) / (1 - chance), 1 - 0x1p-53)};
	if (!refract_into(l, wo, &o) || !c->inner.ops->sample(&c->inner, p, o.inside, rest, &inner))
		return false;
	*delta = inner.mode & BSDF_DELTA;
	return !*delta && refract_out(c, inner.wi, wi) && is_same_side(b, wo, *wi);
}

static bool coat_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	bool delta;
	vec3 wi;
	if (!is_same_side(b, wo, wo))
		return false;
	struct layer l = layer_at(b, p);
	if (sample_lobe(b, &l, p, wo, u, &delta, &wi))
		return bsdf_sample_smooth(b, p, wo, wi, out);
	return delta && bsdf_sample_delta(b, p, wo, BSDF_REFLECT, out) && !spectrum_is_zero(out->f);
}

static int read_inner(struct coat *c, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		      struct error *e)
{
	const struct scene_node *inner = node_child(n, PLUGIN_BSDF, 0);
	if (!inner || node_child(n, PLUGIN_BSDF, 1))
		return node_error(n, e, EINVAL, "needs exactly one BSDF inside");
	int code = bsdf_create(&c->inner, inner, build, e);
	if (!code && (c->inner.modes & BSDF_TRANSMIT))
		code = node_error(n, e, ENOTSUP, "a coating over \"%s\", which transmits light, is not supported",
				  inner->type);
	if (code)
		return code;
	b->relief = c->inner.relief;
	b->uses_place = c->inner.uses_place;
	b->modes = BSDF_REFLECT | c->inner.modes;
	b->has_smooth = c->inner.has_smooth;
	b->has_delta = c->inner.has_delta;
	b->two_sided = c->inner.two_sided;
	b->textured |= c->inner.textured;
	b->uses_tangents = c->inner.uses_tangents;
	b->directed = c->inner.directed;
	b->alpha = c->inner.has_smooth ? c->inner.alpha : INFINITY;
	b->alpha_mean = c->inner.alpha_mean;
	bsdf_add_shape(b, c->inner.shape);
	return 0;
}

static int read_absorption(struct coat *c, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			   struct error *e)
{
	c->thickness = node_float(n, "thickness", 1);
	return bsdf_quantity(b, &c->absorption, n, "sigma_a", 0, false, build, e);
}

static int read_layer(struct coat *c, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		      struct error *e)
{
	double inside, outside;
	int code = ior_read(n, "int_ior", IOR_BK7_DEFAULT, &inside, e);
	if (!code)
		code = ior_read(n, "ext_ior", IOR_AIR_DEFAULT, &outside, e);
	if (!code)
		code = bsdf_texture(b, &c->specular, n, "specular_reflectance", 1, build, e);
	if (!code)
		code = read_absorption(c, b, n, build, e);
	if (code)
		return code;
	c->eta = inside / outside;
	c->specular_max = texture_max(&c->specular);
	return 0;
}

static int coating_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct coat *c = b->data;
	int code = read_inner(c, b, n, build, e);
	if (!code)
		code = read_layer(c, b, n, build, e);
	b->modes |= BSDF_DELTA;
	b->has_delta = true;
	if (!b->has_smooth)
		b->alpha = b->alpha_mean = 0;
	return code;
}

static int roughcoating_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			       struct error *e)
{
	struct coat *c = b->data;
	c->rough = &c->boundary;
	int code = read_inner(c, b, n, build, e);
	double alpha = b->alpha, mean = b->alpha_mean;
	if (!code)
		code = read_layer(c, b, n, build, e);
	if (!code)
		code = rough_boundary_read(c->rough, c->eta, b, n, build, e); /* overwrites b->alpha */
	if (code)
		return code;
	b->alpha = fmin(b->alpha, alpha);
	b->alpha_mean = c->inner.has_smooth ? mean : b->alpha_mean; /* most light comes from below */
	b->has_smooth = true;
	return 0;
}

#define COAT_PARAMS                                                                           \
	IOR_NUMBER("int_ior"), IOR_NUMBER("ext_ior"),                                         \
		{.name = "specular_reflectance", .types = VALUE_TEXTURE, .min = 0, .max = 1}, \
		{.name = "sigma_a", .types = VALUE_TEXTURE, .min = 0, .max = 1e9},            \
	{                                                                                     \
		.name = "thickness", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1e9   \
	}
#define COAT_OPS(NAME, ...)                                                                                          \
	const struct bsdf_ops bsdf_ops_##NAME = {                                                                    \
		.decl = {PLUGIN_BSDF, #NAME, PARAMS(COAT_PARAMS, __VA_ARGS__), 1u << PLUGIN_BSDF, PARAM_UNDERSTOOD}, \
		.data_size = sizeof(struct coat),                                                                    \
		.create = NAME##_create,                                                                             \
		.eval = coat_eval,                                                                                   \
		.pdf_solid = coat_pdf,                                                                               \
		.eval_delta = coat_eval_delta,                                                                       \
		.sample = coat_sample,                                                                               \
	}
COAT_OPS(coating, MICROFACET_PARAMS_IGNORED);
COAT_OPS(roughcoating, ROUGH_BOUNDARY_PARAMS);
