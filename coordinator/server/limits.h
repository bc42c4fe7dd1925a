/* SPDX-License-Identifier: Apache-2.0 */
/* How many connections the coordinator takes, and the file descriptors that they need. */
#ifndef COORDINATOR_SERVER_LIMITS_H
#define COORDINATOR_SERVER_LIMITS_H

#include "common/base/error.h"

enum { CONNECTIONS_DEFAULT = 10000, CONNECTIONS_MOST = 1000000, FETCHES_MOST = 128 /* files on their way out */ };

/* Raises the process's limit of file descriptors as far as the system lets it. asked 0: the default, or as many as
 * there are descriptors for. -EINVAL when more are asked for than that. */
int limits_connections(unsigned asked, unsigned *connections, struct error *e);

#endif
