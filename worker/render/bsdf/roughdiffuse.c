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
	double a, b, c, d; /* C1, C2, C3, and the factor of light that is reflected twice */
};

struct roughdiffuse {
	struct texture reflectance, alpha;
	bool fast;
	struct grooves known; /* valid unless alpha is a texture */
};

static struct grooves grooves_of(double alpha, bool fast)
{
	double s2 = 0.5 * alpha * alpha;
	return (struct grooves){1 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09),
				fast ? 0 : 0.125 * s2 / (s2 + 0.09), fast ? 0 : 0.17 * s2 / (s2 + 0.13)};
}

static struct grooves grooves_at(const struct roughdiffuse *r, const struct bsdf_point *p)
{
	return r->alpha.ops ? grooves_of(spectrum_mean(texture_eval(&r->alpha, &p->where, p->w)), r->fast) : r->known;
}

static double cube(double x)
{
	return x * x * x;
}

/* Returns x / y > 0, limited to DBL_MAX: it overflows if y, the cosine of a grazing direction, is nearly 0. */
static double ratio(double x, double y)
{
	return fmin(x / y, DBL_MAX);
}

/* Computes the factors of f = (once rho + twice rho^2) / pi, with the reflectance rho. */
static void factors(const struct grooves *r, vec3 wo, vec3 wi, double *once, double *twice)
{
	double so = sqrt(fmax(1 - wo.z * wo.z, 0)), si = sqrt(fmax(1 - wi.z * wi.z, 0)), s = so * si;
	double across =
		s > 0 ? fmin(fmax((wo.x * wi.x + wo.y * wi.y) / s, -1), 1) : 0; /* cosine of the azimuths' difference */
	bool lower = wo.z < wi.z;						/* wo has the larger angle */
	double sine = lower ? so : si, tangent = lower ? ratio(si, wi.z) : ratio(so, wo.z);
	if (r->c == 0) {
		*once = r->a + r->b * fmax(across, 0) * sine * tangent;
		*twice = 0;
		return;
	}
	double alpha = acos(fmin(lower ? wo.z : wi.z, 1)), beta = acos(fmin(lower ? wi.z : wo.z, 1));
	double b = r->b * (across > 0 ? sine : sine - cube(2 * beta / WARP_PI));
	double q = 4 * alpha * beta / (WARP_PI * WARP_PI),
	       half = ratio(so + si, wo.z + wi.z); /* tan((alpha + beta) / 2) */
	*once = r->a + across * b * tangent + (1 - fabs(across)) * r->c * q * q * half;
	*twice = r->d * (1 - across * (2 * beta / WARP_PI) * (2 * beta / WARP_PI));
}

static spectrum roughdiffuse_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughdiffuse *r = b->data;
	double once, twice;
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_of(0);
	struct grooves g = grooves_at(r, p);
	factors(&g, wo, wi, &once, &twice);
	spectrum rho = texture_eval(&r->reflectance, &p->where, p->w);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		rho.v[i] = fmax(rho.v[i] * (once + twice * rho.v[i]), 0) / WARP_PI;
	return rho;
}

static int roughdiffuse_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			       struct error *e)
{
	struct roughdiffuse *r = b->data;
	int code = node_ref(n, "alpha") ? bsdf_number(b, &r->alpha, n, "alpha", 0.2, build, e) : 0;
	if (code)
		return code;
	r->fast = node_bool(n, "use_fast_approx", false);
	r->known = grooves_of(node_ref(n, "alpha") ? 0 : node_float(n, "alpha", 0.2), r->fast);
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	b->alpha_mean = 1;
	code = bsdf_texture(b, &r->reflectance, n, "reflectance", 0.5, build, e);
	b->black = !code && texture_max(&r->reflectance) == 0;
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
