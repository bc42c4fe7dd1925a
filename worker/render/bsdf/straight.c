/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A specular lobe that lets light pass without refraction, except for the share that a filter absorbs: the only lobe of
 * `null`, `polarizer`, `circular` and `retarder`, and the holes of a `mask`. It counts as an edge of the path.
 * Connections look through it (path/transparent.h).
 *
 * Light is treated as unpolarised. As in Mitsuba's unpolarised modes, each polarizer therefore transmits half of the
 * light, whatever the angle between two of them, and a retarder transmits all of it.
 */
#include "worker/render/bsdf/create.h"

#include <float.h>

struct filter {
	struct texture transmittance;
	double transmitted_share; /* share of light that passes, a factor of the texture */
};

/* Returns false if 1 / |wo.z| is not finite. */
static bool pass_straight(vec3 wo, vec3 *wi)
{
	*wi = vec3_neg(wo);
	return fabs(wo.z) >= DBL_MIN;
}

static spectrum straight_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				    double *probability)
{
	const struct filter *f = b->data;
	if (!(mode & BSDF_TRANSMIT) || !pass_straight(wo, wi))
		return spectrum_constant(0);
	*probability = 1;
	return spectrum_scale(f->transmitted_share, texture_eval(&f->transmittance, &p->texture_point, p->wavelengths));
}

static bool straight_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			    struct bsdf_sample *out)
{
	(void)u;
	return bsdf_sample_delta(b, p, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, out);
}

static int create_filter(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, double share,
			 struct error *e)
{
	struct filter *f = b->data;
	int code = bsdf_read_texture(b, &f->transmittance, n, "transmittance", 1, build, e);
	if (code)
		return code;
	f->transmitted_share = share;
	b->modes = BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT;
	b->is_straight_transmitter = true;
	b->has_delta = true;
	b->is_two_sided = true;
	b->min_alpha = b->mean_alpha = 0;
	b->is_black = texture_max(&f->transmittance) == 0;
	return 0;
}

static int create_half_filter(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			      struct error *e)
{
	return create_filter(b, n, build, 0.5, e);
}

static int create_full_filter(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			      struct error *e)
{
	return create_filter(b, n, build, 1, e);
}

static int null_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	b->is_see_through = true;
	return create_filter(b, n, build, 1, e);
}

#define STRAIGHT_OPS(NAME, CREATE, PARAMETERS)                                 \
	const struct bsdf_ops bsdf_ops_##NAME = {                              \
		.decl = {PLUGIN_BSDF, #NAME, PARAMETERS, 0, PARAM_UNDERSTOOD}, \
		.data_size = sizeof(struct filter),                            \
		.create = CREATE,                                              \
		.eval = bsdf_eval_zero,                                        \
		.pdf_solid = bsdf_pdf_zero,                                    \
		.eval_delta = straight_eval_delta,                             \
		.sample = straight_sample,                                     \
	}
STRAIGHT_OPS(null, null_create, NULL);
STRAIGHT_OPS(polarizer, create_half_filter,
	     PARAMS({.name = "transmittance", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		    {.name = "theta", .status = PARAM_IGNORED}, {.name = "polarizing", .status = PARAM_IGNORED}));
STRAIGHT_OPS(circular, create_half_filter,
	     PARAMS({.name = "transmittance", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		    {.name = "left_handed", .status = PARAM_IGNORED}));
STRAIGHT_OPS(retarder, create_full_filter,
	     PARAMS({.name = "theta", .status = PARAM_IGNORED}, {.name = "delta", .status = PARAM_IGNORED}));
