/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Light that the samples of a render hardly ever find, such as that which is reflected inside the glass around a lamp
 * before it leaves, for `path`. Until a sample finds it, it is missing from the image, and the spread between samples
 * does not show it. A pilot merges photons with the camera's sub-paths (worker/render/path/merging.h), which finds that
 * light at once, and tells from the densities of each path how often samples of the integrator would. Any thread.
 */
#ifndef WORKER_RENDER_UNSEEN_LIGHT_H
#define WORKER_RENDER_UNSEEN_LIGHT_H

#include "worker/render/path/brightness.h"
#include "worker/render/world/world.h"

/* Fills in r->unseen. r: complete, with the integrator chosen. All 0 if no lobe is narrow. For chains it is the light
 * that bdpt, whose samples they begin with, hardly ever finds. Takes 0.1 to 0.3 s, however long the render.
 * -ENOMEM, -EINVAL */
int render_unseen_light(const struct world *w, struct plan_request *r, struct error *e);

/* The same of a context and a map of brightness. with_light: share of the samples that have a light sub-path. samples:
 * sub-paths from each end, twice, with numbers of RNG_CHOICE, four steps from `step` on. -ENOMEM */
int unseen_light(struct path_context *c, const struct brightness *map, double with_light, uint64_t seed, uint64_t step,
		 uint64_t samples, struct plan_unseen *out);

#endif
