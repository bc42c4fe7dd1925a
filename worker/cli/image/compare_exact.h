/* SPDX-License-Identifier: Apache-2.0 */
/* Whether two images have the same bits (docs/design.md, rules 1). Pure. */
#ifndef WORKER_CLI_IMAGE_COMPARE_EXACT_H
#define WORKER_CLI_IMAGE_COMPARE_EXACT_H

#include "common/exr/exr_image.h"

#include <stdbool.h>
#include <stddef.h>

/* Every channel of every pixel, windows, and the header except for header_excluded. false: `why` is the first
 * difference. */
bool compare_exact(const struct exr_image *a, const struct exr_image *b, char *why, size_t why_size);

#endif
