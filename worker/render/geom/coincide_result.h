/* SPDX-License-Identifier: Apache-2.0 */
/* Puts the pairs found by coincide_find.c into the form of struct coincidence. */
#ifndef WORKER_RENDER_GEOM_COINCIDE_RESULT_H
#define WORKER_RENDER_GEOM_COINCIDE_RESULT_H

#include "worker/render/geom/coincide.h"

/* Takes ownership of the n pairs, which may be in any order and contain duplicates. count: the number of shapes.
 * Returns -ENOMEM if out of memory. */
int coincide_make_result(struct coincide_pair *pairs, size_t n, bool is_incomplete, uint32_t count,
			 struct coincidence **out);

#endif
