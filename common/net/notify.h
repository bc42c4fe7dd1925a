/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The protocols between a daemon and the service manager that started it (sd_notify(3), sd_watchdog_enabled(3),
 * sd_listen_fds(3)), implemented by environment variables alone. Without these variables nothing happens. One thread;
 * allocates nothing.
 */
#ifndef COMMON_NET_NOTIFY_H
#define COMMON_NET_NOTIFY_H

#include <stdbool.h>

/* Sends a state such as "READY=1", "WATCHDOG=1" or "STOPPING=1" to $NOTIFY_SOCKET; never blocks. Returns false if there
 * is no such socket or it did not accept the message. */
bool notify_send(const char *state);

/* Returns the seconds within which WATCHDOG=1 is expected; 0 if it is not expected. */
double notify_watchdog_seconds(void);

/* Returns the first listening Unix stream socket passed to this process, set to close on exec, which the caller then
 * owns; -1 if there is none. */
int notify_inherited_socket(void);

#endif
