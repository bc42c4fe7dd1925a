/* SPDX-License-Identifier: Apache-2.0 */
/* Decides which worker gets which lease, and which leases and workers time out. */
#ifndef COORDINATOR_CORE_SCHEDULE_H
#define COORDINATOR_CORE_SCHEDULE_H

struct farm;

/* Hands out leases while workers wait. Call after every event. */
void schedule_leases(struct farm *f);
/* Expires leases past their deadline and disconnects silent workers. `read_until`: everything that arrived before this
 * time has been handled. */
void schedule_expire(struct farm *f, double read_until);

#endif
