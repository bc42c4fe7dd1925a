/* SPDX-License-Identifier: Apache-2.0 */
/* The contribution of a full path, and the densities of all techniques that could have made it. */
#ifndef WORKER_RENDER_PATH_FULL_PATH_DENSITY_H
#define WORKER_RENDER_PATH_FULL_PATH_DENSITY_H

#include "worker/render/path/full_path.h"

/* Returns log f of the path in the measure of path.h, from the product of its geometry terms; -INFINITY if it is
 * black. */
double full_path_log_f(const struct path_context *c, struct full_path *x);

/* Fills in pdf and pdf_rev of all vertices and sets log_pdf[s] to the logarithm of the density with which technique s
 * makes this path, s = 0..edges; -INFINITY where it cannot. */
void full_path_log_technique_pdfs(struct path_context *c, struct full_path *x, double *log_pdf);

#endif
