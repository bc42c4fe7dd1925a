/* SPDX-License-Identifier: Apache-2.0 */
/* The integrators by name and in order. Pure; any thread. */
#ifndef WORKER_RENDER_INTEGRATOR_LOOKUP_H
#define WORKER_RENDER_INTEGRATOR_LOOKUP_H

#include "worker/render/path/integrator_face.h"

#include <stddef.h>

/* NULL when there is none of that name; index from 0, NULL at the end. */
const struct render_integrator *render_integrator_find(const char *name);
const struct render_integrator *render_integrator_at(size_t index);

#endif
