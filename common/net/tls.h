/* SPDX-License-Identifier: Apache-2.0 */
/*
 * TLS 1.3 (RFC 8446) with certificates on both sides, as a filter between a socket and the frames: it has no socket of
 * its own. A folder has ca.pem (the farm's authority), cert.pem and key.pem (our own), and optionally crl.pem (revoked
 * certificates). A certificate contains its role as a URI in the subject alternative name, "hslt:role:worker", and its
 * name as the common name. Callers accept coordinators only; coordinators accept anyone with a role. Host names are not
 * checked: a coordinator may move, and nobody else gets a coordinator's certificate. One thread. OpenSSL allocates; the
 * amount is bounded before the handshake ends (records of 16 KB, 64 KB in total) and after it (one record). No tickets,
 * no resumption, no early data, no renegotiation. Errors: -EACCES: one side does not accept the other, -EPROTO: invalid
 * bytes, -ECONNRESET: the peer has closed the connection.
 */
#ifndef COMMON_NET_TLS_H
#define COMMON_NET_TLS_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>
#include <time.h>

enum tls_role { TLS_NOBODY, TLS_COORDINATOR, TLS_WORKER, TLS_CLIENT, TLS_OPERATOR, TLS_ROLES };
const char *tls_role_name(enum tls_role r);

enum { TLS_NAME_MAX = 64 };
/* Letters, digits and ._@- , the first a letter or a digit, because names are displayed, logged, and used for
 * folders. */
bool tls_name_ok(const char *name);

struct tls_peer {
	char name[TLS_NAME_MAX + 1];
	char serial[48]; /* hexadecimal */
	enum tls_role role;
	time_t until; /* when the certificate expires */
};

/* "the certificate of NAME expires in 3.2 days, at 2031-05-01T12:00:00Z"; false: not within TLS_WARN_DAYS. */
enum { TLS_WARN_DAYS = 14 };
bool tls_expiry(const struct tls_peer *p, time_t now, char *text, size_t size);

/* ---- folders ---- */

struct tls;

/* -EPERM if others than owner and group can read the key, or if the folder is none; -ENOENT, -EBADMSG. */
int tls_open(struct tls **t, const char *folder, struct error *e);
void tls_close(struct tls *t); /* open links keep what they need */
/* Reads the files again if they have changed. 1: they had; new links use them, and open links are checked against
 * them at their next check. Negative: they had but are unusable, so the old ones stay (reported once, then 0; each
 * call tries again). -ENOENT: crl.pem is missing; the old list stays in force until there is a new one, and the
 * other files are used. */
int tls_refresh(struct tls *t, struct error *e);
const struct tls_peer *tls_self(const struct tls *t);
/* When the certificate of our authority expires; 0: there is none. */
time_t tls_authority_until(const struct tls *t);
/* Whether our own certificate or the authority's expires within TLS_WARN_DAYS, and which, in text; false: neither, text
 * is "". */
bool tls_warning(const struct tls *t, time_t now, char *text, size_t size);
/* The same, but true only once a day, or after the files were read again. */
bool tls_warning_due(struct tls *t, time_t now, char *text, size_t size);
/* How often open connections are checked again; default 60 s. */
void tls_set_recheck(struct tls *t, double seconds);
double tls_recheck_seconds(const struct tls *t);

/* ---- connections ---- */

struct tls_link;

int tls_link_new(struct tls_link **l, struct tls *t, bool listening, struct error *e);
void tls_link_free(struct tls_link *l);
/* Takes bytes from the socket; read until nothing is left before the next call. */
int tls_link_take(struct tls_link *l, const void *bytes, size_t size, struct error *e);
/* Decrypts: the number of bytes; 0: more are needed. Also performs the handshake; call it once to start. -EACCES: one
 * side does not accept the other's certificate; -EKEYEXPIRED: because of a date, by its clock. */
ssize_t tls_link_read(struct tls_link *l, void *out, size_t size, struct error *e);
/* After the handshake. Takes all of it; the output grows by as much. */
int tls_link_write(struct tls_link *l, const void *bytes, size_t size, struct error *e);
/* Bytes for the socket, also after a failure (an alert with the reason). Take all of them. */
size_t tls_link_output(struct tls_link *l, const unsigned char **bytes);
void tls_link_output_taken(struct tls_link *l);
bool tls_link_is_open(const struct tls_link *l);
const struct tls_peer *tls_link_peer(const struct tls_link *l); /* once the handshake is complete */
/* Whether the peer's certificate is still valid, by the folder's current files and the clock; errors as above. */
int tls_link_recheck(struct tls_link *l, struct error *e);

/* The alert for a peer that uses TLS on a port without it. */
extern const unsigned char tls_none_here[7];
/* Whether this can be the first byte of a TLS stream. A stream of frames never begins with it. */
bool tls_is_first_byte(unsigned char c);

/* ---- for the certificate authority ---- */

struct x509_st;
int tls_read_peer(struct x509_st *cert, struct tls_peer *p, struct error *e);

#endif
