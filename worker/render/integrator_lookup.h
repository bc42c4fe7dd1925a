/* SPDX-License-Identifier: Apache-2.0 */
/* Finds integrators by name or by index. Pure; any thread. */
#ifndef WORKER_RENDER_INTEGRATOR_LOOKUP_H
#define WORKER_RENDER_INTEGRATOR_LOOKUP_H

#include "worker/render/path/integrator_properties.h"

#include <stddef.h>

/* Returns NULL if there is none of that name, or at the end; the index counts from 0. */
const struct integrator_properties *render_integrator_find(const char *name);
const struct integrator_properties *render_integrator_at(size_t index);

#endif
