/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A process that renders, and one that sees to it: when a signal ends the first (a fault in a scene's wake, the
 * machine's memory), the second starts it again and the new one tells the coordinator which leases the old one had
 * (work.h). The supervisor does nothing else, so that no scene reaches it; when it is killed the process that renders
 * is killed with it. SIGTERM, SIGINT and SIGHUP go on to the process that renders, and its exit code is the program's.
 */
#ifndef WORKER_DAEMON_SUPERVISE_H
#define WORKER_DAEMON_SUPERVISE_H

#include "common/base/error.h"

/* Calls run in a process of its own, again after each signal that ends it. Returns the program's exit code in the
 * supervisor, and never in the other. Before there are threads. */
int supervise(unsigned threads, int (*run)(void *user), void *user);

#endif
