/* SPDX-License-Identifier: Apache-2.0 */
/* Where a chain of whole paths begins. */
#ifndef WORKER_RENDER_CHAIN_PATH_START_H
#define WORKER_RENDER_CHAIN_PATH_START_H

#include "worker/render/path/full_path.h"

/* One of the paths that bdpt makes of a bootstrap sample, chosen in proportion to what it contributes there: drawing
 * samples in proportion to their sums and then paths like this gives paths in proportion to f. false: the sample is
 * black. 0 edges: the path fell to rounding. */
bool path_start(struct path_context *c, uint64_t seed, uint64_t bootstrap_index, struct full_path *x);

#endif
