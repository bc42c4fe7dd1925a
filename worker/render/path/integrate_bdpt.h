/* SPDX-License-Identifier: Apache-2.0 */
/* The evaluation function of bdpt, for integrators that build on it. path_context.light_subpath_interval sets the
 * fraction of samples that have a light sub-path. */
#ifndef WORKER_RENDER_PATH_INTEGRATE_BDPT_H
#define WORKER_RENDER_PATH_INTEGRATE_BDPT_H

#include "worker/render/path/path.h"

void path_trace_bidirectional(struct path_context *c, struct sampler *s, struct path_sample *out);
/* Like path_trace_bidirectional(), but with the techniques of ensemble_draw, which do not join points of emitters
 * to the lens: the result is the sum of the candidates from which a chain is seeded. The pilot uses it, too,
 * because with those joints every sample would add a splat in the pixels of a small lamp, which the pilot
 * would mistake for rare light. */
void path_trace_candidates(struct path_context *c, struct sampler *s, struct path_sample *out);

#endif
