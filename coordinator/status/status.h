/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The status socket: a Unix stream socket (mode 0600, or 0660 for a group). A new reader gets one snapshot line (JSON)
 * at once; after a line {"subscribe":["jobs"]} (jobs, workers, snapshot) it gets lines when something changes.
 * {"job":"j12"} asks for one job with all that is known of it, and {"endedBefore":"j12"} for a page of jobs that ended
 * and are not in the snapshot (null: the first page); the page's "before" is where the next one begins, null at the
 * end. Every object has schema, type and time; fields are only ever added. The loop's thread.
 */
#ifndef COORDINATOR_STATUS_STATUS_H
#define COORDINATOR_STATUS_STATUS_H

#include "coordinator/peers/peers.h"

struct status_socket;

/*
 * inherited: a listening socket from the service manager, whose file is kept; -1: create one at path. group: who may
 * connect besides our own user; NULL: nobody. -EADDRINUSE: somebody answers there already, -EEXIST: something else is
 * there (including a link, wherever it leads), -EINVAL: no such group.
 */
int status_open(struct status_socket **out, struct peers *s, int inherited, const char *path, const char *group,
		struct error *e);
void status_close(struct status_socket *t); /* s may be NULL; asynchronous */
void status_tick(struct status_socket *t);  /* s may be NULL */

#endif
