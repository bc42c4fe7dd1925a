/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The replacement, in a lenient reader, for the dipole of Mitsuba 0.6: light leaves the surface where it entered, in
 * the same amount. One thread.
 */
#ifndef WORKER_RENDER_SCENE_SUBSURFACE_H
#define WORKER_RENDER_SCENE_SUBSURFACE_H

#include "worker/render/scene/maker.h"

/* Returns the fraction of the light that has entered a flat medium and leaves it again: Jensen, Marschner, Levoy and
 * Hanrahan 2001, section 2.2, integrated over the surface. albedo: the reduced albedo, in [0, 1]; eta: inside over
 * outside. */
double subsurface_reflectance(double albedo, double eta);
/* Returns the diffuse reflectance below the boundary of a `plastic` for which `reflectance` of the light that has
 * entered leaves again. */
double subsurface_base_reflectance(double reflectance, double eta);

/* Returns the i-th of Mitsuba 0.6's models and what a lenient reader makes of it; NULL after the last. */
const char *subsurface_model_at(size_t i, const char **replacement);

/* Replaces each dipole below a `plastic` or `roughplastic` by a diffuse base of that BSDF, with a note. Other
 * subsurfaces stay. Returns 0 or -ENOMEM. */
int subsurface_replace_dipoles(struct maker *m);

#endif
