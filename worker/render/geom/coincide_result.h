/* SPDX-License-Identifier: Apache-2.0 */
/* What the search of coincide_find.c found, in order. */
#ifndef WORKER_RENDER_GEOM_COINCIDE_RESULT_H
#define WORKER_RENDER_GEOM_COINCIDE_RESULT_H

#include "worker/render/geom/coincide.h"

/* Takes the n pairs over, in any order, some of them more than once; count: the number of shapes. -ENOMEM. */
int coincide_result(struct coincide_pair *pairs, size_t n, bool incomplete, uint32_t count, struct coincidence **out);

#endif
