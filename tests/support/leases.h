/* SPDX-License-Identifier: Apache-2.0 */
/* Single leases of a plan, and a small image by `path` made of one. An error fails the test. */
#ifndef TESTS_SUPPORT_LEASES_H
#define TESTS_SUPPORT_LEASES_H

#include "worker/render/render.h"

/* A lease that ends as it should and whose batch is one of the plan's; batch_fini frees it. in: NULL for bootstraps and
 * samples. */
struct batch lease_done(const struct world *w, const struct plan *p, struct lease_key k, const struct lease_input *in);

/* The world, which is freed, by `path` with so many samples a pixel and edges: X, Y, Z of each pixel,
 * summed over its samples, to be freed. */
float *lease_image(struct world *w, uint32_t side, uint64_t spp, uint32_t max_depth);
/* The mean of Y over pixels and samples of that image. */
double lease_brightness(struct world *w, uint32_t side, uint64_t spp, uint32_t max_depth);

#endif
