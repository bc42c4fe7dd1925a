/* SPDX-License-Identifier: Apache-2.0 */
/* The state of a chain of whole paths as bytes. */
#ifndef WORKER_RENDER_CHAIN_PATH_BYTES_H
#define WORKER_RENDER_CHAIN_PATH_BYTES_H

#include "worker/render/path/full_path.h"

/* A path as bytes (little endian), and back: the same path bit by bit but for what was drawn on an emitter or the
 * aperture. PATH_BYTES_MAX are always enough. */
enum { PATH_BYTES_MAX = 32 + 40 * FULL_PATH_MAX_VERTICES };
/* The bytes are read back into `again` as a check; 0: that failed, and they must not be used. */
size_t path_write(struct path_context *c, const struct full_path *x, struct full_path *again, uint8_t *bytes);
/* Any bytes, and log f of the path that they make, whatever they say of it. false: not a path of this world. */
bool path_contribution(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path *x,
		       double *contribution);
/* Any bytes. false: not a path of this world that path_write wrote. */
bool path_read(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path *x);

#endif
