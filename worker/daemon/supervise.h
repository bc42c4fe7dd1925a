/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A rendering process and its supervisor. If a signal ends the rendering process (a fault caused by a scene, lack of
 * memory), the supervisor starts a new one, which tells the coordinator which leases the old one had (crash_record.h).
 * The supervisor does nothing else, so no scene can affect it; if it is killed, the rendering process is killed with
 * it. SIGTERM, SIGINT and SIGHUP (unless ignored, as under nohup) are passed on to the rendering process, whose exit
 * code is the program's. If the first process cannot start, the program ends; a later one is tried again.
 */
#ifndef WORKER_DAEMON_SUPERVISE_H
#define WORKER_DAEMON_SUPERVISE_H

/* Calls `run` in a process of its own, and again in a new one after each signal that ends it. Returns the program's
 * exit code in the supervisor; the other process exits with the result of `run`. Call before there are threads. */
int supervise_process(unsigned threads, int (*run)(void *user), void *user);

#endif
