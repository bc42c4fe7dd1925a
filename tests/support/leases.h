/* SPDX-License-Identifier: Apache-2.0 */
/* Runs single leases of a plan, or renders a small image by `path` with one lease. An error fails the test. */
#ifndef TESTS_SUPPORT_LEASES_H
#define TESTS_SUPPORT_LEASES_H

#include "worker/render/render.h"

/* Runs a lease, which must succeed and return a batch of the plan; batch_fini frees it. in: NULL for bootstraps and
 * samples. */
struct batch leases_run(const struct world *w, const struct plan *p, struct lease_key k, const struct lease_input *in);

/* Renders the world, which is freed, by `path` with spp samples per pixel and paths of max_depth edges. Returns X,
 * Y, Z of each pixel, summed over its samples, to be freed. */
float *leases_render_image(struct world *w, uint32_t side, uint64_t spp, uint32_t max_depth);
/* Returns the mean of Y over the pixels and samples of that image. */
double leases_mean_luminance(struct world *w, uint32_t side, uint64_t spp, uint32_t max_depth);

#endif
