/* SPDX-License-Identifier: Apache-2.0 */
/* What the creation of every BSDF shares. Private to worker/render/bsdf. */
#ifndef WORKER_RENDER_BSDF_CREATE_H
#define WORKER_RENDER_BSDF_CREATE_H

#include "worker/render/bsdf/bsdf.h"

/* Zeroed room for b->data; NULL after an error. */
void *bsdf_data(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, size_t size,
		struct error *e);

/* Reads a reflectance and enters its colour and texture into b. */
int bsdf_texture(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		 const struct bsdf_build *build, struct error *e);

/*
 * Places at which textures are looked up to learn their range: a grid over (u,v), and along with it the corners of the
 * mesh's triangles, one after the other. An attribute is largest and least at a corner, so that up to
 * BSDF_PROBES_MAX / 3 triangles its range is exact; beyond, corners are left out evenly.
 */
enum { BSDF_PROBES_MAX = 3 << 18 };
struct bsdf_probes {
	uint32_t count;
	uint64_t corners; /* of the mesh; 0: none of its attributes was looked up */
};
struct bsdf_probes bsdf_probes_of(const struct bsdf_build *build);
struct bsdf_point bsdf_probe(const struct bsdf_probes *p, uint32_t i);

/* b, whose data begins as that of `ops` does, has no lobes but exactly specular ones. */
void bsdf_make_smooth(struct bsdf *b, const struct bsdf_ops *ops);

/* b takes the relief of its part: a surface has one normal. -ENOTSUP where b has another already. first: no part came
 * before. */
int bsdf_take_relief(struct bsdf *b, const struct bsdf *part, bool first, const struct scene_node *n, struct error *e);

/* Enters that a part of b has this colour. */
void bsdf_add_shape(struct bsdf *b, enum color_shape shape);

/* 0.6 lets whoever wants it keep reflectances that add up to more than 1 as they are. `sum` is what they add up to;
 * -ERANGE where it exceeds 1 and the node asks for that. Of other BSDFs the parameter has no effect (scene.c). */
#define BSDF_ENERGY_PARAM                                                 \
	{                                                                 \
		.name = "ensure_energy_conservation", .types = VALUE_BOOL \
	}
int bsdf_check_energy(const struct scene_node *n, double sum, struct error *e);

#endif
