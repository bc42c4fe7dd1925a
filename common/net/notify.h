/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The protocols between a daemon and the service manager that started it, by environment variables only (sd_notify(3),
 * sd_watchdog_enabled(3), sd_listen_fds(3)). Without them, nothing happens. One thread; allocates nothing.
 */
#ifndef COMMON_NET_NOTIFY_H
#define COMMON_NET_NOTIFY_H

#include <stdbool.h>

/* Sends "READY=1", "WATCHDOG=1", "STOPPING=1" to $NOTIFY_SOCKET; never blocks. false: there is no such socket, or it
 * did not take it. */
bool notify_send(const char *state);

/* Seconds within which WATCHDOG=1 is expected; 0: not expected. */
double notify_watchdog(void);

/* The first listening Unix stream socket passed to this process, which now owns it (close on exec); -1: none. */
int notify_inherited_unix(void);

#endif
