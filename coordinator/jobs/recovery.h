/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The jobs that had not ended when an earlier run did: read by the pool while the coordinator listens, so that a spool
 * of gigabytes keeps nobody from an answer. Their rows and plans are read before it listens; their films, one job after
 * the other, behind that. The core is told of all of them at once, in the order of their ids, when the last one has
 * been read: until then no lease goes out, what peers ask for waits (held.h), and the status says "reading, N %".
 *
 * Jobs whose checkpoint or journal is damaged begin anew, those without a folder, a plan or a scene fail with a
 * sentence. An error of the machine stops the coordinator, for another start may go better, and so does -EPROTO:
 * another version of it wrote what is there. Then all is as it was: nothing stored is given up because it could not be
 * read. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_RECOVERY_H
#define COORDINATOR_JOBS_RECOVERY_H

#include "coordinator/job/jobs.h"

int recovery_begin(struct jobs *jobs, struct error *e); /* where there are no such jobs it is over at once */
bool recovery_is_on(const struct jobs *jobs);
double recovery_share(const struct jobs *jobs); /* of all bytes: 0 to 1 */
void recovery_stop(struct jobs *jobs);		/* soon, with the loop */
void recovery_close(struct jobs *jobs);		/* the loop has ended */

/* While it is on. */
bool recovery_view(const struct jobs *jobs, uint64_t job, struct job_view *v); /* false: not one of them */
size_t recovery_views(const struct jobs *jobs, struct job_view *v); /* ascending by id. v: NULL: how many they are */

#endif
