/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Addresses where a daemon listens or to which a peer connects: "HOST:PORT", "[::1]:PORT". Anything but loopback
 * requires TLS or --insecure.
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

enum { NET_ADDRS_MAX = 8 };

/* The addresses of a name, in the order in which they are to be tried. */
struct net_addrs {
	struct net_addr addrs[NET_ADDRS_MAX]; /* further addresses are ignored */
	unsigned count;
};

/* Resolves HOST:PORT, which may block on DNS. Port 0 is allowed. Returns 0, -EINVAL if the text is not HOST:PORT, or
 * -EHOSTUNREACH if the name is unknown. */
int net_addrs_resolve(struct net_addrs *l, const char *host_port, struct error *e);
/* For callers that resolve names asynchronously: net_addr_split returns the parts of HOST:PORT (port points into it),
 * or -EINVAL; net_addrs_set stores the result of getaddrinfo. */
enum { NET_HOST_MAX = 256 };
int net_addr_split(const char *host_port, char host[NET_HOST_MAX], const char **port, struct error *e);
void net_addrs_set(struct net_addrs *l, const struct addrinfo *found);
/* Drops the addresses that net_addr_check_allowed does not allow; -EPERM if none is left. */
int net_addrs_filter_allowed(struct net_addrs *l, const char *host_port, bool allow_remote, struct error *e);
bool net_addr_is_loopback(const struct net_addr *a);
/* Returns 0 if the address is loopback or `allow_remote` is set (TLS, or --insecure); otherwise -EPERM, with a sentence
 * that says what to do. */
int net_addr_check_allowed(const struct net_addr *a, const char *host_port, bool allow_remote, struct error *e);
unsigned net_addr_port(const struct net_addr *a);
void net_addr_set_port(struct net_addr *a, unsigned port);
void net_addr_format(const struct net_addr *a, char *text, size_t size); /* numeric HOST:PORT */

#endif
