/* SPDX-License-Identifier: Apache-2.0 */
/* Who gets what, and what has been out for too long. */
#ifndef COORDINATOR_CORE_SCHEDULE_H
#define COORDINATOR_CORE_SCHEDULE_H

struct farm;

void schedule(struct farm *f);
void schedule_expire(struct farm *f, double read); /* silence and overdue leases, by what had come then */

#endif
