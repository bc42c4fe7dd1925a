/* SPDX-License-Identifier: Apache-2.0 */
/* The error of an image from the spread between groups. Private to common/estimate. */
#ifndef COMMON_ESTIMATE_CANVAS_ERROR_H
#define COMMON_ESTIMATE_CANVAS_ERROR_H

#include "common/base/error.h"
#include "common/estimate/image_builder.h"

/* Fills in the standard errors and the relMSE of an image whose rgb is complete. Needs two or more groups and no open
 * rounds. Returns 0 or -ENOMEM. */
int canvas_estimate_error(struct image_builder *m, struct error *e);

#endif
