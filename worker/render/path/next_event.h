/* SPDX-License-Identifier: Apache-2.0 */
/* Points on emitters for next event estimation, and the densities of all ways to draw them. */
#ifndef WORKER_RENDER_PATH_NEXT_EVENT_H
#define WORKER_RENDER_PATH_NEXT_EVENT_H

#include "worker/render/path/vertex.h"

/* The density of an emitter's point, including the choice of the emitter: path_pdf_emitter as light sub-paths draw it,
 * path_pdf_toward as next event estimation draws it from ref. The measure is that of vertex.h. */
double path_pdf_emitter(const struct path_context *c, const struct path_vertex *v);
double path_pdf_toward(const struct path_context *c, const struct path_vertex *v, vec3 ref);
/* Draws a point y on an emitter as seen from z, with z's own random numbers. *pdf: its density, including the choice of
 * the emitter. Returns false if no point could be drawn. */
bool path_sample_next_event(const struct path_context *c, const struct path_vertex *z, struct path_vertex *y,
			    double *pdf);

#endif
