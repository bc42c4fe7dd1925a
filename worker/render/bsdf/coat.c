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
	double thickness, eta, max_specular;
	struct rough_boundary boundary;
	struct rough_boundary *rough; /* points to `boundary`; NULL: the layer is smooth */
};

/* The layer at a point. */
struct layer {
	const struct coat *c;
	struct boundary_point boundary;
};
/* A direction inside the layer, and the share of the light that the boundary transmits to it. */
struct refracted_ray {
	vec3 direction;
	double transmittance;
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

static double boundary_transmittance(const struct layer *l, double cosine)
{
	return l->c->rough ? rough_boundary_transmittance(&l->boundary, cosine)
			   : fresnel_dielectric(fmin(cosine, 1), l->c->eta).transmittance;
}

/* Returns false if no light enters the layer from w. */
static bool refract_into(const struct layer *l, vec3 w, struct refracted_ray *out)
{
	struct fresnel f = fresnel_dielectric(fmin(fabs(w.z), 1), l->c->eta);
	if (!(f.transmittance > 0 && f.cos_t > 0))
		return false;
	out->transmittance = boundary_transmittance(l, fabs(w.z));
	out->direction = vec3_normalize((vec3){w.x / l->c->eta, w.y / l->c->eta, copysign(f.cos_t, w.z)});
	return out->direction.z != 0;
}

static spectrum absorption_transmittance(const struct coat *c, const struct bsdf_point *p, vec3 a, vec3 b)
{
	double path_length = c->thickness * (1 / fabs(a.z) + 1 / fabs(b.z));
	if (!(c->thickness > 0) || texture_max(&c->absorption) == 0)
		return spectrum_constant(1);
	spectrum s = texture_eval(&c->absorption, &p->texture_point, p->wavelengths);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		s.v[i] = s.v[i] > 0 ? exp(-fmin(s.v[i] * path_length, 800)) : 1;
	return s;
}

/* Returns whether wo and wi are on the same side of the surface, and light is scattered on that side. */
static bool scatters_between(const struct bsdf *b, vec3 wo, vec3 wi)
{
	return wo.z * wi.z > 0 && (wo.z > 0 || b->is_two_sided);
}

static spectrum coat_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!scatters_between(b, wo, wi))
		return spectrum_constant(0);
	struct layer l = layer_at(b, p);
	const struct coat *c = l.c;
	spectrum f = spectrum_constant(0);
	struct refracted_ray o, i;
	double pdf;
	if (c->rough)
		f = spectrum_scale(rough_boundary_reflect(&l.boundary, facing_up(wo), facing_up(wi), &pdf),
				   texture_eval(&c->specular, &p->texture_point, p->wavelengths));
	if (!c->inner.has_smooth || !refract_into(&l, wo, &o) || !refract_into(&l, wi, &i))
		return f;
	spectrum below = spectrum_mul(c->inner.ops->eval(&c->inner, p, o.direction, i.direction),
				      absorption_transmittance(c, p, o.direction, i.direction));
	return spectrum_add(f, spectrum_scale(o.transmittance * i.transmittance / (c->eta * c->eta), below));
}

/* Returns the probability of sampling the boundary's own reflection. */
static double reflection_probability(const struct layer *l, vec3 wo)
{
	double t = boundary_transmittance(l, fabs(wo.z)), r = (1 - t) * l->c->max_specular;
	return r + t > 0 ? r / (r + t) : 0;
}

static double coat_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!scatters_between(b, wo, wi))
		return 0;
	struct layer l = layer_at(b, p);
	const struct coat *c = l.c;
	struct refracted_ray o, i;
	double probability = reflection_probability(&l, wo), lobe = 0, below = 0;
	if (c->rough)
		rough_boundary_reflect(&l.boundary, facing_up(wo), facing_up(wi), &lobe);
	if (c->inner.has_smooth && refract_into(&l, wo, &o) && refract_into(&l, wi, &i))
		below = c->inner.ops->pdf_solid(&c->inner, p, o.direction, i.direction) *
			(wi.z / i.direction.z / (c->eta * c->eta));
	return probability * lobe + (1 - probability) * below;
}

static spectrum coat_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				double *probability)
{
	struct layer l = layer_at(b, p);
	const struct coat *c = l.c;
	struct refracted_ray o;
	vec3 unused;
	spectrum f = spectrum_constant(0);
	double inner_probability, total_probability = 0;
	if (!(mode & BSDF_REFLECT) || !(fabs(wo.z) >= DBL_MIN) || (wo.z < 0 && !b->is_two_sided))
		return f;
	double outer_probability = reflection_probability(&l, wo);
	*wi = (vec3){-wo.x, -wo.y, wo.z};
	if (!c->rough) {
		total_probability = outer_probability;
		f = spectrum_scale(1 - boundary_transmittance(&l, fabs(wo.z)),
				   texture_eval(&c->specular, &p->texture_point, p->wavelengths));
	}
	if (c->inner.has_delta && refract_into(&l, wo, &o)) {
		spectrum below = bsdf_eval_delta(&c->inner, p, o.direction, BSDF_REFLECT, &unused, &inner_probability);
		if (!spectrum_is_zero(below)) {
			total_probability += (1 - outer_probability) * inner_probability;
			below = spectrum_mul(below, absorption_transmittance(c, p, o.direction, o.direction));
			f = spectrum_add(f, spectrum_scale(o.transmittance * o.transmittance, below));
		}
	}
	*probability = total_probability;
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

/* Samples the direction wi of a lobe that is not specular. Returns false if the sample is specular (*is_delta is set),
 * or absorbed. */
static bool sample_lobe(const struct bsdf *b, const struct layer *l, const struct bsdf_point *p, vec3 wo,
			const double u[3], bool *is_delta, vec3 *wi)
{
	const struct coat *c = l->c;
	struct bsdf_sample inner;
	struct refracted_ray o;
	double probability = reflection_probability(l, wo);
	*is_delta = false;
	if (u[2] < probability) {
		*is_delta = !c->rough;
		if (*is_delta)
			return false;
		*wi = microfacet_sample_mirrored(&l->boundary.facets, facing_up(wo), u[0], u[1]);
		wi->z = copysign(1, wo.z) * wi->z;
		return scatters_between(b, wo, *wi);
	}
	const double rest[3] = {u[0], u[1], fmin((u[2] - probability) / (1 - probability), 1 - 0x1p-53)};
	if (!refract_into(l, wo, &o) || !c->inner.ops->sample(&c->inner, p, o.direction, rest, &inner))
		return false;
	*is_delta = inner.mode & BSDF_DELTA;
	return !*is_delta && refract_out(c, inner.wi, wi) && scatters_between(b, wo, *wi);
}

static bool coat_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	bool is_delta;
	vec3 wi;
	if (!scatters_between(b, wo, wo))
		return false;
	struct layer l = layer_at(b, p);
	if (sample_lobe(b, &l, p, wo, u, &is_delta, &wi))
		return bsdf_sample_smooth(b, p, wo, wi, out);
	return is_delta && bsdf_sample_delta(b, p, wo, BSDF_REFLECT, out) && !spectrum_is_zero(out->f);
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
	b->uses_relief_frames = c->inner.uses_relief_frames;
	b->modes = BSDF_REFLECT | c->inner.modes;
	b->has_smooth = c->inner.has_smooth;
	b->has_delta = c->inner.has_delta;
	b->is_two_sided = c->inner.is_two_sided;
	b->is_textured |= c->inner.is_textured;
	b->uses_tangents = c->inner.uses_tangents;
	b->is_nonreciprocal = c->inner.is_nonreciprocal;
	b->min_alpha = c->inner.has_smooth ? c->inner.min_alpha : INFINITY;
	b->mean_alpha = c->inner.mean_alpha;
	bsdf_add_color_kind(b, c->inner.color_kind);
	return 0;
}

static int read_absorption(struct coat *c, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			   struct error *e)
{
	c->thickness = node_float(n, "thickness", 1);
	return bsdf_read_quantity(b, &c->absorption, n, "sigma_a", 0, false, build, e);
}

static int read_layer(struct coat *c, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		      struct error *e)
{
	double inside, outside;
	int code = ior_read(n, "int_ior", IOR_BK7_DEFAULT, &inside, e);
	if (!code)
		code = ior_read(n, "ext_ior", IOR_AIR_DEFAULT, &outside, e);
	if (!code)
		code = bsdf_read_texture(b, &c->specular, n, "specular_reflectance", 1, build, e);
	if (!code)
		code = read_absorption(c, b, n, build, e);
	if (code)
		return code;
	c->eta = inside / outside;
	c->max_specular = texture_max(&c->specular);
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
		b->min_alpha = b->mean_alpha = 0;
	return code;
}

static int roughcoating_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			       struct error *e)
{
	struct coat *c = b->data;
	c->rough = &c->boundary;
	int code = read_inner(c, b, n, build, e);
	double alpha = b->min_alpha, mean = b->mean_alpha;
	if (!code)
		code = read_layer(c, b, n, build, e);
	if (!code)
		code = rough_boundary_read(c->rough, c->eta, b, n, build, e); /* overwrites b->min_alpha */
	if (code)
		return code;
	b->min_alpha = fmin(b->min_alpha, alpha);
	b->mean_alpha = c->inner.has_smooth ? mean : b->mean_alpha; /* most light comes from below */
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
