/* SPDX-License-Identifier: Apache-2.0 */
/* The BSDF that Mitsuba gives a shape without one. */
#ifndef WORKER_RENDER_BSDF_DIFFUSE_H
#define WORKER_RENDER_BSDF_DIFFUSE_H

#include "worker/render/bsdf/bsdf.h"

void bsdf_default(struct bsdf *b); /* diffuse 0.5 */

#endif
