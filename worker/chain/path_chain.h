/*
 * Chains whose states are whole paths, moved by a mixture of mutations (Veach and Guibas 1997; worker/mutation). The target is
 * I = X+Y+Z of the path's contribution per area; independent proposals also estimate b by f / T.
 */
#ifndef WORKER_CHAIN_PATH_CHAIN_H
#define WORKER_CHAIN_PATH_CHAIN_H

#include "worker/chain/chain.h"
#include "worker/path/whole.h"

extern const struct chain_ops chain_path;

/* One of the paths that bdpt makes of a bootstrap sample, chosen in proportion to what it contributes there: drawing samples
 * in proportion to their sums and then paths like this gives paths in proportion to f. false: the sample is black. 0 edges: the
 * path fell to rounding. */
bool path_start(struct path_context *c, uint64_t seed, uint64_t bootstrap_index, struct whole_path *x);

/* A path as bytes (little endian), and back: surfaces, modes and positions are taken from the world again. WHOLE_BYTES are
 * always enough. */
enum { WHOLE_BYTES = 16 + 56 * WHOLE_MAX_VERTICES };
size_t path_write(const struct world *w, const struct whole_path *x, uint8_t *bytes);
/* false: not a path of this world, or a black one. */
bool path_read(struct path_context *c, const uint8_t *bytes, size_t size, struct whole_path *x);

#endif
