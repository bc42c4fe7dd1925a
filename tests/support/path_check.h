/* SPDX-License-Identifier: Apache-2.0 */
/* Whether what a full path caches is right. */
#ifndef TESTS_SUPPORT_PATH_CHECK_H
#define TESTS_SUPPORT_PATH_CHECK_H

#include "worker/render/path/full_path.h"

/* Recomputes everything that is cached and asks every ray again; the first disagreement in words. For tests and for
 * states that come from outside. */
bool path_check(struct path_context *c, const struct full_path *x, char *text, size_t size);

#endif
