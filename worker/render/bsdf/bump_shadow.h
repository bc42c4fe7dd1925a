/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The shadow that bumps cast on each other. A bent normal brings light to where the surface itself is already turned
 * away, and that light ends abruptly. Taken for microfacets whose slopes are as wide as the normal is bent, bumps lose
 * some of what comes in at grazing angles: by Smith's factor for light alone, G = 2 / (1 + sqrt(1 + a^2 tan^2 l)) with
 * a^2 = min(tan^2 b / 8, 1), l and b the angles of light and bent normal to the normal that the surface has without
 * relief (Conty Estevez, Lecocq, Stein: A Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem.
 * Ray Tracing Gems, ch. 12, 2019). Not reciprocal. Densities stay as they are, since G lies between 0 and 1.
 */
#ifndef WORKER_RENDER_BSDF_BUMP_SHADOW_H
#define WORKER_RENDER_BSDF_BUMP_SHADOW_H

#include "worker/render/bsdf/bsdf.h"

/* Scales f of all lobes of b, whose relief is known, by G. */
int bsdf_shadow_bumps(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e);

#endif
