/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How much work a scene is (struct plan_rays). A pilot renders leases of its own plan and counts their rays: the result
 * is the same on every machine for the same request, and so is a plan made from it. Any thread.
 */
#ifndef WORKER_RENDER_COUNT_RAYS_H
#define WORKER_RENDER_COUNT_RAYS_H

#include "worker/render/render.h"

/* Counts the rays. r must be complete, with the integrator chosen. The pilot ends after about 500,000 rays, or 1,024
 * samples and 4,096 mutations. Returns -ENOMEM, -EINVAL or -EDOM. */
int render_count_rays(const struct world *w, const struct plan_request *r, struct plan_rays *out, struct error *e);

#endif
