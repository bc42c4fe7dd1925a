/* SPDX-License-Identifier: Apache-2.0 */
/* The evaluation function of the path tracer, for integrators that build on it. */
#ifndef WORKER_RENDER_PATH_INTEGRATE_PATH_H
#define WORKER_RENDER_PATH_INTEGRATE_PATH_H

#include "worker/render/path/path.h"

void path_trace(struct path_context *c, struct sampler *s, struct path_sample *out);

#endif
