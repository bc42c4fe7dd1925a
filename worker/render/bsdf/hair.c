/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Hair and fur: an absorbing dielectric fibre after Chiang et al. 2016 (hair_lobes.c), with the parameters, defaults
 * and conventions of Mitsuba 3's plug-in. One scattering event, at the point where light arrives, stands for everything
 * that happens inside the fibre. For light from wi to a camera in direction wo,
 *
 *   f |wi.z| = sum_p M_p(theta_wo, theta_wi) A_p(theta_wo, h) N_p(phi_wi - phi_wo)
 *
 * where the y axis, n x dp/du, runs along the fibre, theta is the angle between a direction and the xz plane, phi the
 * azimuth in that plane, and wo passes the axis of the fibre at a distance of h = sin gamma = -wo.x / cos theta radii.
 * The offset h therefore follows from the normal, whatever the shape is; a shape that is not a fibre scatters as if
 * there were a thin fibre at each of its points. A_p depends on the absorption, per radius of the fibre. The
 * coefficients of melanin are Rec. 709 colours and become spectra like those of media: divided by twice their maximum,
 * upsampled as reflectances, and multiplied again.
 *
 * Light scatters to both sides of the surface, so light that enters the fibre has to leave it again without another
 * event: seen from inside, the surface does not exist. Curves ignore rays from inside (bsdf.culls_backfaces), as
 * Mitsuba's do, so that the fibre around a vertex does not block the connection to an emitter. A vertex scatters only
 * if the camera's side of the path meets it from outside; paths from a light therefore find only reflected light, and
 * paths from the camera and connections find the rest. Other shapes, and curves that are meshes, have a specular lobe
 * on their back that passes light straight on; it counts as an edge of the path, and next event estimation does not
 * look through it. On these shapes, a path from a light that arrives from outside cannot know whether the camera sees
 * this surface or one behind it: half of these paths pass straight through, to scatter where the light leaves.
 *
 * f is not reciprocal, because h belongs to the direction of the camera. Importance is radiance with the directions
 * exchanged, as everywhere (bsdf.h). Sampling importance draws theta from M, which is symmetric, and phi in proportion
 * to the cosine; half of lobe 0 draws phi from N around the mirror direction instead. This density ignores absorption.
 * Sampling radiance chooses lobe p in proportion to the mean of A_p over a fixed set of wavelengths, plus a small share
 * of A_p without absorption, so that no lobe with light at some wavelength is missed.
 *
 * Creation fails if both pigments and sigma_a are given, if the indices are equal, or if a value is out of range.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/hair_lobes.h"
#include "worker/render/bsdf/ior.h"
#include "worker/render/bsdf/warp.h"
#include "worker/render/math/minmax.h"

#include <float.h>

#define RADIANS_PER_DEGREE (WARP_PI / 180)
#define IOR_AMBER 1.55

/* The smallest cosine: its inverse times the density of the narrowest lobe is finite. */
#define COSINE_MIN 0x1p-900

/* Weight of the shares without absorption in the choice of a lobe. */
#define UNABSORBED_WEIGHT 0x1p-6

/* For importance that arrives from outside: the probability of passing straight through, and those of choosing each
 * lobe. */
#define STRAIGHT_CHANCE 0.5
static const double adjoint_probability[HAIR_LOBES] = {0.3, 0.4, 0.2, 0.1};

struct hair {
	struct hair_fibre fibre;
	bool uses_pigments;		     /* absorption is given by the two pigments, not by sigma_a */
	struct color eumelanin, pheomelanin; /* coefficients times concentrations */
	struct texture sigma_a;
	double scale; /* factor of sigma_a */
	/* Absorption at the wavelengths `probe_wavelengths`; unused if sigma_a is textured. */
	spectrum probe_absorption;
};

/* The wavelengths at which lobes are weighted. They are fixed: a density that depended on the wavelengths of the path
 * would couple them. */
static const struct wavelengths probe_wavelengths = {.nm = {450, 520, 580, 640}};

static spectrum eval_absorption(const struct hair *h, const struct texture_point *point, const struct wavelengths *w)
{
	if (h->uses_pigments)
		return spectrum_add(color_eval(&h->eumelanin, w), color_eval(&h->pheomelanin, w));
	return spectrum_scale(h->scale, texture_eval(&h->sigma_a, point, w));
}

static spectrum absorption_for_sampling(const struct hair *h, const struct bsdf_point *p)
{
	if (WAVELENGTHS_GREY(p->wavelengths) || p->wavelengths->is_rgb)
		return eval_absorption(h, &p->texture_point, p->wavelengths);
	return h->uses_pigments || texture_is_constant(&h->sigma_a)
		       ? h->probe_absorption
		       : eval_absorption(h, &p->texture_point, &probe_wavelengths);
}

/* The spherical coordinates of a direction. */
struct angles {
	struct hair_angle theta;
	double phi;
};

static struct angles angles_from_direction(vec3 w)
{
	return (struct angles){{w.y, hypot(w.x, w.z)}, atan2(w.z, w.x)};
}

static vec3 direction_from_angles(struct hair_angle theta, double cos_phi, double sin_phi)
{
	return vec3_normalize((vec3){theta.cos * cos_phi, theta.sin, theta.cos * sin_phi});
}

/* The direction to the camera, and how its ray enters the fibre. */
struct view {
	struct angles angles;
	double gamma;
	struct hair_entry entry;
};

static struct view view_from(const struct hair *h, vec3 camera)
{
	struct view s = {.gamma = -atan2(camera.x, camera.z), .entry = hair_enter(&h->fibre, camera.x, camera.z)};
	s.angles = (struct angles){{camera.y, hypot(camera.x, camera.z)}, s.gamma + WARP_PI / 2};
	return s;
}

/* Computes M_p N_p of each lobe. */
static void eval_lobes(const struct hair *h, const struct view *s, vec3 light, double lobe[HAIR_LOBES])
{
	struct angles light_angles = angles_from_direction(light);
	for (int p = 0; p < HAIR_LOBES; p++) {
		double azimuth_offset =
			light_angles.phi - s->angles.phi - hair_azimuth_change(p, s->gamma, s->entry.gamma_t);
		double azimuthal =
			p < HAIR_LOBES - 1 ? hair_azimuthal_pdf(&h->fibre, azimuth_offset) : 1 / (2 * WARP_PI);
		lobe[p] = hair_longitudinal_pdf(&h->fibre, p, s->angles.theta, light_angles.theta) * azimuthal;
	}
}

/* Returns f |light.z| for a camera outside the fibre. */
static spectrum eval_scattering(const struct hair *h, const struct bsdf_point *p, vec3 camera, vec3 light)
{
	struct view s = view_from(h, camera);
	spectrum sigma = eval_absorption(h, &p->texture_point, p->wavelengths), sum = spectrum_constant(0);
	double lobe[HAIR_LOBES], share[HAIR_LOBES];
	eval_lobes(h, &s, light, lobe);
	for (int l = 0; l < SPECTRUM_LANES; l++) {
		hair_lobe_shares(&s.entry, exp(-sigma.v[l] * s.entry.passage_length), share);
		for (int k = 0; k < HAIR_LOBES; k++)
			sum.v[l] += share[k] * lobe[k];
	}
	return sum;
}

static spectrum hair_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	bool is_radiance = p->transport == TRANSPORT_RADIANCE;
	vec3 camera = is_radiance ? wo : wi, light = is_radiance ? wi : wo;
	if (!(camera.z > 0 && fabs(light.z) >= COSINE_MIN))
		return spectrum_constant(0);
	return spectrum_scale(1 / fabs(light.z), eval_scattering(b->data, p, camera, light));
}

static void compute_lobe_probabilities(const struct hair *h, const struct bsdf_point *p, const struct view *s,
				       double probability[HAIR_LOBES])
{
	spectrum sigma = absorption_for_sampling(h, p);
	double share[HAIR_LOBES], sum = 0;
	hair_lobe_shares(&s->entry, 1, probability);
	for (int k = 0; k < HAIR_LOBES; k++)
		probability[k] *= UNABSORBED_WEIGHT;
	for (int l = 0; l < SPECTRUM_LANES; l++) {
		hair_lobe_shares(&s->entry, exp(-sigma.v[l] * s->entry.passage_length), share);
		for (int k = 0; k < HAIR_LOBES; k++)
			probability[k] += share[k];
	}
	for (int k = 0; k < HAIR_LOBES; k++)
		sum += probability[k];
	for (int k = 0; k < HAIR_LOBES; k++)
		probability[k] /= sum;
}

/* Returns the density (solid angle) with which a path from a light continues towards a camera. */
static double adjoint_pdf(const struct hair *h, bool culls_backfaces, vec3 light, vec3 camera)
{
	struct angles light_angles = angles_from_direction(light), camera_angles = angles_from_direction(camera);
	double sum = 0, cosine = 0.5 * camera.z / camera_angles.theta.cos;
	for (int p = 0; p < HAIR_LOBES; p++) {
		double azimuthal = cosine;
		if (p == 0 && light.z > 0)
			azimuthal = 0.5 * (cosine + hair_azimuthal_pdf(&h->fibre,
								       camera_angles.phi + light_angles.phi - WARP_PI));
		sum += adjoint_probability[p] *
		       hair_longitudinal_pdf(&h->fibre, p, light_angles.theta, camera_angles.theta) * azimuthal;
	}
	return light.z > 0 && !culls_backfaces ? (1 - STRAIGHT_CHANCE) * sum : sum;
}

static double hair_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct hair *h = b->data;
	double probability[HAIR_LOBES], lobe[HAIR_LOBES], sum = 0;
	if (p->transport == TRANSPORT_IMPORTANCE)
		return wi.z > 0 && fabs(wo.z) >= COSINE_MIN ? adjoint_pdf(h, p->culls_backfaces, wo, wi) : 0;
	if (!(wo.z > 0 && fabs(wi.z) >= COSINE_MIN))
		return 0;
	struct view s = view_from(h, wo);
	compute_lobe_probabilities(h, p, &s, probability);
	eval_lobes(h, &s, wi, lobe);
	for (int k = 0; k < HAIR_LOBES; k++)
		sum += probability[k] * lobe[k];
	return sum;
}

/* Returns the index of the interval of cumulative probability that *u falls in, and rescales *u to be uniform again. */
static int pick_index(const double *probability, int count, double *u)
{
	int k = 0;
	while (k + 1 < count && *u >= probability[k])
		*u -= probability[k++];
	*u = probability[k] > 0 ? min_of(*u / probability[k], 1 - 0x1p-53) : 0;
	return k;
}

static vec3 sample_radiance(const struct hair *h, const struct bsdf_point *p, vec3 wo, const double u[3])
{
	struct view s = view_from(h, wo);
	double probability[HAIR_LOBES], rest = u[2];
	compute_lobe_probabilities(h, p, &s, probability);
	int k = pick_index(probability, HAIR_LOBES, &rest);
	double azimuth_change = k < HAIR_LOBES - 1 ? hair_azimuth_change(k, s.gamma, s.entry.gamma_t) +
							     hair_sample_azimuthal(&h->fibre, rest)
						   : 2 * WARP_PI * rest;
	double phi = s.angles.phi + azimuth_change;
	return direction_from_angles(hair_sample_longitudinal(&h->fibre, k, s.angles.theta, u[0], u[1]), cos(phi),
				     sin(phi));
}

static vec3 sample_importance(const struct hair *h, vec3 wo, const double u[2], double rest)
{
	static const double halves[2] = {0.5, 0.5};
	struct angles light_angles = angles_from_direction(wo);
	int k = pick_index(adjoint_probability, HAIR_LOBES, &rest);
	struct hair_angle theta = hair_sample_longitudinal(&h->fibre, k, light_angles.theta, u[0], u[1]);
	if (k == 0 && wo.z > 0 && pick_index(halves, 2, &rest) == 0) {
		double phi = WARP_PI - light_angles.phi + hair_sample_azimuthal(&h->fibre, rest);
		return direction_from_angles(theta, cos(phi), sin(phi));
	}
	return direction_from_angles(theta, 1 - 2 * rest, 2 * sqrt(rest * (1 - rest)));
}

static bool can_pass_straight(const struct bsdf_point *p, vec3 wo)
{
	return !p->culls_backfaces && (p->transport == TRANSPORT_RADIANCE ? wo.z <= -DBL_MIN : wo.z >= DBL_MIN);
}

static spectrum hair_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				double *probability)
{
	(void)b;
	if (!(mode & BSDF_STRAIGHT) || !can_pass_straight(p, wo))
		return spectrum_constant(0);
	*wi = vec3_neg(wo);
	*probability = p->transport == TRANSPORT_RADIANCE ? 1 : STRAIGHT_CHANCE;
	return spectrum_constant(1);
}

static bool hair_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	const struct hair *h = b->data;
	bool is_radiance = p->transport == TRANSPORT_RADIANCE;
	double rest = u[2];
	if (can_pass_straight(p, wo)) {
		static const double branch_probability[2] = {STRAIGHT_CHANCE, 1 - STRAIGHT_CHANCE};
		if (is_radiance || pick_index(branch_probability, 2, &rest) == 0)
			return bsdf_sample_delta(b, p, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, out);
	} else if (!(is_radiance || p->culls_backfaces ? wo.z >= COSINE_MIN : wo.z < 0)) {
		return false;
	}
	return bsdf_sample_smooth(b, p, wo,
				  is_radiance ? sample_radiance(h, p, wo, u) : sample_importance(h, wo, u, rest), out);
}

/* Sets a pigment's coefficients, given per unit of concentration (d'Eon 2011, sec. 6.1). */
static int set_pigment(struct color *c, const double rgb[3], double concentration)
{
	int code = color_from_rgb(rgb, COLOR_UNBOUNDED, c);
	c->scale *= concentration;
	return code;
}

static int read_absorption(struct hair *h, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			   struct error *e)
{
	static const double eumelanin[3] = {0.419, 0.697, 1.37}, pheomelanin[3] = {0.187, 0.4, 1.05};
	h->uses_pigments = !node_find_property(n, "sigma_a");
	h->scale = node_float(n, "scale", 1);
	if (!h->uses_pigments) {
		const struct texture_build texture_build = bsdf_texture_build(build);
		if (node_find_property(n, "eumelanin") || node_find_property(n, "pheomelanin"))
			return node_error(
				n, e, EINVAL,
				"sigma_a and the pigments eumelanin and pheomelanin exclude each other; give one or the other");
		int code = texture_from_node(&h->sigma_a, n, "sigma_a", 0, COLOR_UNBOUNDED, &texture_build, e);
		if (code)
			return code;
		b->is_textured = !texture_is_constant(&h->sigma_a);
		bsdf_add_color_kind(b, texture_color_kind(&h->sigma_a));
	} else {
		int code = set_pigment(&h->eumelanin, eumelanin, node_float(n, "eumelanin", 1.3));
		if (!code)
			code = set_pigment(&h->pheomelanin, pheomelanin, node_float(n, "pheomelanin", 0.2));
		if (code)
			return node_error(n, e, -code, "pigments");
		bsdf_add_color_kind(b, COLOR_KIND_OTHER);
	}
	const struct texture_point probe_point = {.is_probe = true};
	if (h->uses_pigments || texture_is_constant(&h->sigma_a))
		h->probe_absorption = eval_absorption(h, &probe_point, &probe_wavelengths);
	return 0;
}

static int hair_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct hair *h = b->data;
	double inside, outside;
	int code = ior_read(n, "int_ior", IOR_AMBER, &inside, e);
	if (!code)
		code = ior_read(n, "ext_ior", IOR_AIR_DEFAULT, &outside, e);
	if (code)
		return code;
	if (inside == outside)
		return node_error(n, e, EINVAL, "int_ior and ext_ior must differ");
	hair_fibre_init(&h->fibre, inside / outside, node_float(n, "longitudinal_roughness", 0.3),
			node_float(n, "azimuthal_roughness", 0.3), RADIANS_PER_DEGREE * node_float(n, "scale_tilt", 2));
	b->modes = BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT;
	b->has_smooth = b->has_delta = true;
	b->is_two_sided = true;
	b->is_nonreciprocal = true;
	b->culls_backfaces = true;
	b->uses_tangents = true;
	b->mean_alpha = 1;
	return read_absorption(h, b, n, build, e);
}

const struct bsdf_ops bsdf_ops_hair = {
	.decl = PLUGIN(
		BSDF, "hair", {.name = "longitudinal_roughness", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1},
		{.name = "azimuthal_roughness", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1},
		{.name = "scale_tilt", .types = VALUE_FLOAT | VALUE_INT, .min = -90, .max = 90}, IOR_NUMBER("int_ior"),
		IOR_NUMBER("ext_ior"), {.name = "eumelanin", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1e9},
		{.name = "pheomelanin", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1e9},
		{.name = "sigma_a", .types = VALUE_TEXTURE, .min = 0, .max = 1e9},
		{.name = "scale", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1e9}),
	.data_size = sizeof(struct hair),
	.create = hair_create,
	.eval = hair_eval,
	.pdf_solid = hair_pdf,
	.eval_delta = hair_eval_delta,
	.sample = hair_sample,
};
