/* SPDX-License-Identifier: Apache-2.0 */
/* What clients want of jobs that are there: cancel, hold, release, priority, extend. The loop's thread. */
#ifndef COORDINATOR_PEERS_CONTROL_H
#define COORDINATOR_PEERS_CONTROL_H

#include "coordinator/peers/session.h"

/* Each is answered by Done, an extension perhaps later. */
void control_cancel(struct session *p, uint64_t job);
void control_job(struct session *p, const Farm__Control *c);

#endif
