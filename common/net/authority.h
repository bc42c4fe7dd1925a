/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A farm's own certificate authority, in a folder: ca.pem, ca.key (0600), crl.pem, issued/SERIAL.pem, and one folder
 * per name with the files that --tls needs: ca.pem, cert.pem, key.pem (0600), crl.pem. ECDSA on P-256 with SHA-256;
 * X.509 v3 certificates and revocation lists as in RFC 5280. A lock on the folder admits one process at a time. One
 * thread; files are replaced by rename.
 */
#ifndef COMMON_NET_AUTHORITY_H
#define COMMON_NET_AUTHORITY_H

#include "common/net/tls.h"

#include <time.h>

/* Creates an authority. Returns 0, -EEXIST if the folder has one already, or another -errno. */
int authority_create(const char *folder, const char *name, double days, struct error *e);

/* Issues a certificate and writes FOLDER/NAME/; an incomplete folder that an interrupted call has left is completed.
 * Without `renew`, an existing certificate is -EEXIST. With it, certificate and key are replaced if they have this name
 * and role; the old ones stay valid until they expire or are revoked, and stay in place if writing fails. The new
 * certificate is valid from a day ago (clocks differ) until `days` from now, but not longer than the authority. */
int authority_issue(const char *folder, const char *name, enum tls_role role, double days, bool renew, struct error *e);

/* Revokes all valid certificates with this name or serial number. Writes crl.pem, also into the coordinators' folders.
 * *count: number of certificates that were not revoked before; if it is 0, crl.pem is copied again. Returns 0; -ENOENT
 * if no valid certificate has the name or number; -EBADMSG if *count certificates have been revoked, but a damaged file
 * in issued/ may have been another one. */
int authority_revoke(const char *folder, const char *name_or_serial, unsigned *count, struct error *e);

struct authority_entry {
	struct tls_peer subject;
	time_t valid_from, valid_until;
	bool is_revoked;
};
/* Lists the issued certificates, sorted by name, then by time; *entries is freed with mem_free. Returns -EBADMSG if
 * files in issued/ are damaged; the list then has all others. */
int authority_list(const char *folder, struct authority_entry **entries, size_t *count, struct error *e);

#endif
