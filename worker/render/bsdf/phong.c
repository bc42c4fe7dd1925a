/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Phong's lobe in its reciprocal, normalised form (Lafortune and Willems 1994), over a diffuse base. If the two
 * reflectances can add up to more than 1, both are scaled by 0.99 over their sum, as in Mitsuba 0.6.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/warp.h"
#include "worker/render/math/frame.h"

#define EXPONENT_MAX 1e9

struct phong {
	struct texture diffuse, specular;
	struct texture exponent;     /* no spectrum; at most EXPONENT_MAX */
	double scale;		     /* factor of both reflectances */
	double specular_probability; /* probability of sampling the specular lobe */
};

/* Returns the lobe without its normalisation; zero at more than 90 degrees from the mirror direction. */
static double unnormalized_lobe(double exponent, vec3 wo, vec3 wi)
{
	double c = wo.z * wi.z - wo.x * wi.x - wo.y * wi.y;
	return c > 0 ? pow(c, exponent) : 0;
}

static double exponent_at(const struct phong *ph, const struct bsdf_point *p)
{
	if (texture_is_constant(&ph->exponent))
		return ph->exponent.color.scale;
	return fmin(fmax(spectrum_mean(texture_eval(&ph->exponent, &p->texture_point, p->wavelengths)), 0),
		    EXPONENT_MAX);
}

static spectrum phong_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct phong *ph = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_constant(0);
	double exponent = exponent_at(ph, p),
	       lobe = (exponent + 2) / (2 * WARP_PI) * unnormalized_lobe(exponent, wo, wi);
	spectrum d = texture_eval(&ph->diffuse, &p->texture_point, p->wavelengths),
		 s = texture_eval(&ph->specular, &p->texture_point, p->wavelengths);
	return spectrum_scale(ph->scale, spectrum_add(spectrum_scale(1 / WARP_PI, d), spectrum_scale(lobe, s)));
}

static double phong_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct phong *ph = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return 0;
	double exponent = exponent_at(ph, p),
	       lobe = (exponent + 1) / (2 * WARP_PI) * unnormalized_lobe(exponent, wo, wi);
	return ph->specular_probability * lobe + (1 - ph->specular_probability) * wi.z / WARP_PI;
}

/* Samples a direction around the mirror direction of wo. */
static vec3 sample_lobe(double exponent, vec3 wo, double u0, double u1)
{
	double l = log1p(-u0) / (exponent + 1), c = exp(l), s = sqrt(-expm1(2 * l)), phi = 2 * WARP_PI * u1;
	struct frame f = frame_around((vec3){-wo.x, -wo.y, wo.z});
	return vec3_normalize(frame_to_world(&f, (vec3){s * cos(phi), s * sin(phi), c}));
}

static bool phong_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			 struct bsdf_sample *out)
{
	const struct phong *ph = b->data;
	if (!(wo.z > 0))
		return false;
	vec3 wi = u[2] < ph->specular_probability ? sample_lobe(exponent_at(ph, p), wo, u[0], u[1])
						  : warp_cosine_hemisphere(u[0], u[1]);
	return bsdf_sample_smooth(b, p, wo, wi, out);
}

/* Reads the exponent. *max_exponent: its largest value, which is that of the sharpest lobe. Returns 0 or a negative
 * error code. */
static int read_exponent(struct phong *ph, struct bsdf *b, double *max_exponent, const struct scene_node *n,
			 const struct bsdf_build *build, struct error *e)
{
	int code = bsdf_read_quantity(b, &ph->exponent, n, "exponent", 30, true, build, e);
	if (code)
		return code;
	if (!(texture_max(&ph->exponent) <= EXPONENT_MAX))
		return node_error(n, e, ERANGE, "exponent=%g is outside [0, %g]", texture_max(&ph->exponent),
				  EXPONENT_MAX);
	*max_exponent = fmax(bsdf_probe_range(&ph->exponent, build).max, 0);
	return 0;
}

static int phong_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct phong *ph = b->data;
	int code = bsdf_read_texture(b, &ph->diffuse, n, "diffuse_reflectance", 0.5, build, e);
	if (!code)
		code = bsdf_read_texture(b, &ph->specular, n, "specular_reflectance", 0.2, build, e);
	double exponent = 0;
	if (!code)
		code = read_exponent(ph, b, &exponent, n, build, e);
	if (code)
		return code;
	double d = texture_max(&ph->diffuse), s = texture_max(&ph->specular);
	b->is_black = d + s == 0;
	ph->scale = d + s > 1 ? 0.99 / (d + s) : 1;
	ph->specular_probability = d + s > 0 ? s / (d + s) : 0;
	code = bsdf_check_energy(n, d + s, e);
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	double alpha = sqrt(2 / (exponent + 2));
	b->min_alpha = s > 0 ? alpha : INFINITY;
	b->mean_alpha = ph->specular_probability * alpha + (1 - ph->specular_probability);
	return code;
}

const struct bsdf_ops bsdf_ops_phong = {
	.decl = PLUGIN(
		BSDF, "phong", {.name = "diffuse_reflectance", .types = VALUE_TEXTURE, .max = 1},
		{.name = "specular_reflectance", .types = VALUE_TEXTURE, .max = 1},
		{.name = "exponent", .types = VALUE_FLOAT | VALUE_INT | VALUE_NODE, .min = 0, .max = EXPONENT_MAX},
		BSDF_ENERGY_PARAM),
	.data_size = sizeof(struct phong),
	.create = phong_create,
	.eval = phong_eval,
	.pdf_solid = phong_pdf,
	.sample = phong_sample,
};
