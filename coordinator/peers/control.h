/* SPDX-License-Identifier: Apache-2.0 */
/* Orders of clients about existing jobs: cancel, hold, release, priority, extend. The loop's thread. */
#ifndef COORDINATOR_PEERS_CONTROL_H
#define COORDINATOR_PEERS_CONTROL_H

#include "coordinator/peers/session.h"

/* Each order is answered by Done, an extension possibly later. */
void control_cancel(struct session *p, uint64_t job);
void control_apply(struct session *p, const Farm__Control *c);

#endif
