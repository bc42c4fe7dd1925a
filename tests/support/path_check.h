/* SPDX-License-Identifier: Apache-2.0 */
/* Checks that the cached values of a full path are right. */
#ifndef TESTS_SUPPORT_PATH_CHECK_H
#define TESTS_SUPPORT_PATH_CHECK_H

#include "worker/render/path/full_path.h"

/* Recomputes everything that is cached and traces every ray again. Returns false with the first disagreement in
 * words. For tests, and for states from outside. */
bool path_check(struct path_context *c, const struct full_path *x, char *text, size_t size);

#endif
