/* SPDX-License-Identifier: Apache-2.0 */
/* Orders of users about existing jobs: hold, release, change of priority, extension. */
#ifndef COORDINATOR_CORE_ORDERS_H
#define COORDINATOR_CORE_ORDERS_H

#include "coordinator/core/event.h"

struct farm;

void orders_hold(struct farm *f, const struct event *ev);
void orders_set_priority(struct farm *f, const struct event *ev);
void orders_extend(struct farm *f, const struct event *ev);

#endif
