/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One connection: frames over a TCP stream of libuv, with TLS or without, with limits. All calls and callbacks are made
 * on the loop's thread. The connection owns its memory. After conn_close (or a fault), `closed` is called exactly once,
 * from the loop and never inside another call; no other callback comes before it, and the connection is freed when it
 * returns.
 */
#ifndef COMMON_NET_CONN_H
#define COMMON_NET_CONN_H

#include "common/net/addr.h"
#include "common/net/receive_pool.h"
#include "common/net/send_pool.h"
#include "common/net/tls.h"
#include "common/wire/envelope.h"
#include "common/wire/frame.h"

#include <uv.h>

struct conn;

struct conn_events {
	void (*opened)(void *user); /* for conn_connect only; with TLS after the handshake; may be NULL */
	/* A message has arrived. The callback may keep the envelope (copy and zero it). The payload is valid during the
	 * call only, unless conn_take_payload takes it. */
	void (*message)(void *user, struct envelope *env, const unsigned char *payload, size_t payload_size);
	/* A message is incomplete: some bytes of it have arrived, or it waits for the pool. May be NULL. */
	void (*partial)(void *user);
	void (*drained)(void *user); /* the kernel has taken everything that was sent; may be NULL */
	void (*closed)(void *user, const char *why);
};

struct conn_config {
	struct frame_limits limits;
	size_t send_limit;	     /* most bytes waiting to be sent; a peer that lets more pile up is disconnected */
	double stall_seconds;	     /* a frame must be complete after this time plus 1 s per 64 KB */
	double idle_timeout_seconds; /* the peer is disconnected after this time without a byte, not counting time in
				 which the loop was busy; 0: never */
	/* These three must outlive the connection. */
	struct tls *tls;		   /* a peer that does not use TLS is disconnected; NULL: plaintext */
	struct receive_pool *receive_pool; /* bounds frames of more than 64 KB over all connections; NULL: no limit */
	struct send_pool *send_pool;	   /* bounds what waits to be sent over all connections; NULL: no limit */
};

/* Connects. Returns -errno if the attempt could not be made; otherwise `opened` or `closed` is called later. */
int conn_connect(struct conn **out, uv_loop_t *loop, const struct net_addr *a, const struct conn_config *config,
		 const struct conn_events *events, void *user, struct error *e);
/* Accepts a waiting connection. Returns -errno if none was accepted; further connections wait until the next call. */
int conn_accept(struct conn **out, uv_stream_t *listener, const struct conn_config *config,
		const struct conn_events *events, void *user, struct error *e);

void conn_set_limits(struct conn *c, struct frame_limits limits);
void conn_set_send_limit(struct conn *c, size_t bytes);
void conn_set_idle_timeout(struct conn *c, double seconds);
void conn_peer_name(const struct conn *c, char *text, size_t size); /* numeric HOST:PORT */
/* Returns the peer by its certificate; NULL in plaintext and before the handshake is complete. */
const struct tls_peer *conn_peer(const struct conn *c);

/* The next three functions tell, within `closed`, why the connection ended. */

/* Returns -EACCES if one side does not accept the other's certificate, or only one side uses TLS; -EKEYEXPIRED if the
 * date of a certificate is the reason, which a new certificate or a corrected clock will change; otherwise 0. A client
 * may be `opened` first and refused afterwards, because the coordinator checks last. */
int conn_certificate_error(const struct conn *c);
/* Returns whether bytes from the peer did not match their checksum. */
bool conn_had_bad_checksum(const struct conn *c);
/* Returns whether too much waited to be sent to all peers, of which this one did not read its part. */
bool conn_was_evicted(const struct conn *c);

/* Packs and sends a message; the payload is copied. A failure closes the connection, so callers need not check. */
void conn_send(struct conn *c, const Farm__Envelope *message, const void *payload, size_t payload_size);
/* Sends a packed frame, which is freed with mem_free in any case; adds checksums unless it is the first frame. */
void conn_send_frame(struct conn *c, unsigned char *frame, size_t size);
/* Like conn_send_frame, but sends the bytes as they are; for tests that send invalid ones. */
void conn_send_bytes(struct conn *c, unsigned char *bytes, size_t size);
/* Within `message`, once: takes ownership of its payload. */
struct buf conn_take_payload(struct conn *c);
size_t conn_unsent_bytes(const struct conn *c); /* bytes that the kernel has not taken yet */

void conn_close(struct conn *c, const char *why);
void conn_close_when_sent(struct conn *c, const char *why); /* sends everything first; waits at most 5 s */

#endif
