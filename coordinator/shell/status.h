/*
 * The status socket: a Unix stream socket (mode 0600). On connect one snapshot line at once (JSON); a line
 * {"subscribe":["jobs"]} (jobs, workers, snapshot) then gets lines when something changes. Every object has schema, type,
 * time; fields are only ever added. Who does not read is dropped. The loop's thread.
 */
#ifndef COORDINATOR_SHELL_STATUS_H
#define COORDINATOR_SHELL_STATUS_H

#include "coordinator/shell/server.h"

/*
 * inherited: a listening socket that the service manager made, whose file stays when we go; -1: one is made at path.
 * -EADDRINUSE when somebody answers there already.
 */
int status_open(struct status_socket **out, struct server *s, int inherited, const char *path, struct error *e);
void status_close(struct status_socket *t); /* NULL: nothing; asynchronous */
void status_tick(struct status_socket *t);  /* NULL: nothing */

#endif
