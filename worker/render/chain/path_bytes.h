/* SPDX-License-Identifier: Apache-2.0 */
/* The states of chains of whole paths, as bytes. */
#ifndef WORKER_RENDER_CHAIN_PATH_BYTES_H
#define WORKER_RENDER_CHAIN_PATH_BYTES_H

#include "worker/render/path/full_path.h"

/* Converts a path to bytes (little endian) and back. The result is the same path bit by bit, except for points that
 * were drawn on an emitter or the aperture. PATH_BYTES_MAX bytes always suffice. */
enum { PATH_BYTES_MAX = 32 + 40 * FULL_PATH_VERTICES_MAX };
/* Writes a path and returns the number of bytes. They are read back into `reread` as a check; returns 0 if that failed,
 * and then they must not be used. */
size_t path_write(struct path_context *c, const struct full_path *x, struct full_path *reread, uint8_t *bytes);
/* Reads untrusted bytes and computes log f of their path, ignoring the value that they state. Returns false if they are
 * not a path of this world. */
bool path_read_contribution(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path *x,
			    double *contribution);
/* Reads untrusted bytes. Returns false if they are not a path of this world that path_write wrote. */
bool path_read(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path *x);

#endif
