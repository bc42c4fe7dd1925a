/* SPDX-License-Identifier: Apache-2.0 */
/* Tells whether two images have the same bits (docs/design.md, rules 1). Pure. */
#ifndef WORKER_CLI_IMAGE_COMPARE_EXACT_H
#define WORKER_CLI_IMAGE_COMPARE_EXACT_H

#include "common/exr/exr_image.h"

#include <stdbool.h>
#include <stddef.h>

/* Compares every channel of every pixel, the windows, and all attributes but those of header_is_excluded. Returns false
 * if they differ, and describes the first difference in `why`. */
bool compare_exact(const struct exr_image *a, const struct exr_image *b, char *why, size_t why_size);

#endif
