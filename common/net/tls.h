/* SPDX-License-Identifier: Apache-2.0 */
/*
 * TLS 1.3 (RFC 8446) with certificates on both sides, as a filter between a socket and the frames: bytes in, bytes out,
 * no socket of its own. A folder has ca.pem (the farm's authority), cert.pem and key.pem (our own), and crl.pem (what
 * the authority revoked; read when it is there). A certificate's role stands in it as a URI of the subject's other
 * names, "hslt:role:worker"; its common name is who it is. Callers accept only coordinators, coordinators only who has
 * a role. Host names are not looked at: a coordinator may move, and nobody else gets a coordinator's certificate. One
 * thread. OpenSSL allocates; what a peer can make it take is bounded before the handshake ends (records of 16 KB, 64 KB
 * in all) and after it (one record). No tickets, no resumption, no early data, no renegotiation.
 * Errors: -EACCES one side does not accept the other, -EPROTO nonsense on the wire, -ECONNRESET the peer has ended it.
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
/* Letters, digits and ._@- , the first a letter or a digit: a name is shown, logged, and a folder's name. */
bool tls_name_ok(const char *name);

struct tls_peer {
	char name[TLS_NAME_MAX + 1];
	char serial[48]; /* hexadecimal */
	enum tls_role role;
	time_t until; /* the certificate's end */
};

/* "the certificate of NAME expires in 3.2 days, at 2031-05-01T12:00:00Z"; false: not within TLS_WARN_DAYS. */
enum { TLS_WARN_DAYS = 14 };
bool tls_expiry(const struct tls_peer *p, time_t now, char *text, size_t size);

/* ---- a folder ---- */

struct tls;

/* -EPERM when others than owner and group can read the key, -ENOENT, -EBADMSG. */
int tls_open(struct tls **t, const char *folder, struct error *e);
void tls_close(struct tls *t); /* links that live keep what they need */
/* Reads the files again if they have changed. 1: they had, new links work by them, and live ones are judged by them
 * when they are checked again; negative: they had and are of no use, the old ones stay (said once, then 0; each call
 * tries again, for what stood in the way may have passed). -ENOENT: crl.pem is gone; what it said holds until there is
 * another, the other files are taken up. */
int tls_refresh(struct tls *t, struct error *e);
const struct tls_peer *tls_self(const struct tls *t);
/* The end of the authority's certificate that signed ours; 0: there is none. */
time_t tls_authority_until(const struct tls *t);
/* What expires within TLS_WARN_DAYS, our own certificate or the authority's; false: neither, text is "". */
bool tls_warning(const struct tls *t, time_t now, char *text, size_t size);
/* The same, and true only when it was not said for a day, or files have been read since. */
bool tls_warning_due(struct tls *t, time_t now, char *text, size_t size);
/* How often live connections are checked again: 60 s at first. */
void tls_set_recheck(struct tls *t, double seconds);
double tls_recheck_seconds(const struct tls *t);

/* ---- one connection ---- */

struct tls_link;

int tls_link_new(struct tls_link **l, struct tls *t, bool listening, struct error *e);
void tls_link_free(struct tls_link *l);
/* What came from the socket; read until nothing comes before the next. */
int tls_link_take(struct tls_link *l, const void *bytes, size_t size, struct error *e);
/* What it means: the number of bytes; 0: more must come. Does the handshake, too: call it once to begin. */
ssize_t tls_link_read(struct tls_link *l, void *out, size_t size, struct error *e);
/* After the handshake. All of it is taken; the output grows by as much. */
int tls_link_write(struct tls_link *l, const void *bytes, size_t size, struct error *e);
/* What must go to the socket, also after a failure (it tells the peer why). Taken as a whole. */
size_t tls_link_output(struct tls_link *l, const unsigned char **bytes);
void tls_link_output_taken(struct tls_link *l);
bool tls_link_is_open(const struct tls_link *l);
const struct tls_peer *tls_link_peer(const struct tls_link *l); /* once it is open */
/* Is the peer's certificate still good by the folder's files of now, and by the clock? */
int tls_link_recheck(struct tls_link *l, struct error *e);

/* An alert that tells a peer who speaks TLS to a port without that there is none. */
extern const unsigned char tls_none_here[7];
/* Can this be the first byte of a TLS stream? Of a stream of frames it cannot. */
bool tls_is_first_byte(unsigned char c);

/* ---- for those who make certificates ---- */

struct x509_st;
int tls_read_peer(struct x509_st *cert, struct tls_peer *p, struct error *e);

#endif
