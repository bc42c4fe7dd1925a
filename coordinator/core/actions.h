/* SPDX-License-Identifier: Apache-2.0 */
/* How actions come into the update (update.h). Room for them is made when workers join and jobs come, so that saying
 * something cannot fail. */
#ifndef COORDINATOR_CORE_ACTIONS_H
#define COORDINATOR_CORE_ACTIONS_H

#include "coordinator/core/state.h"

int update_reserve(struct farm *f, size_t more_leases); /* -ENOMEM */
struct action *update_add(struct farm *f, enum action_kind kind);

#endif
