/* Indices of refraction by name (at the sodium line, one number: dispersion is not modelled here) or by number. */
#ifndef WORKER_BSDF_IOR_H
#define WORKER_BSDF_IOR_H

#include "worker/scene/scene.h"

/* The property `name` of n, a number > 0 or a name; `fallback` when absent. */
int ior_read(const struct scene_node *n, const char *name, double fallback, double *out, struct error *e);

#define IOR_BK7_DEFAULT 1.5046   /* what both Mitsuba dialects take for the inside when nothing is said */
#define IOR_AIR_DEFAULT 1.000277 /* ... and for the outside */

#endif
