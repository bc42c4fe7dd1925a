/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A specular lobe that lets light through without bending it, all that a filter does not absorb: the only lobe of
 * `null`, `polarizer`, `circular` and `retarder`, and the holes of a `mask`.
 *
 * Light is unpolarised here. As in the unpolarised modes of Mitsuba, both polarizers then let half of it through, at
 * any angle to each other, and a retarder all of it.
 */
#ifndef WORKER_RENDER_BSDF_STRAIGHT_H
#define WORKER_RENDER_BSDF_STRAIGHT_H

#include "worker/render/bsdf/create.h"

struct filter {
	struct texture transmittance;
	double share;
};

extern const struct bsdf_ops bsdf_ops_null;

/* A filter lets `share` times the texture `transmittance` through. */
int straight_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, double share,
		    struct error *e);
spectrum straight_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			     double *chance);
bool straight_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		     struct bsdf_sample *out);

/* The operations of a filter NAME, which defines NAME_params and NAME_create. */
#define STRAIGHT_OPS(NAME)                                                        \
	const struct bsdf_ops bsdf_ops_##NAME = {                                 \
		.decl = {PLUGIN_BSDF, #NAME, NAME##_params, 0, PARAM_UNDERSTOOD}, \
		.data_size = sizeof(struct filter),                               \
		.create = NAME##_create,                                          \
		.eval = bsdf_no_eval,                                             \
		.pdf_solid = bsdf_no_pdf,                                         \
		.eval_delta = straight_eval_delta,                                \
		.sample = straight_sample,                                        \
	}

#endif
