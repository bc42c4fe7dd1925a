/* SPDX-License-Identifier: Apache-2.0 */
/* Adds actions to the update (update.h). Room for them is reserved when workers join and jobs are submitted, so
 * adding one cannot fail. */
#ifndef COORDINATOR_CORE_ACTIONS_H
#define COORDINATOR_CORE_ACTIONS_H

#include "coordinator/core/state.h"

int update_reserve(struct farm *f, size_t more_leases); /* -ENOMEM */
struct action *update_add(struct farm *f, enum action_kind kind);

#endif
