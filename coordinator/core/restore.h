/* SPDX-License-Identifier: Apache-2.0 */
/* Restores jobs of an earlier run, and jobs that have ended (EVENT_RESTORE). */
#ifndef COORDINATOR_CORE_RESTORE_H
#define COORDINATOR_CORE_RESTORE_H

#include "coordinator/core/event.h"

struct farm;

void restore_job(struct farm *f, const struct event *ev);

#endif
