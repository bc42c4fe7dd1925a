/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The status socket: a Unix stream socket (mode 0600, or 0660 for a group). A new reader gets one snapshot line
 * (JSON) at once; after a line {"subscribe":["jobs"]} (jobs, workers, snapshot) it gets lines when something changes.
 * {"job":"j12"} asks for one job with all its details, and {"endedBefore":"j12"} for a page of jobs that ended and
 * are not in the snapshot (null: the first page); the page's "before" says where the next page begins, and is null at
 * the end. Every object has schema, type and time; fields are only ever added. The loop's thread.
 */
#ifndef COORDINATOR_STATUS_STATUS_H
#define COORDINATOR_STATUS_STATUS_H

#include "coordinator/peers/peers.h"

struct status_socket;

/*
 * Opens the socket. inherited: a listening socket from the service manager, whose file is kept; -1: create one at
 * `path`. group: may connect besides our own user; NULL: nobody. Returns -EADDRINUSE if somebody answers at the path
 * already, -EEXIST if something else is there (including a link, wherever it leads), -EINVAL if there is no such
 * group.
 */
int status_open(struct status_socket **out, struct peers *s, int inherited, const char *path, const char *group,
		struct error *e);
void status_close(struct status_socket *t); /* asynchronous; t may be NULL */
void status_tick(struct status_socket *t);  /* call a few times a second; t may be NULL */

#endif
