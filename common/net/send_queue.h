/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What one connection sends: frames in the order in which they were given, encrypted if the connection uses TLS, with
 * a bound on what waits, and perhaps one on what waits in all queues. A member of its connection; all calls on the
 * loop's thread, none waits, each frame's memory is the queue's from the call on, whatever becomes of it.
 */
#ifndef COMMON_NET_SEND_QUEUE_H
#define COMMON_NET_SEND_QUEUE_H

#include "common/net/send_pool.h"
#include "common/net/tls.h"

#include <sys/queue.h>
#include <uv.h>

enum send_state {
	SEND_OPEN,
	SEND_DRAINING, /* takes no more frames, sends those that it has */
	SEND_REFUSED,  /* sends only what libuv has already: the peer reads why before the stream is closed */
	SEND_CLOSED,   /* the stream is being closed */
};

struct send_events {
	/* The stream must be closed; send_queue_close may be called within. */
	void (*failed)(void *user, const char *why);
	/* Nothing is left to send; not in SEND_CLOSED. */
	void (*drained)(void *user);
};

struct send_frame;

struct send_queue {
	uv_stream_t *stream;   /* its `data` is the owner's */
	struct tls_link *link; /* NULL: plaintext */
	const struct send_events *events;
	void *user;
	size_t limit; /* most bytes of frames that wait; a peer that lets more pile up has failed */
	enum send_state state;
	STAILQ_HEAD(, send_frame) frames; /* waiting to be encrypted */
	size_t unsent;			  /* bytes of frames that the kernel has not taken, and their overhead */
	size_t copied;			  /* bytes of the first frame that are also in what libuv has to write */
	struct send_share share;	  /* unsent and copied, in the pool of all queues */
	size_t in_flight;		  /* what libuv has to write; with TLS including its overhead */
	bool sent;			  /* the first frame has been taken */
	bool gave_way;			  /* it failed because all queues together held too much */
};

/* pool: NULL: no limit of all. Must outlive the queue. */
void send_queue_init(struct send_queue *q, uv_stream_t *stream, struct tls_link *link, size_t limit,
		     struct send_pool *pool, const struct send_events *events, void *user);
/* After the stream has been closed, so that libuv has given back all that it had. */
void send_queue_fini(struct send_queue *q);

/* The mem_alloc'd frame, with checksums unless it is the first. */
void send_queue_frame(struct send_queue *q, unsigned char *frame, size_t size);
/* mem_alloc'd bytes as they are. */
void send_queue_bytes(struct send_queue *q, unsigned char *bytes, size_t size);
/* A copy of bytes past the frames that wait, unencrypted. */
void send_queue_raw(struct send_queue *q, const void *bytes, size_t size);
/* Sends what TLS has produced by itself. */
void send_queue_flush(struct send_queue *q);
/* The handshake is over: frames that waited for it are sent. */
void send_queue_opened(struct send_queue *q);

/* To a later state; an earlier one changes nothing. */
void send_queue_close(struct send_queue *q, enum send_state to);
bool send_queue_is_empty(const struct send_queue *q);

#endif
