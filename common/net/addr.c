/* SPDX-License-Identifier: Apache-2.0 */
#include "common/net/addr.h"

#include <arpa/inet.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int net_addr_split(const char *host_port, char host[NET_HOST_MAX], const char **port, struct error *e)
{
	const char *colon = strrchr(host_port, ':');
	const char *begin = host_port, *end = colon;
	if (colon && *begin == '[' && colon > begin + 1 && colon[-1] == ']') {
		begin++;
		end--;
	} else if (colon && memchr(host_port, ':', (size_t)(colon - host_port))) {
		return error_set(e, EINVAL, "'%s': an IPv6 address is written as [ADDRESS]:PORT", host_port);
	}
	if (!colon || end == begin || end - begin >= NET_HOST_MAX)
		return error_set(e, EINVAL, "'%s' is not HOST:PORT", host_port);
	char *stop;
	long number = strtol(colon + 1, &stop, 10);
	if (colon[1] < '0' || colon[1] > '9' || *stop || number > 65535)
		return error_set(e, EINVAL, "'%s': the port must be a number from 0 to 65535", host_port);
	memcpy(host, begin, (size_t)(end - begin));
	host[end - begin] = 0;
	*port = colon + 1;
	return 0;
}

void net_addrs_set(struct net_addrs *l, const struct addrinfo *found)
{
	memset(l, 0, sizeof *l);
	for (; found && l->count < NET_ADDRS_MAX; found = found->ai_next)
		memcpy(&l->addrs[l->count++].storage, found->ai_addr, found->ai_addrlen);
}

int net_addrs_resolve(struct net_addrs *l, const char *host_port, struct error *e)
{
	char host[NET_HOST_MAX];
	const char *port = "";
	int rc = net_addr_split(host_port, host, &port, e);
	if (rc)
		return rc;
	struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICSERV}, *found = NULL;
	int code = getaddrinfo(host, port, &hints, &found);
	if (code)
		return error_set(e, EHOSTUNREACH, "'%s': %s", host_port, gai_strerror(code));
	net_addrs_set(l, found);
	freeaddrinfo(found);
	return 0;
}

int net_addrs_filter_allowed(struct net_addrs *l, const char *host_port, bool allow_remote, struct error *e)
{
	unsigned count = 0;
	int rc = 0;
	for (unsigned i = 0; i < l->count; i++) {
		int refused = net_addr_check_allowed(&l->addrs[i], host_port, allow_remote, e);
		if (refused)
			rc = refused;
		else
			l->addrs[count++] = l->addrs[i];
	}
	l->count = count;
	return count ? 0 : rc;
}

bool net_addr_is_loopback(const struct net_addr *a)
{
	if (a->storage.ss_family == AF_INET) {
		struct sockaddr_in v4;
		memcpy(&v4, &a->storage, sizeof v4);
		return ntohl(v4.sin_addr.s_addr) >> 24 == 127;
	}
	if (a->storage.ss_family == AF_INET6) {
		struct sockaddr_in6 v6;
		memcpy(&v6, &a->storage, sizeof v6);
		return IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr);
	}
	return false;
}

int net_addr_check_allowed(const struct net_addr *a, const char *host_port, bool allow_remote, struct error *e)
{
	if (allow_remote || net_addr_is_loopback(a))
		return 0;
	return error_set(
		e, EPERM,
		"'%s' is not a loopback address, and without certificates nothing is encrypted or authenticated: "
		"give --tls DIR (hslt-ca makes one), or --insecure if every machine that can reach it is trusted",
		host_port);
}

/* IPv4 and IPv6 addresses have the port at the same offset. */
unsigned net_addr_port(const struct net_addr *a)
{
	struct sockaddr_in v4;
	memcpy(&v4, &a->storage, sizeof v4);
	return ntohs(v4.sin_port);
}

void net_addr_set_port(struct net_addr *a, unsigned port)
{
	in_port_t network_port = htons((uint16_t)port);
	memcpy((char *)&a->storage + offsetof(struct sockaddr_in, sin_port), &network_port, sizeof network_port);
}

_Static_assert(offsetof(struct sockaddr_in, sin_port) == offsetof(struct sockaddr_in6, sin6_port), "ports differ");

void net_addr_format(const struct net_addr *a, char *text, size_t size)
{
	char host[INET6_ADDRSTRLEN] = "?";
	if (a->storage.ss_family == AF_INET6) {
		struct sockaddr_in6 v6;
		memcpy(&v6, &a->storage, sizeof v6);
		inet_ntop(AF_INET6, &v6.sin6_addr, host, sizeof host);
		snprintf(text, size, "[%s]:%u", host, net_addr_port(a));
		return;
	}
	struct sockaddr_in v4;
	memcpy(&v4, &a->storage, sizeof v4);
	inet_ntop(AF_INET, &v4.sin_addr, host, sizeof host);
	snprintf(text, size, "%s:%u", host, net_addr_port(a));
}
