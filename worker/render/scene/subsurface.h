/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What stands in for the dipole of Mitsuba 0.6 in a lenient reader: light that enters a surface leaves it where it
 * entered, in the same amount. One thread.
 */
#ifndef WORKER_RENDER_SCENE_SUBSURFACE_H
#define WORKER_RENDER_SCENE_SUBSURFACE_H

#include "worker/render/scene/maker.h"

/* The share of the light that has entered a flat medium and leaves it again: Jensen, Marschner, Levoy and Hanrahan
 * 2001, section 2.2, integrated over the surface. albedo: the reduced one, in [0, 1]; eta: inside over outside. */
double subsurface_reflectance(double albedo, double eta);
/* The diffuse reflectance below the boundary of a `plastic` with which it reflects `reflectance` in all. */
double subsurface_base(double reflectance, double eta);

/* The i-th of Mitsuba 0.6's models and what a lenient reader makes of it; NULL after the last. */
const char *subsurface_at(size_t i, const char **becomes);

/* Shapes with a dipole below a `plastic` or `roughplastic` get this one with such a base instead, with a note. Other
 * subsurfaces stay where they are. 0 or -ENOMEM. */
int subsurface_settle(struct maker *m);

#endif
