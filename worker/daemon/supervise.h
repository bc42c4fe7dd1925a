/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A rendering process and its supervisor. When a signal ends the former (a fault caused by a scene, lack of memory),
 * the supervisor restarts it, and the new process tells the coordinator which leases the old one had (work.h). The
 * supervisor does nothing else, so no scene can affect it; if it is killed, the rendering process is killed with it.
 * SIGTERM, SIGINT and SIGHUP (unless it is ignored, as under nohup) are passed on to the rendering process, and its
 * exit code is the program's. The first process that cannot start ends the program; a later one is tried again.
 */
#ifndef WORKER_DAEMON_SUPERVISE_H
#define WORKER_DAEMON_SUPERVISE_H

/* Calls run in a process of its own, again after each signal that ends it. Returns the program's exit code in the
 * supervisor, and never in the other. Call before there are threads. */
int supervise(unsigned threads, int (*run)(void *user), void *user);

#endif
