/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a daemon and the service manager that started it tell each other, by environment variables alone (the protocols
 * of sd_notify(3), sd_watchdog_enabled(3) and sd_listen_fds(3)); without them, nothing happens. One thread; allocates
 * nothing.
 */
#ifndef COMMON_NET_NOTIFY_H
#define COMMON_NET_NOTIFY_H

#include <stdbool.h>

/* Sends "READY=1", "WATCHDOG=1", "STOPPING=1" to $NOTIFY_SOCKET; never blocks. false: nobody to tell, or not taken. */
bool notify_send(const char *state);

/* Seconds within which WATCHDOG=1 is awaited; 0: nobody waits. */
double notify_watchdog(void);

/* The first listening Unix stream socket handed over to this process, its own from now on (close on exec); -1: none. */
int notify_inherited_unix(void);

#endif
