/* SPDX-License-Identifier: Apache-2.0 */
/* Which worker gets which lease, and timeouts. */
#ifndef COORDINATOR_CORE_SCHEDULE_H
#define COORDINATOR_CORE_SCHEDULE_H

struct farm;

void schedule(struct farm *f);
void schedule_expire(struct farm *f,
		     double read); /* silent workers and overdue leases, by what had been received then */

#endif
