/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A farm's own certificate authority in a folder: ca.pem, ca.key (0600), crl.pem, issued/SERIAL.pem, and a folder for
 * each name with what a program's --tls wants: ca.pem, cert.pem, key.pem (0600), crl.pem. ECDSA on P-256 with SHA-256;
 * X.509 v3 and revocation lists as in RFC 5280. One process changes a folder at a time (a lock). One thread; files are
 * replaced by rename.
 */
#ifndef COMMON_NET_AUTHORITY_H
#define COMMON_NET_AUTHORITY_H

#include "common/net/tls.h"

#include <time.h>

/* -EEXIST: there is one already. */
int authority_init(const char *folder, const char *name, double days, struct error *e);

/* Writes FOLDER/NAME/. renew: replaces the certificate and key that are there, of this name and role (else -EEXIST);
 * the old ones stay valid until they expire or are revoked. Valid from an hour ago (clocks differ) to `days` from now,
 * but no longer than the authority. */
int authority_issue(const char *folder, const char *name, enum tls_role role, double days, bool renew, struct error *e);

/* Whatever has this name or serial number. Writes crl.pem, also into the folders of coordinators. -ENOENT: nothing that
 * is valid has it. */
int authority_revoke(const char *folder, const char *name_or_serial, unsigned *count, struct error *e);

struct authority_entry {
	struct tls_peer who;
	time_t from, until;
	bool revoked;
};
/* By name, then by time; mem_alloc'd. */
int authority_list(const char *folder, struct authority_entry **entries, size_t *count, struct error *e);

#endif
