/* SPDX-License-Identifier: Apache-2.0 */
/* Resolves a name to its first address. */
#ifndef TESTS_SUPPORT_FIRST_ADDRESS_H
#define TESTS_SUPPORT_FIRST_ADDRESS_H

#include "common/net/addr.h"

static inline int first_address_resolve(struct net_addr *a, const char *host_port, struct error *e)
{
	struct net_addrs l;
	int rc = net_addrs_resolve(&l, host_port, e);
	if (!rc)
		*a = l.addrs[0];
	return rc;
}

#endif
