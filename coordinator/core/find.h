/* SPDX-License-Identifier: Apache-2.0 */
/* Finds jobs and workers of a farm by id. */
#ifndef COORDINATOR_CORE_FIND_H
#define COORDINATOR_CORE_FIND_H

#include "coordinator/core/state.h"

/* NULL: there is none. */
struct job *farm_find_job(const struct farm *f, uint64_t id);
struct peer *farm_find_peer(const struct farm *f, uint64_t id);
uint32_t farm_peer_place(const struct farm *f, uint64_t id); /* index of the first one whose id is not below this */

#endif
