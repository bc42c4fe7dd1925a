/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Disney's "principled" BSDF (Burley 2012, Physically Based Shading at Disney, and 2015, Extending the Disney BRDF to a
 * BSDF), with the parameters and defaults of Mitsuba 3's plug-in. With m = metallic, t = spec_trans, c = base_color,
 * and a rough GGX boundary of index eta,
 *
 *   f = D G1 G1 F / 4 + (1 - m) (1 - t) diffuse + (1 - m) sheen + clearcoat / 4 + (1 - m) t sqrt(c) refracted
 *
 * where F interpolates by m between Fresnel's factor of the boundary and Schlick's of colour c (metal). Below the
 * surface only the boundary scatters light, with the factor (1 - m) t. A tint is c over its luminance;
 * `specular_color`, if given (an extension for glTF), replaces it with a share of 1, and `specular_strength` (an
 * extension, KHR_materials_specular of glTF) multiplies the boundary's part of F. With these two, light from below
 * meets the same F, at the cosine of the outer direction, and the refracted part is (1 - m) t sqrt(c) (1 - F); total
 * reflection stays total. As in the papers, lobes are added, not layered: at grazing angles, above all with sheen, the
 * surface may reflect up to 1.5 times the light that arrives.
 *
 * With `is_lambertian` (an extension for glTF, Appendix B.3.5 of its specification) the diffuse lobe is Lambertian,
 * without the light that the boundary reflects at the half vector: c / pi (1 - F).
 *
 * `coat` (an extension for glTF) is a layer on a share k of the surface, with GGX facets of its own and Schlick's
 * factor S of an index of 1.5. The lobes below it lose the light that the coat reflects, in both directions:
 *
 *   f (1 - k S(wo)) (1 - k S(wi)) + k S D G1 G1 / 4
 *
 * Creation fails if both `eta` and `specular` are given. A sample fails if the facet's direction is on the wrong side,
 * or if the density there is 0.
 */
#include "worker/render/bsdf/principled.h"

#include "common/base/color.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/warp.h"

#define PRINCIPLED_ALPHA_MIN 1e-3
#define CLEARCOAT_REFLECTANCE 0.04 /* at normal incidence, of an index of 1.5 */

enum { LOBE_DIFFUSE, LOBE_SPECULAR, LOBE_CLEARCOAT, LOBE_COAT, LOBE_TRANSMIT, LOBE_COUNT };

/* Returns base_color over its luminance, computed from eight wavelengths weighted by the eye's sensitivity, or from
 * RGB. */
static spectrum compute_tint(const struct principled *p, const struct bsdf_point *point, spectrum base)
{
	static const struct wavelengths sampled[2] = {{.nm = {440, 520, 560, 620}}, {.nm = {480, 540, 580, 660}}};
	static const double weight[2][SPECTRUM_LANES] = {{0.023, 0.710, 0.995, 0.381}, {0.139, 0.954, 0.870, 0.061}};
	double sum = 0, total_weight = 0;
	if (WAVELENGTHS_GREY(point->wavelengths))
		return spectrum_constant(1);
	if (point->wavelengths->is_rgb) {
		double luminance = rec709_luminance(base.v);
		return luminance > 0 ? spectrum_scale(1 / luminance, base) : spectrum_constant(1);
	}
	for (int k = 0; k < 2; k++) {
		spectrum c = texture_eval(&p->base, &point->texture_point, &sampled[k]);
		for (int l = 0; l < SPECTRUM_LANES; l++) {
			sum += weight[k][l] * c.v[l];
			total_weight += weight[k][l];
		}
	}
	return sum > 0 ? spectrum_scale(total_weight / sum, base) : spectrum_constant(1);
}

struct microfacet principled_facets(double anisotropic, double roughness)
{
	struct microfacet m;
	double a = roughness * roughness, aspect = sqrt(1 - 0.9 * anisotropic);
	microfacet_init(&m, true, max_of(PRINCIPLED_ALPHA_MIN, a / aspect), max_of(PRINCIPLED_ALPHA_MIN, a * aspect));
	return m;
}

/* Returns the value of a share at a point, clamped to [0,1]: the mean over the lanes, since textures of shares are
 * grey. */
static double eval_share(const struct texture *t, const struct bsdf_point *point)
{
	return min_of(max_of(spectrum_mean(texture_eval(t, &point->texture_point, point->wavelengths)), 0), 1);
}

/* Evaluates all parameters but the colours. */
static void eval_numbers(const struct principled *p, const struct bsdf_point *point, struct principled_point *s)
{
	s->roughness = eval_share(&p->roughness, point);
	s->metallic = eval_share(&p->metallic, point);
	for (int i = 0; i < PRINCIPLED_SHARE_COUNT; i++)
		s->share[i] = p->share[i].ops ? eval_share(&p->share[i], point) : p->max_share[i];
	if (p->has_specular)
		s->share[PRINCIPLED_SPEC_TINT] = 1;
	s->facets = principled_facets(s->share[PRINCIPLED_ANISOTROPIC], s->roughness);
	if (s->share[PRINCIPLED_COAT] > 0)
		s->coat = principled_facets(0, s->share[PRINCIPLED_COAT_ROUGHNESS]);
}

static bool is_number(const struct texture *t)
{
	return texture_is_constant(t) && texture_color_kind(t) == COLOR_KIND_CONSTANT;
}

void principled_precompute(struct principled *p, const struct bsdf_build *build)
{
	const struct bsdf_probes probes = bsdf_probes_make(build);
	const struct bsdf_point probe = bsdf_probe_point(&probes, 0);
	p->is_textured = !is_number(&p->roughness) || !is_number(&p->metallic);
	for (int i = 0; i < PRINCIPLED_SHARE_COUNT; i++)
		p->is_textured |= p->share[i].ops != NULL;
	p->precomputed = (struct principled_point){.principled = p, .eta = p->eta};
	eval_numbers(p, &probe, &p->precomputed);
}

struct principled_point principled_point_at(const struct principled *p, const struct bsdf_point *point)
{
	struct principled_point s = p->precomputed;
	s.base = texture_eval(&p->base, &point->texture_point, point->wavelengths);
	if (p->is_textured)
		eval_numbers(p, point, &s);
	bool tinted = (!p->has_specular && s.share[PRINCIPLED_SPEC_TINT] > 0) || s.share[PRINCIPLED_SHEEN_TINT] > 0;
	s.tint = tinted ? compute_tint(p, point, s.base) : spectrum_constant(1);
	s.specular = p->has_specular ? texture_eval(&p->specular, &point->texture_point, point->wavelengths) : s.tint;
	return s;
}

static double schlick(double cosine)
{
	double x = min_of(max_of(1 - cosine, 0), 1);
	return x * x * x * x * x;
}

spectrum principled_boundary_fresnel(const struct principled_point *s, double cosine)
{
	double rest = schlick(cosine), root = (s->eta - 1) / (s->eta + 1), tint = s->share[PRINCIPLED_SPEC_TINT];
	double plain = (1 - tint) * fresnel_dielectric(min_of(cosine, 1), s->eta).reflectance;
	spectrum f;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double tinted = min_of(s->specular.v[i] * root * root, 1);
		f.v[i] = s->share[PRINCIPLED_SPECULAR_STRENGTH] * (plain + tint * (tinted + (1 - tinted) * rest));
	}
	return f;
}

/* Returns F of the comment at the top. */
spectrum principled_fresnel(const struct principled_point *s, spectrum boundary, double cosine)
{
	double rest = schlick(cosine);
	spectrum f;
	for (int i = 0; i < SPECTRUM_LANES; i++)
		f.v[i] = (1 - s->metallic) * boundary.v[i] + s->metallic * (s->base.v[i] + (1 - s->base.v[i]) * rest);
	return f;
}

/* Burley 2012, section 5.3, with Burley's approximation of subsurface scattering (flatness), and the sheen of section
 * 5.6. The caller has made sure that wi is above the surface. */
spectrum principled_eval_diffuse(const struct principled_point *s, spectrum boundary, vec3 wo, vec3 wi, double cos_d)
{
	double fo = schlick(wo.z), fi = schlick(wi.z), retro = 2 * s->roughness * cos_d * cos_d;
	double base = (1 - 0.5 * fo) * (1 - 0.5 * fi) + retro * (fo + fi + fo * fi * (retro - 1));
	double ss = (1 + (0.5 * retro - 1) * fo) * (1 + (0.5 * retro - 1) * fi);
	double flat = 1.25 * (ss * (1 / max_of(wo.z + wi.z, 1e-300) - 0.5) + 0.5);
	double diffuse_scale = (1 - s->metallic) * (1 - s->share[PRINCIPLED_TRANSMISSION]) / WARP_PI,
	       burley = base + s->share[PRINCIPLED_FLATNESS] * (flat - base);
	double sheen = (1 - s->metallic) * s->share[PRINCIPLED_SHEEN] * schlick(cos_d);
	spectrum f;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double diffuse = diffuse_scale * (s->principled->is_lambertian ? 1 - boundary.v[i] : burley);
		f.v[i] = diffuse * s->base.v[i] + sheen * (1 + s->share[PRINCIPLED_SHEEN_TINT] * (s->tint.v[i] - 1));
	}
	return f;
}

static double clearcoat_alpha(double gloss)
{
	return 0.1 + (0.001 - 0.1) * gloss;
}

/* GTR1: Burley 2012, appendix B.2. */
static double clearcoat_d(const struct principled_point *s, double cos_h)
{
	double alpha = clearcoat_alpha(s->share[PRINCIPLED_CLEARCOAT_GLOSS]), a2 = alpha * alpha;
	return (a2 - 1) / (WARP_PI * log(a2) * (a2 * cos_h * cos_h + (1 - cos_h) * (1 + cos_h)));
}

/* Without the factor 1 / (4 cos cos) of microfacets, as in Mitsuba: four times as bright as Burley's seen from straight
 * above. */
static double eval_clearcoat(const struct principled_point *s, vec3 wo, vec3 wi, vec3 h, double cos_d)
{
	struct microfacet shadow;
	microfacet_init(&shadow, true, 0.25, 0.25);
	double f = CLEARCOAT_REFLECTANCE + (1 - CLEARCOAT_REFLECTANCE) * schlick(cos_d);
	double g = microfacet_g1_over_cos(&shadow, wo) * wo.z * microfacet_g1_over_cos(&shadow, wi) * wi.z;
	return 0.25 * s->share[PRINCIPLED_CLEARCOAT] * f * clearcoat_d(s, h.z) * g;
}

/* Returns the share of light at an angle that the coat reflects. */
static double coat_reflectance(const struct principled_point *s, double cosine)
{
	return s->share[PRINCIPLED_COAT] * (CLEARCOAT_REFLECTANCE + (1 - CLEARCOAT_REFLECTANCE) * schlick(cosine));
}

/* Returns about the share of the boundary's facets on which light from below is reflected totally: those whose slope
 * towards wo takes it beyond the critical angle. GGX slopes along a line have the cumulative distribution
 * (1 + x / sqrt(a^2 + x^2)) / 2. */
static double total_reflection_share(const struct principled_point *s, vec3 wo)
{
	double cosine = min_of(fabs(wo.z), 1), sine = sqrt((1 - cosine) * (1 + cosine)), critical = 1 / s->eta,
	       below = sqrt((1 - critical) * (1 + critical)), over = sine * below - cosine * critical,
	       along = cosine * below + sine * critical, spread = microfacet_mean_alpha(&s->facets) * along;
	return 0.5 + 0.5 * over / sqrt(over * over + spread * spread);
}

/* Computes the probabilities of sampling each lobe for light from wo. */
static void compute_lobe_probabilities(const struct principled_point *s, vec3 wo, double probability[LOBE_COUNT])
{
	const struct principled *p = s->principled;
	bool below = wo.z < 0;
	double clear = 1 - s->metallic, glass = clear * s->share[PRINCIPLED_TRANSMISSION];
	double reflected = fresnel_dielectric(min_of(fabs(wo.z), 1), below ? 1 / p->eta : p->eta).reflectance, sum = 0;
	/* The strength does not scale total reflection, which some facets may have where the plane does not. */
	if (p->scales_boundary) {
		double total = below ? total_reflection_share(s, wo) : 0;
		reflected = total + (1 - total) * reflected * s->share[PRINCIPLED_SPECULAR_STRENGTH];
	}
	/* Never 0: where the plane reflects totally, some facets still transmit. */
	probability[LOBE_TRANSMIT] = glass * max_of(1 - reflected, 0.05);
	probability[LOBE_SPECULAR] =
		below ? glass * reflected : clear * reflected + s->metallic * max_of(p->max_base, 0.04);
	probability[LOBE_DIFFUSE] = below ? 0
					  : clear * max_of((1 - s->share[PRINCIPLED_TRANSMISSION]) * p->max_base,
							   min_of(s->share[PRINCIPLED_SHEEN], 1) * 0.2);
	probability[LOBE_CLEARCOAT] =
		below ? 0 : s->share[PRINCIPLED_CLEARCOAT] * (CLEARCOAT_REFLECTANCE + schlick(wo.z)) * wo.z;
	double coat = below ? 0 : coat_reflectance(s, wo.z);
	for (int i = 0; i < LOBE_COUNT; i++) {
		probability[i] = i == LOBE_COAT ? coat : probability[i] * (1 - coat);
		sum += probability[i];
	}
	for (int i = 0; i < LOBE_COUNT; i++)
		probability[i] = sum > 0 ? probability[i] / sum : 0;
}

static vec3 mirror_if_below(vec3 v, bool below)
{
	return below ? (vec3){v.x, v.y, -v.z} : v;
}

/* The value and the density for a pair of directions, computed together because they share most terms. wo.z is not
 * 0. */
struct evaluation {
	spectrum f;
	double pdf;
};

/* Adds refracted light to *out: Walter et al. 2007, eq. 21, as in roughdielectric. wo is above; eta: index beyond
 * over index on wo's side. */
static void add_refracted(const struct principled_point *s, vec3 wo, vec3 wi, double eta, double probability,
			  enum transport transport, struct evaluation *out)
{
	vec3 h;
	double length;
	if (!microfacet_half_vector(wo, eta, wi, &h, &length))
		return;
	if (h.z < 0)
		h = vec3_neg(h);
	double co = vec3_dot(wo, h), ci = vec3_dot(wi, h);
	if (!(co > 0 && ci < 0))
		return;
	double spread = co * -ci * (eta / length) * (eta / length);
	double facet_pdf = microfacet_d(&s->facets, h) * microfacet_g1_over_cos(&s->facets, wo) * spread;
	double passes = (1 - s->metallic) * s->share[PRINCIPLED_TRANSMISSION];
	spectrum boundary = spectrum_constant(0);
	if (s->principled->scales_boundary)
		boundary = principled_boundary_fresnel(s, min_of(eta > 1 ? co : -ci, 1));
	else
		passes *= fresnel_between(min_of(co, 1), min_of(-ci, 1), eta).transmittance;
	double f = facet_pdf * passes * microfacet_g1_over_cos(&s->facets, (vec3){wi.x, wi.y, fabs(wi.z)});
	f *= 1 - coat_reflectance(s, eta > 1 ? wo.z : -wi.z);
	if (transport == TRANSPORT_RADIANCE)
		f /= eta * eta;
	for (int i = 0; i < SPECTRUM_LANES; i++)
		out->f.v[i] += f * sqrt(s->base.v[i]) * (1 - boundary.v[i]);
	out->pdf += probability * facet_pdf;
}

/* Returns the coat's reflection without its Fresnel factor and G1(wi), which is also the density of sampling it. */
static double coat_lobe(const struct principled_point *s, vec3 wo, vec3 h)
{
	return 0.25 * microfacet_d(&s->coat, h) * microfacet_g1_over_cos(&s->coat, wo);
}

/* Returns the density (solid angle) of reflected directions. facet_pdf: that of sampling the boundary's facets; cos_d:
 * cosine of either direction to the half vector h. */
static double reflected_pdf(const struct principled_point *s, vec3 wo, vec3 wi, vec3 h, double cos_d, double facet_pdf,
			    bool below, const double probability[LOBE_COUNT])
{
	double pdf = probability[LOBE_SPECULAR] * facet_pdf;
	if (below)
		return pdf;
	pdf += probability[LOBE_DIFFUSE] * wi.z / WARP_PI;
	if (s->share[PRINCIPLED_CLEARCOAT] > 0)
		pdf += probability[LOBE_CLEARCOAT] * clearcoat_d(s, h.z) * h.z / (4 * cos_d);
	if (s->share[PRINCIPLED_COAT] > 0)
		pdf += probability[LOBE_COAT] * coat_lobe(s, wo, h);
	return pdf;
}

/* Of light from below, at the cosine to the facet. */
static spectrum inner_reflectance(const struct principled_point *s, double cosine)
{
	struct fresnel f = fresnel_dielectric(cosine, 1 / s->principled->eta);
	return s->principled->scales_boundary && f.transmittance > 0 ? principled_boundary_fresnel(s, f.cos_t)
								     : spectrum_constant(f.reflectance);
}

static spectrum reflected_value(const struct principled_point *s, vec3 wo, vec3 wi, vec3 h, double cos_d,
				double facet_pdf, bool below)
{
	double both = facet_pdf * microfacet_g1_over_cos(&s->facets, wi);
	if (below)
		return spectrum_scale(both * (1 - s->metallic) * s->share[PRINCIPLED_TRANSMISSION],
				      inner_reflectance(s, cos_d));
	spectrum boundary = principled_boundary_fresnel(s, cos_d);
	spectrum f = spectrum_add(spectrum_scale(both, principled_fresnel(s, boundary, cos_d)),
				  principled_eval_diffuse(s, boundary, wo, wi, cos_d));
	if (s->share[PRINCIPLED_CLEARCOAT] > 0)
		f = spectrum_add(f, spectrum_constant(eval_clearcoat(s, wo, wi, h, cos_d)));
	if (s->share[PRINCIPLED_COAT] > 0) {
		double through = (1 - coat_reflectance(s, wo.z)) * (1 - coat_reflectance(s, wi.z));
		double coat = coat_reflectance(s, cos_d) * coat_lobe(s, wo, h) * microfacet_g1_over_cos(&s->coat, wi);
		f = spectrum_add(spectrum_scale(through, f), spectrum_constant(coat));
	}
	return f;
}

/* Computes the value if `wants_value` is set, and the density if the probabilities of the lobes are given. */
static struct evaluation evaluate(const struct principled_point *s, vec3 wo, vec3 wi, enum transport transport,
				  bool wants_value, const double *probability)
{
	struct evaluation out = {spectrum_constant(0), 0};
	bool below = wo.z<0, glass = s->share[PRINCIPLED_TRANSMISSION]> 0 && s->metallic < 1;
	if (wo.z == 0 || wi.z == 0 || (below && !glass))
		return out;
	wo = mirror_if_below(wo, below);
	wi = mirror_if_below(wi, below);
	if (wi.z < 0) {
		if (glass)
			add_refracted(s, wo, wi, below ? 1 / s->principled->eta : s->principled->eta,
				      probability ? probability[LOBE_TRANSMIT] : 0, transport, &out);
		return out;
	}
	vec3 h;
	double length;
	if (!microfacet_half_vector(wo, 1, wi, &h, &length))
		return out;
	double cos_d = min_of(0.5 * length, 1);
	double facet_pdf = 0.25 * microfacet_d(&s->facets, h) * microfacet_g1_over_cos(&s->facets, wo);
	if (wants_value)
		out.f = reflected_value(s, wo, wi, h, cos_d, facet_pdf, below);
	if (probability)
		out.pdf = reflected_pdf(s, wo, wi, h, cos_d, facet_pdf, below, probability);
	return out;
}

static spectrum principled_eval(const struct bsdf *b, const struct bsdf_point *point, vec3 wo, vec3 wi)
{
	struct principled_point s = principled_point_at(b->data, point);
	return evaluate(&s, wo, wi, point->transport, true, NULL).f;
}

static double principled_pdf(const struct bsdf *b, const struct bsdf_point *point, vec3 wo, vec3 wi)
{
	struct principled_point s = principled_point_at(b->data, point);
	double probability[LOBE_COUNT];
	compute_lobe_probabilities(&s, wo, probability);
	return evaluate(&s, wo, wi, point->transport, false, probability).pdf;
}

/* Samples a half vector of GTR1 by inverting its cumulative distribution exactly. */
static vec3 sample_clearcoat_normal(const struct principled_point *s, double u0, double u1)
{
	double alpha = clearcoat_alpha(s->share[PRINCIPLED_CLEARCOAT_GLOSS]), a2 = alpha * alpha;
	double cos2 = fmin(fmax((1 - pow(a2, 1 - u0)) / (1 - a2), 0), 1), sine = sqrt(1 - cos2), phi = 2 * WARP_PI * u1;
	return (vec3){sine * cos(phi), sine * sin(phi), sqrt(cos2)};
}

/* Samples wi of one lobe for wo above the surface. Returns false if wi is on the wrong side, or if the facet transmits
 * nothing. */
static bool sample_lobe(const struct principled_point *s, int lobe, vec3 wo, double eta, const double u[3], vec3 *wi)
{
	if (lobe == LOBE_DIFFUSE) {
		*wi = warp_cosine_hemisphere(u[0], u[1]);
		return wi->z > 0;
	}
	vec3 h = lobe == LOBE_CLEARCOAT
			 ? sample_clearcoat_normal(s, u[0], u[1])
			 : microfacet_sample_visible(lobe == LOBE_COAT ? &s->coat : &s->facets, wo, u[0], u[1]);
	double c = min_of(vec3_dot(wo, h), 1);
	if (!(c > 0))
		return false;
	if (lobe != LOBE_TRANSMIT) {
		*wi = vec3_normalize(vec3_sub(vec3_scale(2 * c, h), wo));
		return wi->z > 0;
	}
	struct fresnel at_h = fresnel_dielectric(c, eta);
	*wi = vec3_normalize(vec3_madd(vec3_scale(-1 / eta, wo), c / eta - at_h.cos_t, h));
	return at_h.transmittance > 0 && wi->z < 0;
}

static bool principled_sample(const struct bsdf *b, const struct bsdf_point *point, vec3 wo, const double u[3],
			      struct bsdf_sample *out)
{
	struct principled_point s = principled_point_at(b->data, point);
	bool below = wo.z < 0;
	double probability[LOBE_COUNT], rest = u[2], eta = below ? 1 / s.principled->eta : s.principled->eta;
	vec3 wi;
	if (wo.z == 0)
		return false;
	compute_lobe_probabilities(&s, wo, probability);
	int lobe = 0;
	while (lobe < LOBE_COUNT - 1 && rest >= probability[lobe])
		rest -= probability[lobe++];
	if (!(probability[lobe] > 0) || !sample_lobe(&s, lobe, mirror_if_below(wo, below), eta, u, &wi))
		return false;
	wi = mirror_if_below(wi, below);
	struct evaluation evaluation = evaluate(&s, wo, wi, point->transport, true, probability);
	if (!(evaluation.pdf > 0))
		return false;
	bool reflect = wo.z * wi.z > 0;
	*out = (struct bsdf_sample){.wi = wi,
				    .mode = reflect ? BSDF_REFLECT : BSDF_TRANSMIT,
				    .pdf = evaluation.pdf,
				    .f = evaluation.f,
				    .eta = reflect ? 1 : eta};
	return true;
}

static double clamped_extreme(const struct texture *t, const struct bsdf_build *build, bool wants_max)
{
	const struct bsdf_range r = bsdf_probe_range(t, build);
	return fmin(fmax(wants_max ? r.max : r.min, 0), 1);
}

double principled_min_value(const struct texture *t, const struct bsdf_build *build)
{
	return clamped_extreme(t, build, false);
}

int principled_read_shares(struct principled *p, struct bsdf *b, const struct scene_node *n,
			   const struct bsdf_build *build, struct error *e)
{
	static const char *const names[PRINCIPLED_SHARE_COUNT] = {[PRINCIPLED_TRANSMISSION] = "spec_trans",
								  [PRINCIPLED_SPEC_TINT] = "spec_tint",
								  [PRINCIPLED_SHEEN] = "sheen",
								  [PRINCIPLED_SHEEN_TINT] = "sheen_tint",
								  [PRINCIPLED_FLATNESS] = "flatness",
								  [PRINCIPLED_CLEARCOAT] = "clearcoat",
								  [PRINCIPLED_CLEARCOAT_GLOSS] = "clearcoat_gloss",
								  [PRINCIPLED_ANISOTROPIC] = "anisotropic",
								  [PRINCIPLED_COAT] = "coat",
								  [PRINCIPLED_COAT_ROUGHNESS] = "coat_roughness",
								  [PRINCIPLED_SPECULAR_STRENGTH] = "specular_strength"};
	for (int i = 0; i < PRINCIPLED_SHARE_COUNT; i++) {
		p->share[i] = (struct texture){.ops = NULL};
		if (!node_ref(n, names[i])) {
			p->max_share[i] = node_float(n, names[i], i == PRINCIPLED_SPECULAR_STRENGTH ? 1 : 0);
			continue;
		}
		int code = bsdf_read_number(b, &p->share[i], n, names[i], 0, build, e);
		if (code)
			return code;
		p->max_share[i] = clamped_extreme(&p->share[i], build, true);
	}
	b->uses_tangents = p->max_share[PRINCIPLED_ANISOTROPIC] > 0;
	return 0;
}

static int read_index(struct principled *p, const struct scene_node *n, struct error *e)
{
	double specular = node_float(n, "specular", 0.5);
	if (node_find_property(n, "eta") && node_find_property(n, "specular"))
		return node_error(n, e, EINVAL, "eta and specular exclude each other; give one of them");
	if (p->max_share[PRINCIPLED_TRANSMISSION] > 0 && specular == 0)
		specular = 1e-3; /* Mitsuba's minimum, for the same reason as that of eta below */
	/* Burley 2012, section 5.5: 0.08 times `specular` is reflected at normal incidence. */
	p->eta = node_find_property(n, "eta") ? node_float(n, "eta", 1.5) : 2 / (1 - sqrt(0.08 * specular)) - 1;
	p->eta = fmax(p->eta, 1 + 1e-3); /* Mitsuba's minimum: without a difference of indices nothing is refracted */
	return 0;
}

static int principled_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			     struct error *e)
{
	struct principled *p = b->data;
	int code = bsdf_read_texture(b, &p->base, n, "base_color", 0.5, build, e);
	if (!code)
		code = bsdf_read_number(b, &p->roughness, n, "roughness", 0.5, build, e);
	if (!code)
		code = bsdf_read_number(b, &p->metallic, n, "metallic", 0, build, e);
	if (!code)
		code = principled_read_shares(p, b, n, build, e);
	p->has_specular = node_find_property(n, "specular_color") != NULL;
	if (!code && p->has_specular)
		code = bsdf_read_texture(b, &p->specular, n, "specular_color", 1, build, e);
	if (!code)
		code = read_index(p, n, e);
	if (code)
		return code;
	p->is_lambertian = node_bool(n, "lambertian", false);
	p->scales_boundary = p->has_specular || node_find_property(n, "specular_strength");
	p->max_base = texture_max(&p->base);
	principled_precompute(p, build);
	struct microfacet narrowest =
		principled_facets(p->max_share[PRINCIPLED_ANISOTROPIC], principled_min_value(&p->roughness, build));
	double min_metallic = principled_min_value(&p->metallic, build);
	bool glass = p->max_share[PRINCIPLED_TRANSMISSION] > 0 && min_metallic < 1;
	b->modes = BSDF_REFLECT | (glass ? BSDF_TRANSMIT : 0);
	b->has_smooth = true;
	b->is_two_sided = glass;
	b->eta = glass ? p->eta : 1;
	b->min_alpha =
		fmin(microfacet_min_alpha(&narrowest),
		     p->max_share[PRINCIPLED_CLEARCOAT] > 0 ? clearcoat_alpha(p->max_share[PRINCIPLED_CLEARCOAT_GLOSS])
							    : INFINITY);
	if (p->max_share[PRINCIPLED_COAT] > 0) {
		const struct texture *t = &p->share[PRINCIPLED_COAT_ROUGHNESS];
		struct microfacet coat = principled_facets(0, t->ops ? principled_min_value(t, build)
								     : p->max_share[PRINCIPLED_COAT_ROUGHNESS]);
		b->min_alpha = fmin(b->min_alpha, microfacet_min_alpha(&coat));
	}
	double diffuse = (1 - min_metallic) * (1 - p->max_share[PRINCIPLED_TRANSMISSION]);
	b->mean_alpha = diffuse + (1 - diffuse) * microfacet_mean_alpha(&narrowest);
	return 0;
}

const struct bsdf_ops bsdf_ops_principled = {
	.decl = PLUGIN(BSDF, "principled", {.name = "base_color", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		       {.name = "roughness", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		       {.name = "metallic", .types = VALUE_TEXTURE, .min = 0, .max = 1}, PRINCIPLED_SHARE("spec_trans"),
		       PRINCIPLED_SHARE("spec_tint"), PRINCIPLED_SHARE("sheen"), PRINCIPLED_SHARE("sheen_tint"),
		       PRINCIPLED_SHARE("flatness"), PRINCIPLED_SHARE("clearcoat"), PRINCIPLED_SHARE("clearcoat_gloss"),
		       PRINCIPLED_SHARE("anisotropic"), PRINCIPLED_SHARE("coat"), PRINCIPLED_SHARE("coat_roughness"),
		       PRINCIPLED_SHARE("specular_strength"),
		       {.name = "specular_color", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		       {.name = "lambertian", .types = VALUE_BOOL},
		       {.name = "thin", .status = PARAM_REFUSED}, /* use `principledthin` instead */
		       {.name = "specular", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 8},
		       {.name = "eta", .types = VALUE_FLOAT | VALUE_INT, .min = 1, .max = 10},
		       {.name = "diffuse_reflectance_sampling_rate", .status = PARAM_IGNORED},
		       {.name = "main_specular_sampling_rate", .status = PARAM_IGNORED},
		       {.name = "clearcoat_sampling_rate", .status = PARAM_IGNORED}),
	.data_size = sizeof(struct principled),
	.create = principled_create,
	.eval = principled_eval,
	.pdf_solid = principled_pdf,
	.sample = principled_sample,
};
