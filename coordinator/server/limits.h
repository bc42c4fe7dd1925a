/* SPDX-License-Identifier: Apache-2.0 */
/* The number of connections that the coordinator accepts, and the file descriptors that they need. */
#ifndef COORDINATOR_SERVER_LIMITS_H
#define COORDINATOR_SERVER_LIMITS_H

#include "common/base/error.h"

/* concurrent fetches: files being sent to clients. */
enum { CONNECTIONS_DEFAULT = 10000, CONNECTIONS_MAX = 1000000, FETCHES_MAX = 128 };

/* Raises the process's limit on file descriptors as far as needed and possible, and returns the number of connections
 * in *connections. requested 0: the default, or fewer if there are not enough descriptors. Returns
 * -EINVAL if the descriptors do not suffice for the requested number. */
int limits_reserve_connections(unsigned requested, unsigned *connections, struct error *e);

#endif
