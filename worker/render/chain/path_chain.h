/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chains whose states are whole paths, moved by a mixture of mutations (Veach and Guibas 1997; worker/render/mutation).
 * The target is I = X+Y+Z of the path's contribution per area; independent proposals also estimate b by f / T.
 */
#ifndef WORKER_RENDER_CHAIN_PATH_CHAIN_H
#define WORKER_RENDER_CHAIN_PATH_CHAIN_H

#include "worker/render/chain/chain.h"
#include "worker/render/path/full_path.h"

extern const struct chain_ops chain_path;

/* One of the paths that bdpt makes of a bootstrap sample, chosen in proportion to what it contributes there: drawing
 * samples in proportion to their sums and then paths like this gives paths in proportion to f. false: the sample is
 * black. 0 edges: the path fell to rounding. */
bool path_start(struct path_context *c, uint64_t seed, uint64_t bootstrap_index, struct full_path_path *x);

/* A path as bytes (little endian), and back: the same path bit by bit but for what was drawn on an emitter or the
 * aperture. WHOLE_BYTES are always enough. */
enum { WHOLE_BYTES = 24 + 40 * FULL_PATH_MAX_VERTICES };
/* What is written is read again, into `again`: 0 where that fails, and the bytes are nobody's state. */
size_t path_write(struct path_context *c, const struct full_path_path *x, struct full_path_path *again, uint8_t *bytes);
/* Any bytes, and log f of the path that they make, whatever they say of it. false: not a path of this world. */
bool path_contribution(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path_path *x,
		       double *contribution);
/* Any bytes. false: not a path of this world that path_write wrote. */
bool path_read(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path_path *x);

#endif
