/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMMON_NET_UV_POOL_H
#define COMMON_NET_UV_POOL_H

#include "common/base/error.h"

#include <uv.h>

/* Starts the threads of libuv's pool. libuv would start them at their first use, and abort the process if one of them
 * could not be created. The loop must be new; it is run. Returns 0, -ENOMEM, or another -errno of creating threads. */
int uv_pool_start(uv_loop_t *loop, struct error *e);

#endif
