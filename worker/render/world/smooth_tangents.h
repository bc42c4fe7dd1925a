/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tangents at the corners of triangles, interpolated for the shading frames of materials that use them. Without them,
 * each triangle has its own dp/du, and anisotropic highlights and normal maps show the facets. They are the tangents of
 * MikkTSpace (Mikkelsen 2008, Simulation of Wrinkled Surfaces Revisited), with which modelling programs make normal
 * maps and which glTF 2.0 prescribes (section 3.7.2.1): a weighted sum of the dp/du of the triangles at a vertex, each
 * projected into the plane of the vertex's normal and weighted by the triangle's angle at the vertex, separately for
 * triangles whose texture coordinates are mirrored. One thread; allocates in the world's arena.
 */
#ifndef WORKER_RENDER_WORLD_SMOOTH_TANGENTS_H
#define WORKER_RENDER_WORLD_SMOOTH_TANGENTS_H

#include "worker/render/world/world.h"

/* Makes tangents for every mesh with normals and texture coordinates whose BSDF uses tangents; instances share
 * them. Returns 0 or -ENOMEM. */
int smooth_tangents_make(struct world *w, struct arena *scratch, struct error *e);

#endif
