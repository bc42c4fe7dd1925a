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

/* b, whose data begins as that of `ops` does, has no lobes but exactly specular ones. */
void bsdf_make_smooth(struct bsdf *b, const struct bsdf_ops *ops);

/* b takes the relief of its part: a surface has one normal. -ENOTSUP where b has another already. first: no part came
 * before. */
int bsdf_take_relief(struct bsdf *b, const struct bsdf *part, bool first, const struct scene_node *n, struct error *e);

/* Enters that a part of b has this colour. */
void bsdf_add_shape(struct bsdf *b, enum color_shape shape);

#endif
