/* SPDX-License-Identifier: Apache-2.0 */
/* The number of connections that the coordinator accepts, and the file descriptors that they need. */
#ifndef COORDINATOR_SERVER_LIMITS_H
#define COORDINATOR_SERVER_LIMITS_H

#include "common/base/error.h"

enum { CONNECTIONS_DEFAULT = 10000, CONNECTIONS_MOST = 1000000, FETCHES_MOST = 128 /* outgoing files */ };

/* Raises the process's limit of file descriptors as far as the system allows. asked 0: the default, or as many as
 * there are descriptors for. -EINVAL: more are requested than that. */
int limits_connections(unsigned asked, unsigned *connections, struct error *e);

#endif
