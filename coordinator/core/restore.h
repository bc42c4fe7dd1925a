/* SPDX-License-Identifier: Apache-2.0 */
/* Restores a job of an earlier run. */
#ifndef COORDINATOR_CORE_RESTORE_H
#define COORDINATOR_CORE_RESTORE_H

#include "coordinator/core/event.h"

struct farm;

void restore_job(struct farm *f, const struct event *ev);

#endif
