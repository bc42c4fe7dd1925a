/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Several BSDFs, each with a share of the light: `blendbsdf` two by a weight, `mixturebsdf` any number by fixed
 * weights, `mask` one and what passes it by.
 *
 * A surface has one index of refraction, and specular lobes of the same mode must have the same direction: parts that
 * transmit must have the same index unless all they transmit passes straight through, and none may be dispersive.
 */
#ifndef WORKER_RENDER_BSDF_BLEND_H
#define WORKER_RENDER_BSDF_BLEND_H

#include "worker/render/bsdf/create.h"

enum { BLEND_PARTS_MAX = 16 };

struct blend {
	uint32_t count;
	struct bsdf part[BLEND_PARTS_MAX];
	struct texture weight; /* of two parts */
	bool weight_of_first;  /* else of the second */
	bool is_fixed;	       /* weights are these: */
	double fixed[BLEND_PARTS_MAX];
};

/* b->data: a blend of `count` parts, which are not made yet. */
struct blend *blend_begin(struct bsdf *b, uint32_t count);
/* Makes each part from the BSDF inside n, and joins it. */
int blend_read_parts(struct blend *m, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		     struct error *e);
/* Merges the properties of a part, of the type `type`, into b, if it is compatible with those before it. */
int blend_join(struct bsdf *b, const struct bsdf *part, const char *type, const struct scene_node *n, struct error *e);

spectrum blend_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
double blend_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
spectrum blend_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
spectrum blend_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			  double *chance);
bool blend_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		  struct bsdf_sample *out);

/* The operations of a blend NAME, which defines NAME_create; then its parameters. */
#define BLEND_OPS(NAME, ...)                                                                           \
	const struct bsdf_ops bsdf_ops_##NAME = {                                                      \
		.decl = {PLUGIN_BSDF, #NAME, PARAMS(__VA_ARGS__), 1 << PLUGIN_BSDF, PARAM_UNDERSTOOD}, \
		.data_size = sizeof(struct blend),                                                     \
		.create = NAME##_create,                                                               \
		.eval = blend_eval,                                                                    \
		.pdf_solid = blend_pdf,                                                                \
		.eval_halfvec = blend_eval_halfvec,                                                    \
		.eval_delta = blend_eval_delta,                                                        \
		.sample = blend_sample,                                                                \
	}

#endif
