/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One connection: frames over a TCP stream of libuv, with TLS or without, with limits. All calls and callbacks on the
 * loop's thread. The connection owns its memory. After conn_close (or a fault), `closed` is called exactly once, from
 * the loop and never inside another call, and the connection is freed when it returns; no other callback comes in
 * between.
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
	/* The envelope may be taken (copied and zeroed); the payload is valid during the call only, unless
	 * conn_take_payload takes it. */
	void (*message)(void *user, struct envelope *env, const unsigned char *payload, size_t payload_size);
	void (*partial)(
		void *user); /* a message is incomplete: bytes of it came, or it waits for the pool; may be NULL */
	void (*drained)(void *user); /* everything sent has been taken by the kernel; may be NULL */
	void (*closed)(void *user, const char *why);
};

struct conn_config {
	struct frame_limits limits;
	size_t send_limit;    /* most bytes waiting to be sent; a peer that lets more pile up is disconnected */
	double stall_seconds; /* a frame must be complete this long + 1 s per 64 KB after it began */
	double quiet_seconds; /* disconnect after so long without a byte; 0: never. Time in which the loop stood still
				 does not count */
	struct tls
		*tls; /* NULL: plaintext. Must outlive the connection; a peer that does not use TLS is disconnected */
	struct receive_pool *pool; /* for frames of more than 64 KB; NULL: no limit. Must outlive the connection */
	struct send_pool *sending; /* for all that waits to be sent; NULL: no limit. Must outlive the connection */
};

/* -errno if the attempt could not even be made; otherwise opened or closed is called later. */
int conn_connect(struct conn **c, uv_loop_t *loop, const struct net_addr *a, const struct conn_config *config,
		 const struct conn_events *events, void *user, struct error *e);
/* -errno: no connection was accepted. Further connections wait until this is called again. */
int conn_accept(struct conn **c, uv_stream_t *listener, const struct conn_config *config,
		const struct conn_events *events, void *user, struct error *e);

void conn_set_limits(struct conn *c, struct frame_limits limits);
void conn_set_send_limit(struct conn *c, size_t bytes);
void conn_set_quiet(struct conn *c, double seconds);
void conn_peer_name(const struct conn *c, char *text, size_t size); /* numeric HOST:PORT */
const struct tls_peer *
conn_peer(const struct conn *c); /* from its certificate; NULL in plaintext and before the handshake */
/* In `closed`: 0, or the connection ended because one side does not accept the other's certificate, or only one uses
 * TLS: -EACCES; -EKEYEXPIRED: by the date, which a new certificate changes, or a clock that is set right. A client may
 * be `opened` first and refused afterwards, because the coordinator checks last. */
int conn_distrust(const struct conn *c);
/* In `closed`: whether it ended because bytes from the peer did not match their checksum. */
bool conn_garbled(const struct conn *c);
/* In `closed`: whether it ended because too much waited to be sent to all peers, and this one did not read. */
bool conn_gave_way(const struct conn *c);

/* Packs and sends; the payload is copied. A failure closes the connection, so callers need not check. */
void conn_send(struct conn *c, const Farm__Envelope *message, const void *payload, size_t payload_size);
void conn_send_frame(struct conn *c, unsigned char *frame,
		     size_t size); /* takes the mem_alloc'd frame; adds checksums unless it is the first */
/* The same for raw bytes, for tests that send invalid ones. */
void conn_send_bytes(struct conn *c, unsigned char *bytes, size_t size);
/* Within `message`, once: takes ownership of its payload. */
struct buf conn_take_payload(struct conn *c);
size_t conn_unsent(const struct conn *c);

void conn_close(struct conn *c, const char *why);
void conn_close_when_sent(struct conn *c, const char *why); /* stops reading; waits at most 5 s */

#endif
