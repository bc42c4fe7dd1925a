/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A thin layer of a medium between two parallel sides that do not refract: light passes straight through, or is
 * scattered once (Hanrahan and Krueger 1993, Reflection from Layered Surfaces due to Subsurface Scattering, sec. 4).
 * Light scattered more than once is lost. With the optical thickness t (sigma_t times the thickness), the cosines a =
 * |wo.z| and c = |wi.z|, the albedo A = sigma_s / sigma_t and the phase function p, integration over the depth of the
 * scattering event gives
 *
 *   reflected    f = A p(wo, wi) (1 - exp(-t / a - t / c)) / (a + c)
 *   transmitted  f = A p(wo, wi) (exp(-t / a) - exp(-t / c)) / (a - c)
 *   straight     exp(-t / a), a specular lobe
 *
 * Both values of f are the same with wo and wi exchanged. The coefficients are given as for a medium of Mitsuba 0.6:
 * sigma_s and sigma_a, or sigma_t and albedo, or the name of a measured material, which is skin1 by default.
 *
 * Creation fails if coefficients are given in two ways, if no material has the given name, or if the phase function is
 * that of microflakes, whose extinction depends on the direction.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/math/measured_media.h"
#include "worker/render/medium/medium.h"

#include <math.h>
#include <string.h>

/* Lower bound of cosines, so that quotients by them stay finite. */
#define COSINE_MIN 0x1p-1000

struct layer {
	struct texture first, second; /* sigma_a and sigma_s, or sigma_t and albedo */
	bool uses_albedo;
	double thickness;
	struct phase phase;
};

/* Returns the optical thickness at a point. *scattered: the share of the extinction that is scattered, not absorbed. */
static spectrum eval_optical_depth(const struct layer *l, const struct bsdf_point *p, spectrum *scattered)
{
	spectrum first = texture_eval(&l->first, &p->texture_point, p->wavelengths),
		 second = texture_eval(&l->second, &p->texture_point, p->wavelengths);
	spectrum depth;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double s = second.v[i], t = l->uses_albedo ? first.v[i] : first.v[i] + s;
		depth.v[i] = t * l->thickness;
		scattered->v[i] = (1 - l->phase.absorbed_share) * (l->uses_albedo ? s : t > 0 ? s / t : 0);
	}
	return depth;
}

static double transmittance(double t, double cosine)
{
	return exp(-t / cosine);
}

/* (exp(-t / a) - exp(-t / c)) / (a - c): computed, with d = t / min - t / max, as the transmittance at the larger
 * cosine times (1 - exp(-d)) / (max - min); the last factor is t / (a c) where both cosines are equal. */
static double single_scatter_transmission(double t, double a, double c)
{
	double larger = fmax(a, c), smaller = fmin(a, c), d = t * ((larger - smaller) / larger / smaller);
	double direct = transmittance(t, larger);
	if (!(direct > 0))
		return 0;
	if (d > 1)
		return direct * -expm1(-d) / (larger - smaller);
	return direct * (d > 0 ? -expm1(-d) / d : 1) * (t / larger / smaller);
}

static double single_scatter_reflection(double t, double a, double c)
{
	return -expm1(-t / a - t / c) / (a + c);
}

static spectrum hk_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct layer *l = b->data;
	double a = fabs(wo.z), c = fabs(wi.z);
	if (!(a >= COSINE_MIN && c >= COSINE_MIN))
		return spectrum_constant(0);
	spectrum f, depth = eval_optical_depth(l, p, &f);
	bool same_side = wo.z * wi.z > 0;
	double phase = phase_eval(&l->phase, p->texture_point.p, wo, wi);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		f.v[i] *=
			phase * (same_side ? single_scatter_reflection : single_scatter_transmission)(depth.v[i], a, c);
	return f;
}

/* Returns the probability of sampling the straight lobe: the light that passes straight through over the sum of that
 * and the scattered light, as if no scattered light were absorbed on its way out. */
static double straight_probability(spectrum depth, spectrum scattered, double cosine)
{
	double straight = 0, other = 0;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double direct = transmittance(depth.v[i], cosine);
		straight += direct;
		other += scattered.v[i] * (1 - direct);
	}
	return other > 0 ? straight / (straight + other) : 1;
}

static double hk_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct layer *l = b->data;
	if (!(fabs(wo.z) >= COSINE_MIN && fabs(wi.z) >= COSINE_MIN))
		return 0;
	spectrum scattered, depth = eval_optical_depth(l, p, &scattered);
	return (1 - straight_probability(depth, scattered, fabs(wo.z))) *
	       phase_eval(&l->phase, p->texture_point.p, wo, wi);
}

static spectrum hk_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			      double *probability)
{
	if (!(mode & BSDF_STRAIGHT) || !(fabs(wo.z) >= COSINE_MIN))
		return spectrum_constant(0);
	spectrum scattered, f = eval_optical_depth(b->data, p, &scattered);
	*wi = vec3_neg(wo);
	*probability = straight_probability(f, scattered, fabs(wo.z));
	for (int i = 0; i < SPECTRUM_LANES; i++)
		f.v[i] = transmittance(f.v[i], fabs(wo.z));
	return f;
}

static bool hk_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		      struct bsdf_sample *out)
{
	const struct layer *l = b->data;
	double unused;
	if (!(fabs(wo.z) >= COSINE_MIN))
		return false;
	spectrum scattered, depth = eval_optical_depth(l, p, &scattered);
	if (u[2] < straight_probability(depth, scattered, fabs(wo.z)))
		return bsdf_sample_delta(b, p, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, out);
	return bsdf_sample_smooth(b, p, wo, phase_sample(&l->phase, p->texture_point.p, wo, u, &unused), out);
}

/* Reads a coefficient, which is the measured one unless the scene gives it. */
static int read_coefficient(struct texture *t, struct bsdf *b, const struct scene_node *n, const char *name,
			    const double measured[3], const struct bsdf_build *build, struct error *e)
{
	const struct texture_build texture_build = bsdf_texture_build(build);
	enum color_role role = strcmp(name, "albedo") == 0 ? COLOR_REFLECTANCE : COLOR_UNBOUNDED;
	int code;
	*t = (struct texture){.ops = NULL};
	if (node_find_property(n, name))
		code = texture_from_node(t, n, name, 0, role, &texture_build, e);
	else
		code = color_from_rgb(measured, role, &t->color);
	if (code)
		return code;
	bsdf_add_color_kind(b, texture_color_kind(t));
	b->is_textured |= !texture_is_constant(t);
	return 0;
}

static int read_coefficients(struct layer *l, struct bsdf *b, const struct scene_node *n,
			     const struct bsdf_build *build, struct error *e)
{
	bool separate = node_find_property(n, "sigma_s") || node_find_property(n, "sigma_a");
	l->uses_albedo = node_find_property(n, "sigma_t") || node_find_property(n, "albedo");
	if (l->uses_albedo && (separate || !(node_find_property(n, "sigma_t") && node_find_property(n, "albedo"))))
		return node_error(n, e, EINVAL, "either sigma_s and sigma_a, or sigma_t and albedo");
	double a[3], s[3];
	int code = medium_look_up_measured(n, node_string(n, "material", MEASURED_MEDIUM_DEFAULT), true, a, s, e);
	if (code)
		return code;
	code = read_coefficient(&l->first, b, n, l->uses_albedo ? "sigma_t" : "sigma_a", a, build, e);
	return code ? code : read_coefficient(&l->second, b, n, l->uses_albedo ? "albedo" : "sigma_s", s, build, e);
}

static int hk_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct layer *l = b->data;
	const struct volume_build default_build = {
		.assets = build->assets, .arena = build->arena, .is_dialect_3 = build->is_dialect_3, .world_scale = 1};
	int code = read_coefficients(l, b, n, build, e);
	if (!code)
		code = phase_create(&l->phase, node_child(n, PLUGIN_PHASE, 0),
				    build->volumes ? build->volumes : &default_build, e);
	if (!code && l->phase.ops->area)
		code = node_error(n, e, ENOTSUP, "microflakes are not supported in a layer");
	if (code)
		return code;
	l->thickness = node_float(n, "thickness", 1);
	b->modes = BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT;
	b->has_smooth = true;
	b->has_delta = true;
	b->is_two_sided = true;
	b->mean_alpha = 1;
	return 0;
}

#define COEFFICIENT(NAME)                                                  \
	{                                                                  \
		.name = NAME, .types = VALUE_TEXTURE, .min = 0, .max = 1e9 \
	}

const struct bsdf_ops bsdf_ops_hk = {
	.decl = {PLUGIN_BSDF, "hk",
		 PARAMS(COEFFICIENT("sigma_s"), COEFFICIENT("sigma_a"), COEFFICIENT("sigma_t"),
			{.name = "albedo", .types = VALUE_TEXTURE, .min = 0, .max = 1},
			{"material", UNDERSTOOD(VALUE_STRING)},
			{.name = "thickness", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1e30}),
		 1u << PLUGIN_PHASE, PARAM_UNDERSTOOD},
	.data_size = sizeof(struct layer),
	.create = hk_create,
	.eval = hk_eval,
	.pdf_solid = hk_pdf,
	.eval_delta = hk_eval_delta,
	.sample = hk_sample,
};
