/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMMON_NET_POOL_H
#define COMMON_NET_POOL_H

#include "common/base/error.h"

#include <uv.h>

/* Starts the threads of libuv's pool, which libuv itself does at the first use, and where it aborts the process if one
 * of them cannot be created. The loop must be new: it is run. -ENOMEM, or whatever else the system refuses threads
 * for. */
int pool_start(uv_loop_t *loop, struct error *e);

#endif
