/* SPDX-License-Identifier: Apache-2.0 */
/* The evaluation of bdpt, for integrators that build on it; path_context.light_every says how many samples have a light
 * sub-path. */
#ifndef WORKER_RENDER_PATH_INTEGRATE_BDPT_H
#define WORKER_RENDER_PATH_INTEGRATE_BDPT_H

#include "worker/render/path/path.h"

void path_trace_both_ways(struct path_context *c, struct sampler *s, struct path_sample *out);
/* The same by the techniques of ensemble_draw: what it brings is the sum of those candidates for a chain's seed. Points
 * of emitters are not joined to the lens. The pilot looks at these, too: a splat of each sample in the pixel of a small
 * lamp would look like rare light to it. */
void path_trace_candidates(struct path_context *c, struct sampler *s, struct path_sample *out);

#endif
