/* SPDX-License-Identifier: Apache-2.0 */
/* Points of emitters: as next event estimation draws them, and the densities of all ways to draw them. */
#ifndef WORKER_RENDER_PATH_NEXT_EVENT_H
#define WORKER_RENDER_PATH_NEXT_EVENT_H

#include "worker/render/path/vertex.h"

/* Density of an emitter's point (and of the choice of the emitter): as light sub-paths draw it, and as drawn towards
 * ref. */
double path_pdf_emitter(const struct path_context *c, const struct path_vertex *v);
double path_pdf_toward(const struct path_context *c, const struct path_vertex *v, vec3 ref);
/* A fresh point on an emitter, drawn as seen from z with z's own numbers. */
bool path_next_event(const struct path_context *c, const struct path_vertex *z, struct path_vertex *y, double *pdf);

#endif
