/* SPDX-License-Identifier: Apache-2.0 */
/* Microfacets whose roughness may come from textures. Private to worker/render/bsdf. */
#ifndef WORKER_RENDER_BSDF_ROUGH_MAP_H
#define WORKER_RENDER_BSDF_ROUGH_MAP_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/microfacet.h"

struct rough_map {
	struct microfacet narrowest_facets; /* if `is_textured`, those of the smallest roughness that bsdf_probe_point
					       finds: step sizes depend on it */
	double max_alpha;		    /* if `is_textured`: the largest alpha_u found */
	bool is_textured;
	struct texture alpha_u, alpha_v; /* if `is_textured`: the roughness along u and v */
};

/* Reads alpha, alpha_u, alpha_v and distribution. Sets b's texture flags and roughness. Returns 0 or a negative error
 * code. */
int rough_map_read(struct rough_map *r, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		   struct error *e);
#define ROUGH_MAP_NUMBER(name_)                                                                   \
	{                                                                                         \
		.name = name_, .types = VALUE_FLOAT | VALUE_INT | VALUE_NODE, .min = 0, .max = 10 \
	}
#define ROUGH_MAP_PARAMS                                                                     \
	ROUGH_MAP_NUMBER("alpha"), ROUGH_MAP_NUMBER("alpha_u"), ROUGH_MAP_NUMBER("alpha_v"), \
		{.name = "distribution", .types = VALUE_STRING, .choices = "beckmann|ggx"},  \
	{                                                                                    \
		.name = "sample_visible", .types = VALUE_BOOL, .status = PARAM_IGNORED       \
	}

struct microfacet rough_map_eval(const struct rough_map *r, const struct bsdf_point *p);

static inline struct microfacet rough_map_at(const struct rough_map *r, const struct bsdf_point *p)
{
	return r->is_textured ? rough_map_eval(r, p) : r->narrowest_facets;
}

#endif
