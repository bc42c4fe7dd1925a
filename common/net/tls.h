/* SPDX-License-Identifier: Apache-2.0 */
/*
 * TLS 1.3 (RFC 8446) with certificates on both sides, as a filter between a socket and the frames: it has no socket of
 * its own.
 *
 * A folder has ca.pem (the farm's authority), cert.pem and key.pem (the program's own), and optionally crl.pem (revoked
 * certificates). A certificate contains its role as a URI in the subject alternative name, "hslt:role:worker", and its
 * name as the common name. The connecting side accepts coordinators only; coordinators accept anyone with a role. Host
 * names are not checked: a coordinator may move, and nobody else gets a coordinator's certificate.
 *
 * One thread. OpenSSL allocates; the amount is bounded before the handshake ends (records of 16 KB, 64 KB in total) and
 * after it (one record). No tickets, no resumption, no early data, no renegotiation. Errors of links: -EACCES if one
 * side does not accept the other, -EPROTO for invalid bytes, -ECONNRESET if the peer has closed the connection,
 * -ENOMEM.
 */
#ifndef COMMON_NET_TLS_H
#define COMMON_NET_TLS_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>
#include <time.h>

enum tls_role { TLS_NO_ROLE, TLS_COORDINATOR, TLS_WORKER, TLS_CLIENT, TLS_OPERATOR, TLS_ROLES };
const char *tls_role_name(enum tls_role r);

enum { TLS_NAME_MAX = 64 };
/* Returns whether a name has only letters, digits and ._@- and begins with a letter or digit: names are displayed,
 * logged, and used for folders. */
bool tls_name_is_valid(const char *name);

struct tls_peer {
	char name[TLS_NAME_MAX + 1];
	char serial[48]; /* hexadecimal */
	enum tls_role role;
	time_t expiry_time; /* when the certificate expires */
};

/* Prints "the certificate of NAME expires in 3.2 days, at 2031-05-01T12:00:00Z". Returns false, with an empty text, if
 * it does not expire within TLS_WARN_DAYS. */
enum { TLS_WARN_DAYS = 14 };
bool tls_describe_expiry(const struct tls_peer *p, time_t now, char *text, size_t size);

/* ---- folders ---- */

struct tls;

/* Reads a folder. Returns -EPERM if the key is readable for others than owner and group, or if there is no such folder;
 * -ENOENT or -EBADMSG for a missing or invalid file. */
int tls_open(struct tls **out, const char *folder, struct error *e);
void tls_close(struct tls *t); /* links may be used further, except for tls_link_recheck */
/* Reads the files again if they have changed. Returns 0 if they have not; 1 if new files have been read, which new
 * links then use and open links are checked against; -ENOENT if that is so, but crl.pem is missing, and the old list
 * stays in force until there is a new one; another -errno if the new files are unusable, and the old ones stay in use
 * (reported once, then 0; each call tries again). */
int tls_refresh(struct tls *t, struct error *e);
const struct tls_peer *tls_own_certificate(const struct tls *t); /* the program's own certificate */
/* Returns when the certificate of the own authority expires; 0 if there is none. */
time_t tls_authority_expiry(const struct tls *t);
/* Returns whether the own certificate or the authority's expires within TLS_WARN_DAYS, and prints which; the text is
 * empty if neither does. */
bool tls_expiry_warning(const struct tls *t, time_t now, char *text, size_t size);
/* Like tls_expiry_warning, but returns true only once a day, or after the files were read again. */
bool tls_expiry_warning_due(struct tls *t, time_t now, char *text, size_t size);
/* Sets and returns how often open connections are checked again; 60 s by default. */
void tls_set_recheck(struct tls *t, double seconds);
double tls_recheck_seconds(const struct tls *t);

/* ---- connections ---- */

struct tls_link;

int tls_link_new(struct tls_link **out, struct tls *t, bool is_server, struct error *e);
void tls_link_free(struct tls_link *l);
/* Takes bytes from the socket. Call tls_link_read until it returns 0 before the next call. */
int tls_link_receive(struct tls_link *l, const void *bytes, size_t size, struct error *e);
/* Decrypts. Returns the number of bytes; 0 if more input is needed. Also performs the handshake, which the first call
 * begins. -EACCES: one side does not accept the other's certificate; -EKEYEXPIRED: because of a date, by its clock. */
ssize_t tls_link_read(struct tls_link *l, void *out, size_t size, struct error *e);
/* Encrypts all bytes into the output. Only after the handshake. */
int tls_link_write(struct tls_link *l, const void *bytes, size_t size, struct error *e);
/* Returns the output, the bytes for the socket; after a failure, an alert with the reason. Send all of them, then call
 * tls_link_clear_output. */
size_t tls_link_output(struct tls_link *l, const unsigned char **bytes);
void tls_link_clear_output(struct tls_link *l);
bool tls_link_is_open(const struct tls_link *l);		/* the handshake is complete */
const struct tls_peer *tls_link_peer(const struct tls_link *l); /* once the handshake is complete */
/* Checks that the peer's certificate is still valid by the folder's current files and the clock; errors as for
 * tls_link_read. */
int tls_link_recheck(struct tls_link *l, struct error *e);

/* The alert that is sent to a peer that uses TLS where this side does not, or the reverse. */
extern const unsigned char tls_mismatch_alert[7];
/* Returns whether this can be the first byte of a TLS stream. A stream of frames never begins with it. */
bool tls_is_first_byte(unsigned char c);

/* ---- for the certificate authority ---- */

struct x509_st;
/* Reads name, serial number, role and expiry from a certificate; -EACCES if it has no valid name or not one role. */
int tls_read_peer(struct x509_st *cert, struct tls_peer *p, struct error *e);

#endif
