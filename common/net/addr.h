/* SPDX-License-Identifier: Apache-2.0 */
/*
 * "HOST:PORT", "[::1]:PORT": where a daemon listens or a peer connects to. Anything but loopback requires TLS or
 * --insecure.
 */
#ifndef COMMON_NET_ADDR_H
#define COMMON_NET_ADDR_H

#include "common/base/error.h"

#include <netdb.h>
#include <stdbool.h>
#include <sys/socket.h>

struct net_addr {
	struct sockaddr_storage storage;
};

enum { NET_ADDRS_MOST = 8 };

/* What a name stands for, in the order in which the addresses are to be tried. */
struct net_addrs {
	struct net_addr all[NET_ADDRS_MOST]; /* more are ignored */
	unsigned count;
};

/* Resolves the name (may block on DNS). -EINVAL: not HOST:PORT; -EHOSTUNREACH: unknown name. Port 0 is allowed. */
int net_addrs_resolve(struct net_addrs *l, const char *host_port, struct error *e);
/* For those who resolve it themselves: the parts of HOST:PORT, and what getaddrinfo has found. */
enum { NET_HOST_MAX = 256 };
int net_addr_split(const char *host_port, char host[NET_HOST_MAX], const char **port, struct error *e);
void net_addrs_take(struct net_addrs *l, const struct addrinfo *found);
/* Keeps those that net_addr_allow allows; -EPERM: none. */
int net_addrs_allow(struct net_addrs *l, const char *host_port, bool safe, struct error *e);
bool net_addr_is_loopback(const struct net_addr *a);
/* -EPERM, with what to do about it, unless the address is loopback or `safe` (TLS, or --insecure). */
int net_addr_allow(const struct net_addr *a, const char *host_port, bool safe, struct error *e);
unsigned net_addr_port(const struct net_addr *a);
void net_addr_set_port(struct net_addr *a, unsigned port);
void net_addr_format(const struct net_addr *a, char *text, size_t size); /* numeric HOST:PORT */

#endif
