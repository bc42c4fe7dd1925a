/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A matte surface of V-shaped grooves that reflects on the side of the normal: Oren and Nayar 1994, eqs. 30 and 31, or
 * only the first two terms with use_fast_approx (their sec. 4.4). sigma, the standard deviation of slopes, is alpha /
 * sqrt(2), so that alpha means the same as for Beckmann facets.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/diffuse.h"
#include "worker/render/bsdf/warp.h"

#include <float.h>

struct grooves {
	double c1, c2, c3, interreflection; /* C1, C2, C3, and the factor of light that is reflected twice */
};

struct roughdiffuse {
	struct texture reflectance, alpha;
	bool uses_fast_approx;
	struct grooves constant; /* valid unless alpha is a texture */
};

static struct grooves grooves_from_alpha(double alpha, bool fast)
{
	double s2 = 0.5 * alpha * alpha;
	return (struct grooves){1 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09),
				fast ? 0 : 0.125 * s2 / (s2 + 0.09), fast ? 0 : 0.17 * s2 / (s2 + 0.13)};
}

static struct grooves eval_grooves(const struct roughdiffuse *r, const struct bsdf_point *p)
{
	return r->alpha.ops
		       ? grooves_from_alpha(spectrum_mean(texture_eval(&r->alpha, &p->texture_point, p->wavelengths)),
					    r->uses_fast_approx)
		       : r->constant;
}

static double cube(double x)
{
	return x * x * x;
}

/* Returns x / y > 0, limited to DBL_MAX: it overflows if y, the cosine of a grazing direction, is nearly 0. */
static double clamped_ratio(double x, double y)
{
	return fmin(x / y, DBL_MAX);
}

/* Computes the factors of f = (direct rho + interreflected rho^2) / pi, with the reflectance rho. */
static void compute_factors(const struct grooves *r, vec3 wo, vec3 wi, double *direct, double *interreflected)
{
	double so = sqrt(fmax(1 - wo.z * wo.z, 0)), si = sqrt(fmax(1 - wi.z * wi.z, 0)), s = so * si;
	/* Cosine of the azimuths' difference. */
	double cos_azimuth = s > 0 ? fmin(fmax((wo.x * wi.x + wo.y * wi.y) / s, -1), 1) : 0;
	bool wo_is_lower = wo.z < wi.z; /* wo has the larger angle */
	double sine = wo_is_lower ? so : si, tangent = wo_is_lower ? clamped_ratio(si, wi.z) : clamped_ratio(so, wo.z);
	if (r->c3 == 0) {
		*direct = r->c1 + r->c2 * fmax(cos_azimuth, 0) * sine * tangent;
		*interreflected = 0;
		return;
	}
	double alpha = acos(fmin(wo_is_lower ? wo.z : wi.z, 1)), beta = acos(fmin(wo_is_lower ? wi.z : wo.z, 1));
	double b = r->c2 * (cos_azimuth > 0 ? sine : sine - cube(2 * beta / WARP_PI));
	double q = 4 * alpha * beta / (WARP_PI * WARP_PI),
	       half = clamped_ratio(so + si, wo.z + wi.z); /* tan((alpha + beta) / 2) */
	*direct = r->c1 + cos_azimuth * b * tangent + (1 - fabs(cos_azimuth)) * r->c3 * q * q * half;
	*interreflected = r->interreflection * (1 - cos_azimuth * (2 * beta / WARP_PI) * (2 * beta / WARP_PI));
}

static spectrum roughdiffuse_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughdiffuse *r = b->data;
	double direct, interreflected;
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_constant(0);
	struct grooves g = eval_grooves(r, p);
	compute_factors(&g, wo, wi, &direct, &interreflected);
	spectrum rho = texture_eval(&r->reflectance, &p->texture_point, p->wavelengths);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		rho.v[i] = fmax(rho.v[i] * (direct + interreflected * rho.v[i]), 0) / WARP_PI;
	return rho;
}

static int roughdiffuse_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			       struct error *e)
{
	struct roughdiffuse *r = b->data;
	int code = node_ref(n, "alpha") ? bsdf_read_number(b, &r->alpha, n, "alpha", 0.2, build, e) : 0;
	if (code)
		return code;
	r->uses_fast_approx = node_bool(n, "use_fast_approx", false);
	r->constant = grooves_from_alpha(node_ref(n, "alpha") ? 0 : node_float(n, "alpha", 0.2), r->uses_fast_approx);
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	b->mean_alpha = 1;
	code = bsdf_read_texture(b, &r->reflectance, n, "reflectance", 0.5, build, e);
	b->is_black = !code && texture_max(&r->reflectance) == 0;
	return code;
}

const struct bsdf_ops bsdf_ops_roughdiffuse = {
	.decl = PLUGIN(BSDF, "roughdiffuse", {.name = "reflectance", .types = VALUE_TEXTURE, .max = 1},
		       {.name = "alpha", .types = VALUE_FLOAT | VALUE_INT | VALUE_NODE, .min = 0, .max = 1},
		       {.name = "use_fast_approx", .types = VALUE_BOOL}),
	.data_size = sizeof(struct roughdiffuse),
	.create = roughdiffuse_create,
	.eval = roughdiffuse_eval,
	.pdf_solid = diffuse_pdf,
	.sample = diffuse_sample,
};
