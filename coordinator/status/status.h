/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The status socket: a Unix stream socket (mode 0600, or 0660 for a group). On connect one snapshot line at once
 * (JSON); a line
 * {"subscribe":["jobs"]} (jobs, workers, snapshot) then gets lines when something changes. Every object has schema,
 * type, time; fields are only ever added. Who does not read is dropped. The loop's thread.
 */
#ifndef COORDINATOR_STATUS_STATUS_H
#define COORDINATOR_STATUS_STATUS_H

#include "coordinator/peers/peers.h"

struct status_socket;

/*
 * inherited: a listening socket that the service manager made, whose file stays when we go; -1: one is made at path.
 * group: who may connect besides us; NULL: nobody. -EADDRINUSE when somebody answers there already, -EEXIST when
 * something else is there (a link, too, wherever it leads), -EINVAL when there is no such group.
 */
int status_open(struct status_socket **out, const struct peers *s, int inherited, const char *path, const char *group,
		struct error *e);
void status_close(struct status_socket *t); /* NULL: nothing; asynchronous */
void status_tick(struct status_socket *t);  /* NULL: nothing */

#endif
