/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Light that the samples of a render hardly ever find; for `path`, an example is light that is reflected inside the
 * glass around a lamp before it leaves. Until a sample finds such light, it is missing from the image, and the spread
 * between samples does not show it. A pilot merges photons with the camera's sub-paths (worker/render/path/merging.h),
 * which finds that light at once, and computes from the densities of each path how often samples of the integrator
 * would find it. Any thread.
 */
#ifndef WORKER_RENDER_UNSEEN_LIGHT_H
#define WORKER_RENDER_UNSEEN_LIGHT_H

#include "worker/render/path/brightness.h"
#include "worker/render/world/world.h"

/* Fills in r->unseen; all 0 if no lobe is narrow. r must be complete, with the integrator chosen. For chains it is the
 * light that bdpt, from whose samples they begin, hardly ever finds. Takes 0.1 to 0.3 s, however long the render.
 * Returns -ENOMEM or -EINVAL. */
int render_unseen_light(const struct world *w, struct plan_request *r, struct error *e);

/* Like render_unseen_light(), for a given context and map of brightness. light_fraction: fraction of the samples that
 * have a light sub-path. samples: number of sub-paths from each end, which are traced twice, with numbers of RNG_CHOICE
 * for `step` and the next three steps. Returns -ENOMEM if out of memory. */
int unseen_light_estimate(struct path_context *c, const struct brightness *map, double light_fraction, uint64_t seed,
			  uint64_t step, uint64_t samples, struct plan_unseen *out);

#endif
