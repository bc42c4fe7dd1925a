/* SPDX-License-Identifier: Apache-2.0 */
/*
 * BSDFs that share the light: `blendbsdf` mixes two by a weight, `mixturebsdf` any number by fixed weights, `mask`
 * mixes one with the light that passes it straight through.
 *
 * A surface has one index of refraction, and specular lobes of the same mode must have the same direction. Parts that
 * transmit must therefore have the same index, unless all the light that they transmit passes straight through; and
 * none of them may be dispersive.
 */
#ifndef WORKER_RENDER_BSDF_BLEND_H
#define WORKER_RENDER_BSDF_BLEND_H

#include "worker/render/bsdf/create.h"

enum { BLEND_PARTS_MAX = 16 };

struct blend {
	uint32_t count;
	struct bsdf part[BLEND_PARTS_MAX];
	struct texture weight;	 /* weight of one of two parts; the other part has the rest */
	bool is_weight_of_first; /* the weight is that of the first part, otherwise that of the second */
	bool has_fixed_weights;	 /* the parts have the constant weights `fixed_weight` instead of `weight` */
	double fixed_weight[BLEND_PARTS_MAX];
};

/* Returns b->data as a blend of `count` parts, which the caller has yet to create. Never fails. */
struct blend *blend_begin(struct bsdf *b, uint32_t count);
/* Creates each part from a BSDF nested in n, and joins it to b. Returns 0, or the negative error code of a part. */
int blend_read_parts(struct blend *m, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		     struct error *e);
/* Merges the properties of a part of the given type into b. -ENOTSUP if the part is dispersive, or if its index of
 * refraction differs from that of the parts before it. */
int blend_merge_part(struct bsdf *b, const struct bsdf *part, const char *type, const struct scene_node *n,
		     struct error *e);

spectrum blend_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
double blend_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
spectrum blend_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
spectrum blend_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			  double *probability);
bool blend_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		  struct bsdf_sample *out);

/* Defines the operations of the blend NAME, whose function NAME_create the source defines; the parameters of the
 * plug-in follow. */
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
