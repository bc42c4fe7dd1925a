/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One connection: frames in and out over a TCP stream of libuv, through TLS or not, with limits. All calls and
 * callbacks on the loop's thread. The connection owns its memory: after conn_close (or a fault) `closed` comes exactly
 * once, from the loop and never from inside another call, and the connection is gone when it returns; no other callback
 * comes in between.
 */
#ifndef COMMON_NET_CONN_H
#define COMMON_NET_CONN_H

#include "common/net/addr.h"
#include "common/net/tls.h"
#include "common/wire/envelope.h"
#include "common/wire/frame.h"

#include <uv.h>

struct conn;

struct conn_events {
	void (*opened)(void *user); /* conn_connect only, with TLS after the handshake; may be NULL */
	/* The envelope may be taken (copied and zeroed); the payload is there during the call only, but for
	 * conn_take_payload. */
	void (*message)(void *user, struct envelope *env, const unsigned char *payload, size_t payload_size);
	void (*partial)(void *user); /* bytes of a message that is not whole yet; may be NULL */
	void (*drained)(void *user); /* all that was sent is with the kernel; may be NULL */
	void (*closed)(void *user, const char *why);
};

struct conn_config {
	struct frame_limits limits;
	size_t send_limit;    /* bytes waiting to be sent; a peer that lets more pile up is cut off */
	double stall_seconds; /* a frame that has begun must be whole after this long + 1 s per 64 KB */
	double quiet_seconds; /* not a byte heard for so long: cut off; 0: never. No time in which the loop stood still
				 counts */
	struct tls *tls;      /* NULL: plaintext. Outlives the connection; who does not speak it is cut off */
};

/* -errno when not even an attempt could be made; else opened or closed comes later. */
int conn_connect(struct conn **c, uv_loop_t *loop, const struct net_addr *a, const struct conn_config *config,
		 const struct conn_events *events, void *user, struct error *e);
/* -errno: nobody was let in. The caller waits, and with it all others: the listener goes on when this is called again.
 */
int conn_accept(struct conn **c, uv_stream_t *listener, const struct conn_config *config,
		const struct conn_events *events, void *user, struct error *e);

void conn_set_limits(struct conn *c, struct frame_limits limits);
void conn_set_send_limit(struct conn *c, size_t bytes);
void conn_set_quiet(struct conn *c, double seconds);
void conn_peer_name(const struct conn *c, char *text, size_t size); /* numeric HOST:PORT */
const struct tls_peer *
conn_peer(const struct conn *c); /* by its certificate; NULL in plaintext and before the handshake */
/* In `closed`: it ended because one side does not accept the other's certificate, or only one of them speaks TLS. A
 * client may be `opened` and refused after that: the coordinator judges last. */
bool conn_distrust(const struct conn *c);
/* In `closed`: it ended because bytes from the peer did not have the checksum that came with them. */
bool conn_garbled(const struct conn *c);

/* Packs and sends; the payload is copied. A failure closes the connection, so callers need not look. */
void conn_send(struct conn *c, const Farm__Envelope *message, const void *payload, size_t payload_size);
void conn_send_frame(struct conn *c, unsigned char *frame,
		     size_t size); /* takes the mem_alloc'd frame; sealed unless it is the first */
/* The same of bytes as they are, for who plays a peer that sends anything. */
void conn_send_bytes(struct conn *c, unsigned char *bytes, size_t size);
/* Within `message`, once: its payload is the caller's from now on. */
struct buf conn_take_payload(struct conn *c);
size_t conn_unsent(const struct conn *c);

void conn_close(struct conn *c, const char *why);
void conn_close_when_sent(struct conn *c, const char *why); /* nothing is read any more; at most 5 s */

#endif
