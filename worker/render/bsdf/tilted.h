/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Materials with parts whose bump or normal maps differ. A surface has one shading normal, which defines its half
 * vectors: that of the part with the narrowest lobe. Every other part scatters in its own shading frame.
 */
#ifndef WORKER_RENDER_BSDF_TILTED_H
#define WORKER_RENDER_BSDF_TILTED_H

#include "worker/render/bsdf/bsdf.h"

/* Gives b the relief of its narrowest part, and wraps the parts that have another one. -ENOTSUP if one of these has a
 * specular lobe; -ENOMEM. */
int bsdf_share_relief(struct bsdf *b, struct bsdf *part, uint32_t count, const struct scene_node *n,
		      const struct bsdf_build *build, struct error *e);

#endif
