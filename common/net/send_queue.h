/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The outgoing frames of one connection: sent in order, encrypted if the connection uses TLS, with a bound on the bytes
 * that wait and, by a send_pool, one on the bytes that wait in all queues. The queue is a member of its connection. All
 * calls are made on the loop's thread and none waits. A frame's memory belongs to the queue from the call on, also
 * after a failure.
 */
#ifndef COMMON_NET_SEND_QUEUE_H
#define COMMON_NET_SEND_QUEUE_H

#include "common/net/send_pool.h"
#include "common/net/tls.h"

#include <sys/queue.h>
#include <uv.h>

enum send_state {
	SEND_OPEN,
	SEND_DRAINING, /* takes no more frames, but sends those that it has */
	SEND_REFUSED,  /* sends only the bytes that libuv has already, so that the peer can read why it was refused */
	SEND_CLOSED,   /* the stream is being closed */
};

struct send_events {
	/* The stream must be closed; send_queue_close may be called within. */
	void (*failed)(void *user, const char *why);
	/* Nothing is left to send. Not called in SEND_CLOSED. */
	void (*drained)(void *user);
};

struct send_frame;

struct send_queue {
	uv_stream_t *stream;   /* the owner may use its `data` */
	struct tls_link *link; /* NULL: plaintext */
	const struct send_events *events;
	void *user;
	size_t max_bytes; /* most bytes of frames that wait; if a peer lets more pile up, the queue fails */
	enum send_state state;
	STAILQ_HEAD(, send_frame) frames; /* frames waiting to be encrypted */
	size_t unsent_bytes;		  /* bytes of frames that the kernel has not taken, and their overhead */
	size_t copied_bytes;		  /* bytes of the first frame that libuv also has, encrypted */
	struct send_share share;	  /* share of the pool: unsent_bytes + copied_bytes */
	size_t in_flight_bytes;		  /* bytes that libuv has to write; with TLS including its overhead */
	bool has_sent_first_frame;	  /* the first frame has been given to the queue */
	bool was_evicted;		  /* the queue failed because all queues together held too much */
};

/* Initialises a queue. pool: bounds all queues together, and must outlive them; NULL: no such bound. */
void send_queue_init(struct send_queue *q, uv_stream_t *stream, struct tls_link *link, size_t limit,
		     struct send_pool *pool, const struct send_events *events, void *user);
/* Call after the stream has been closed, when libuv has returned all writes. */
void send_queue_fini(struct send_queue *q);

/* Sends a frame, allocated with mem_alloc; adds checksums unless it is the first. */
void send_queue_send_frame(struct send_queue *q, unsigned char *frame, size_t size);
/* Sends bytes, allocated with mem_alloc, as they are. */
void send_queue_send_bytes(struct send_queue *q, unsigned char *bytes, size_t size);
/* Sends a copy of bytes at once, before the frames that wait, and unencrypted. */
void send_queue_send_raw(struct send_queue *q, const void *bytes, size_t size);
/* Sends bytes that TLS has produced by itself, such as those of the handshake. */
void send_queue_flush(struct send_queue *q);
/* Call when the handshake is complete: sends frames that waited for it. */
void send_queue_start(struct send_queue *q);

/* Moves to a later state; an earlier one is ignored. */
void send_queue_close(struct send_queue *q, enum send_state to);
bool send_queue_is_empty(const struct send_queue *q); /* nothing waits, here or in libuv */

#endif
