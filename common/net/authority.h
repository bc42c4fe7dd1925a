/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A farm's own certificate authority in a folder: ca.pem, ca.key (0600), crl.pem, issued/SERIAL.pem, and one folder per
 * name with the files that --tls needs: ca.pem, cert.pem, key.pem (0600), crl.pem. ECDSA on P-256 with SHA-256; X.509
 * v3 and revocation lists as in RFC 5280. A lock admits one process at a time. One thread; files are replaced by
 * rename.
 */
#ifndef COMMON_NET_AUTHORITY_H
#define COMMON_NET_AUTHORITY_H

#include "common/net/tls.h"

#include <time.h>

/* -EEXIST: the folder has one already. */
int authority_init(const char *folder, const char *name, double days, struct error *e);

/* Writes FOLDER/NAME/, and completes one that an interrupted call has left. renew: replaces the existing certificate
 * and key of this name and role (otherwise -EEXIST). The old ones stay valid until they expire or are revoked; when
 * writing fails they are still in place. Valid from a day ago (clocks differ) for `days`, but not longer than the
 * authority. */
int authority_issue(const char *folder, const char *name, enum tls_role role, double days, bool renew, struct error *e);

/* Revokes whatever has this name or serial number. Writes crl.pem, also into the coordinators' folders. *count: of
 * certificates that were not revoked before; if there are none, crl.pem is copied again. -ENOENT: no valid certificate
 * has it. -EBADMSG: *count are revoked, and a damaged file in issued/ may have been another one. */
int authority_revoke(const char *folder, const char *name_or_serial, unsigned *count, struct error *e);

struct authority_entry {
	struct tls_peer who;
	time_t from, until;
	bool revoked;
};
/* Sorted by name, then by time; mem_alloc'd. -EBADMSG: these are all but what is damaged. */
int authority_list(const char *folder, struct authority_entry **entries, size_t *count, struct error *e);

#endif
