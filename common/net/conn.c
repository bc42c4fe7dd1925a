/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bytes that libuv reads go through TLS, if used, into the frame reader, which calls `message` for each complete frame.
 * Outgoing frames are queued, encrypted if needed, and handed to libuv. A timer notices peers that are silent or do not
 * read, and certificates that expire or are revoked meanwhile.
 *
 * Failures end the connection, once, with a reason in words: frames beyond the limits, plaintext where TLS is required
 * (and the reverse), a peer that stalls, no memory.
 */
#include "common/net/conn.h"

#include "common/base/mem.h"
#include "common/base/text.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum {
	READ_BYTES = 1 << 16,
	TICK_MS = 250,
	TICK_MS_MOST = 1000, /* if nothing is due earlier */
	LINGER_MS = 5000,
	REFUSED_MS = 1000,    /* time for a peer to read the reason */
	HANDSHAKE_MS = 10000, /* of TLS records */
	BYTES_PER_SECOND = 1 << 16,
	PIECE = 1 << 16,  /* bytes encrypted at a time */
	WINDOW = 1 << 20, /* encrypted bytes that the kernel has not taken yet */
	FRAME_COST = 256, /* overhead of a queued frame besides its bytes */
};

/* Replaces the prefix of a frame. */
struct head {
	unsigned char bytes[FRAME_SEALED_PREFIX];
	size_t size;
};

/* A frame waiting to be encrypted. */
struct queued {
	struct queued *next;
	struct head head; /* empty: it is being sent */
	unsigned char *bytes;
	size_t size, at, plain; /* plaintext: what it counts for in `unsent` */
};

struct conn {
	uv_tcp_t tcp;
	uv_timer_t timer;
	uv_connect_t connecting;
	struct conn_config config;
	const struct conn_events *events;
	void *user;
	struct frame_reader reader;
	struct tls_link *link; /* NULL: plaintext */
	struct queued *queue, **queue_last;
	size_t unsent;		/* bytes of frames that the kernel has not taken, and their overhead */
	size_t in_flight;	/* what libuv has to write; with TLS including its overhead */
	uint64_t clock, ticked; /* ms of the connection's clock and of the loop's clock at the last tick */
	uint64_t begun, last_read, frame_begun; /* ms of the connection's clock at that time */
	uint64_t checked;			/* ms of the loop's clock: the next check of the peer's certificate */
	uint64_t linger_until;			/* 0: not closing */
	int open_handles;
	bool accepted, sniffed, closing;
	bool waits_for_peer; /* tell the peer why before closing */
	bool distrust, garbled;
	bool sent; /* the first frame has been sent */
	char why[256];
};

/* Holds what was just read or decrypted: libuv calls back with it before it reads more, and nothing is read inside a
 * callback. */
static _Thread_local char chunk[READ_BYTES];

struct sending {
	uv_write_t request;
	struct head head;
	unsigned char *bytes;
	size_t size, plain; /* what it counts for in in_flight and in unsent */
};

static void on_sent(uv_write_t *r, int status);

static void free_queue(struct conn *c)
{
	while (c->queue) {
		struct queued *next = c->queue->next;
		mem_free(c->queue->bytes);
		mem_free(c->queue);
		c->queue = next;
	}
}

static void on_handle_closed(uv_handle_t *h)
{
	struct conn *c = h->data;
	if (--c->open_handles)
		return;
	c->events->closed(c->user, c->why);
	frame_reader_fini(&c->reader);
	tls_link_free(c->link);
	free_queue(c);
	mem_free(c);
}

void conn_close(struct conn *c, const char *why)
{
	if (c->closing)
		return;
	c->closing = true;
	if (!c->linger_until)
		text_copy(c->why, sizeof c->why, why);
	uv_close((uv_handle_t *)&c->timer, on_handle_closed);
	uv_close((uv_handle_t *)&c->tcp, on_handle_closed);
}

/* ---- the connection's clock ---- */

/* Stands still while the loop does: whatever arrived meanwhile has not been read yet, and no peer is to blame for
 * that. */
static uint64_t clock_of(const struct conn *c)
{
	uint64_t since = uv_now(c->tcp.loop) - c->ticked, most = uv_timer_get_repeat(&c->timer);
	return c->clock + (since < most ? since : most);
}

static void tick_every(struct conn *c, uint64_t ms)
{
	if (c->closing)
		return;
	c->clock = clock_of(c);
	c->ticked = uv_now(c->tcp.loop);
	uv_timer_set_repeat(&c->timer, ms);
	uv_timer_again(&c->timer);
}

/* ---- reading ---- */

static void on_alloc(uv_handle_t *h, size_t suggested, uv_buf_t *out)
{
	(void)suggested;
	(void)h;
	*out = uv_buf_init(chunk, sizeof chunk);
}

static void deliver(struct conn *c)
{
	struct envelope env;
	struct error e;
	int rc = envelope_unpack(&env, c->reader.header.bytes, c->reader.header.size, &e);
	if (rc) {
		c->garbled = rc == -EILSEQ;
		conn_close(c, e.text);
		return;
	}
	c->events->message(c->user, &env, c->reader.payload.bytes, c->reader.payload.size);
	envelope_fini(&env);
}

struct buf conn_take_payload(struct conn *c)
{
	struct buf payload = c->reader.payload;
	c->reader.payload = (struct buf){.limit = payload.limit};
	return payload;
}

/* Frames in plaintext, after decryption. */
static void receive(struct conn *c, const unsigned char *bytes, size_t size)
{
	size_t at = 0;
	c->last_read = clock_of(c);
	while (at < size && !c->closing && !c->linger_until) {
		struct error e;
		size_t used;
		bool was_midway = frame_reader_is_midway(&c->reader);
		int rc = frame_reader_take(&c->reader, bytes + at, size - at, &used, &e);
		at += used;
		if (!was_midway)
			c->frame_begun = c->last_read;
		if (rc < 0) {
			c->garbled = rc == -EILSEQ;
			conn_close(c, e.text);
		} else if (rc) {
			deliver(c);
			frame_reader_drop(
				&c->reader); /* now, rather than with the next frame, which may be seconds away */
		}
	}
	if (c->events->partial && frame_reader_is_midway(&c->reader) && !c->closing && !c->linger_until)
		c->events->partial(c->user);
}

/* Takes the mem_alloc'd bytes; sends `head`, then the bytes after the first `skip`. */
static void to_kernel(struct conn *c, struct head head, unsigned char *bytes, size_t size, size_t skip, size_t plain)
{
	struct sending *s = mem_alloc(1, sizeof *s);
	if (!s) {
		mem_free(bytes);
		conn_close(c, "no memory to send");
		return;
	}
	*s = (struct sending){.head = head, .bytes = bytes, .size = head.size + size - skip, .plain = plain};
	s->request.data = s;
	uv_buf_t both[] = {uv_buf_init((char *)s->head.bytes, (unsigned)head.size),
			   uv_buf_init((char *)bytes + skip, (unsigned)(size - skip))};
	int rc = uv_write(&s->request, (uv_stream_t *)&c->tcp, both, 2, on_sent);
	if (rc) {
		mem_free(bytes);
		mem_free(s);
		conn_close(c, uv_strerror(rc));
		return;
	}
	c->in_flight += head.size + size - skip;
}

static void copy_to_kernel(struct conn *c, const void *bytes, size_t size, size_t plain)
{
	unsigned char *copy = mem_alloc(size, 1);
	if (copy)
		to_kernel(c, (struct head){.size = 0}, memcpy(copy, bytes, size), size, 0, plain);
	else
		conn_close(c, "no memory to send");
}

/* Sends what TLS has produced, which contains `plain` bytes of frames. */
static void flush(struct conn *c, size_t plain)
{
	const unsigned char *bytes;
	size_t size = tls_link_output(c->link, &bytes);
	if (!size || c->closing)
		return;
	if (c->in_flight > 2 * WINDOW) /* a peer that sends requests and does not read the answers */
		conn_close(c, "the peer does not read what is sent to it");
	else
		copy_to_kernel(c, bytes, size, plain);
	tls_link_output_taken(c->link);
}

/* Tells the peer the reason, if there is one, and gives it time to read: the kernel would discard it if data arrived
 * after the socket was closed. */
static void refuse(struct conn *c, int rc, const char *why)
{
	c->distrust = rc == -EACCES;
	if (!c->linger_until)
		text_copy(c->why, sizeof c->why, why);
	c->linger_until = uv_now(c->tcp.loop) + REFUSED_MS;
	tick_every(c, TICK_MS);
	c->waits_for_peer = true;
	if (!c->in_flight)
		conn_close(c, why);
}

static void pump(struct conn *c)
{
	static _Thread_local unsigned char first[PIECE];
	while (c->queue && tls_link_is_open(c->link) && c->in_flight < WINDOW && !c->closing) {
		struct queued *q = c->queue;
		struct error e;
		size_t most = PIECE - q->head.size, size = q->size - q->at < most ? q->size - q->at : most;
		const unsigned char *bytes = q->bytes + q->at;
		if (q->head.size) { /* in the same record as the next one */
			memcpy(first, q->head.bytes, q->head.size);
			memcpy(first + q->head.size, bytes, size);
			bytes = first;
		}
		if (tls_link_write(c->link, bytes, q->head.size + size, &e)) {
			conn_close(c, e.text);
			return;
		}
		q->head.size = 0;
		q->at += size;
		if (q->at == q->size)
			size = q->plain; /* what is left */
		q->plain -= size;
		flush(c, size);
		if (q->at < q->size)
			continue;
		c->queue = q->next;
		if (!c->queue)
			c->queue_last = &c->queue;
		mem_free(q->bytes);
		mem_free(q);
	}
}

/* Encrypted bytes; with none, starts the handshake. */
static void take_encrypted(struct conn *c, const void *bytes, size_t size)
{
	struct error e;
	ssize_t n = tls_link_take(c->link, bytes, size, &e);
	while (n >= 0 && !c->closing) {
		bool was_open = tls_link_is_open(c->link);
		n = tls_link_read(c->link, chunk, sizeof chunk, &e);
		flush(c, 0);
		if (!was_open && tls_link_is_open(c->link) && !c->closing) {
			c->last_read = clock_of(c);
			c->checked = uv_now(c->tcp.loop);
			if (c->events->opened && !c->accepted)
				c->events->opened(c->user);
			pump(c);
		}
		if (n > 0)
			receive(c, (const unsigned char *)chunk, (size_t)n);
		else if (n == 0)
			return;
	}
	if (n < 0 && !c->closing) {
		flush(c, 0);
		refuse(c, (int)n, e.text);
	}
}

/* No frame begins like a TLS record. */
static bool is_tls(struct conn *c, const char *bytes, size_t size)
{
	bool first = !c->sniffed && size;
	c->sniffed = true;
	if (!first || !tls_is_first_byte((unsigned char)*bytes))
		return false;
	if (c->accepted)
		copy_to_kernel(c, tls_none_here, sizeof tls_none_here, 0);
	refuse(c, -EACCES, "the peer speaks TLS, and this side does not: both need --tls DIR, or neither");
	return true;
}

static void on_read(uv_stream_t *s, ssize_t count, const uv_buf_t *b)
{
	struct conn *c = s->data;
	if (count < 0) {
		bool midway = c->link && !tls_link_is_open(c->link);
		conn_close(c, count != UV_EOF ? uv_strerror((int)count)
			      : midway	      ? "the peer hung up during the TLS handshake"
					      : "the peer hung up");
	} else if (c->closing || c->waits_for_peer) {
		return;
	} else if (c->link) {
		take_encrypted(c, b->base, (size_t)count);
	} else if (!is_tls(c, b->base, (size_t)count)) {
		receive(c, (const unsigned char *)b->base, (size_t)count);
	}
}

/* ---- time ---- */

static bool has_stalled(const struct conn *c)
{
	double allowed = c->config.stall_seconds + (double)c->reader.payload_size / BYTES_PER_SECOND;
	return frame_reader_is_midway(&c->reader) && (double)(c->clock - c->frame_begun) > 1000 * allowed;
}

/* Checks the peer's certificate again: it may have expired, or been revoked. */
static void check_again(struct conn *c, uint64_t now)
{
	struct error e;
	if (!c->link || !tls_link_is_open(c->link) ||
	    (double)(now - c->checked) < 1000 * tls_recheck_seconds(c->config.tls))
		return;
	c->checked = now;
	if (tls_link_recheck(c->link, &e)) {
		c->distrust = true;
		conn_close(c, e.text);
	}
}

static void on_tick(uv_timer_t *t)
{
	struct conn *c = t->data;
	uint64_t now = uv_now(t->loop);
	c->clock = clock_of(c);
	c->ticked = now;
	check_again(c, now);
	if (c->linger_until && now >= c->linger_until)
		conn_close(c, c->why);
	else if (c->link && !tls_link_is_open(c->link) && c->clock - c->begun > HANDSHAKE_MS)
		conn_close(c, "the TLS handshake was not finished in time");
	else if (has_stalled(c))
		conn_close(c, "a frame was not completed in time");
	else if (c->config.quiet_seconds > 0 && (double)(c->clock - c->last_read) > 1000 * c->config.quiet_seconds)
		conn_close(c, "silent for too long");
}

/* ---- opening and closing ---- */

static int conn_new(struct conn **out, uv_loop_t *loop, bool accepted, const struct conn_config *config,
		    const struct conn_events *events, void *user, struct error *e)
{
	struct conn *c = mem_alloc(1, sizeof *c);
	if (!c)
		return error_set(e, ENOMEM, "no memory for a connection");
	int rc = config->tls ? tls_link_new(&c->link, config->tls, accepted, e) : 0;
	if (rc) {
		mem_free(c);
		return rc;
	}
	c->accepted = accepted;
	c->queue_last = &c->queue;
	c->config = *config;
	c->events = events;
	c->user = user;
	frame_reader_init(&c->reader, config->limits);
	rc = uv_tcp_init(loop, &c->tcp);
	if (rc) {
		tls_link_free(c->link);
		mem_free(c);
		return error_set(e, -rc, "no socket: %s", uv_strerror(rc));
	}
	uv_timer_init(loop, &c->timer);
	c->tcp.data = c->timer.data = c->connecting.data = c;
	c->open_handles = 2;
	c->ticked = uv_now(loop);
	uv_timer_start(&c->timer, on_tick, TICK_MS, TICK_MS);
	*out = c;
	return 0;
}

static int start(struct conn *c)
{
	uv_tcp_nodelay(&c->tcp, 1);
	uv_tcp_keepalive(&c->tcp, 1, 60);
	c->begun = c->last_read = clock_of(c);
	int rc = uv_read_start((uv_stream_t *)&c->tcp, on_alloc, on_read);
	if (!rc && c->link)
		take_encrypted(c, NULL, 0);
	return rc;
}

static void on_connected(uv_connect_t *r, int status)
{
	struct conn *c = r->data;
	if (c->closing)
		return;
	int rc = status ? status : start(c);
	if (rc)
		conn_close(c, uv_strerror(rc));
	else if (c->events->opened && !c->link)
		c->events->opened(c->user);
}

int conn_connect(struct conn **out, uv_loop_t *loop, const struct net_addr *a, const struct conn_config *config,
		 const struct conn_events *events, void *user, struct error *e)
{
	struct conn *c = NULL;
	int rc = conn_new(&c, loop, false, config, events, user, e);
	if (rc)
		return rc;
	*out = c;
	rc = uv_tcp_connect(&c->connecting, &c->tcp, (const struct sockaddr *)&a->storage, on_connected);
	if (rc)
		conn_close(c, uv_strerror(rc));
	return 0;
}

int conn_accept(struct conn **out, uv_stream_t *listener, const struct conn_config *config,
		const struct conn_events *events, void *user, struct error *e)
{
	struct conn *c = NULL;
	int rc = conn_new(&c, listener->loop, true, config, events, user, e);
	if (rc)
		return rc;
	*out = c;
	rc = uv_accept(listener, (uv_stream_t *)&c->tcp);
	if (!rc)
		rc = start(c);
	if (rc)
		conn_close(c, uv_strerror(rc));
	return 0;
}

void conn_set_limits(struct conn *c, struct frame_limits limits)
{
	c->reader.limits = limits;
}

void conn_set_send_limit(struct conn *c, size_t bytes)
{
	c->config.send_limit = bytes;
}

void conn_set_quiet(struct conn *c, double seconds)
{
	c->config.quiet_seconds = seconds;
	double ms = 1000 * seconds / 16;
	tick_every(c, ms > TICK_MS_MOST ? TICK_MS_MOST : ms < TICK_MS ? TICK_MS : (uint64_t)ms);
}

void conn_peer_name(const struct conn *c, char *text, size_t size)
{
	struct net_addr a;
	int length = sizeof a.storage;
	memset(&a, 0, sizeof a);
	if (uv_tcp_getpeername(&c->tcp, (struct sockaddr *)&a.storage, &length))
		snprintf(text, size, "?");
	else
		net_addr_format(&a, text, size);
}

const struct tls_peer *conn_peer(const struct conn *c)
{
	return c->link && tls_link_is_open(c->link) ? tls_link_peer(c->link) : NULL;
}

bool conn_distrust(const struct conn *c)
{
	return c->distrust;
}

bool conn_garbled(const struct conn *c)
{
	return c->garbled;
}

/* ---- writing ---- */

static void on_sent(uv_write_t *r, int status)
{
	struct sending *s = r->data;
	struct conn *c = r->handle->data;
	c->in_flight -= s->size;
	c->unsent -= s->plain;
	mem_free(s->bytes);
	mem_free(s);
	if (c->closing)
		return;
	if (status) {
		conn_close(c, uv_strerror(status));
		return;
	}
	if (c->link && !c->waits_for_peer)
		pump(c);
	if (c->closing || c->in_flight || c->unsent || c->waits_for_peer)
		return;
	if (c->linger_until)
		conn_close(c, c->why);
	else if (c->events->drained)
		c->events->drained(c->user);
}

/* Takes the bytes, also on failure. */
static void enqueue(struct conn *c, struct head head, unsigned char *bytes, size_t size, size_t skip)
{
	struct queued *q = mem_alloc(1, sizeof *q);
	if (!q) {
		mem_free(bytes);
		conn_close(c, "no memory to send");
		return;
	}
	*q = (struct queued){.head = head, .bytes = bytes, .size = size, .at = skip, .plain = size + FRAME_COST};
	*c->queue_last = q;
	c->queue_last = &q->next;
	c->unsent += q->plain;
	pump(c);
}

static void send_all(struct conn *c, struct head head, unsigned char *bytes, size_t size, size_t skip)
{
	size_t room = c->unsent < c->config.send_limit ? c->config.send_limit - c->unsent : 0;
	if (c->closing || c->linger_until) {
		mem_free(bytes);
	} else if (c->unsent && size > room) {
		mem_free(bytes);
		conn_close(c, "the peer does not read what is sent to it");
	} else if (c->link) {
		enqueue(c, head, bytes, size, skip);
	} else {
		c->unsent += size + FRAME_COST;
		to_kernel(c, head, bytes, size, skip, size + FRAME_COST);
	}
}

void conn_send_frame(struct conn *c, unsigned char *frame, size_t size)
{
	struct head head = {.size = c->sent ? FRAME_SEALED_PREFIX : FRAME_PREFIX};
	assert(size > FRAME_PREFIX);
	if (c->sent)
		frame_seal(head.bytes, frame, frame + FRAME_PREFIX, size - FRAME_PREFIX);
	else
		memcpy(head.bytes, frame, FRAME_PREFIX);
	c->sent = true;
	send_all(c, head, frame, size, FRAME_PREFIX);
}

void conn_send_bytes(struct conn *c, unsigned char *bytes, size_t size)
{
	send_all(c, (struct head){.size = 0}, bytes, size, 0);
}

void conn_send(struct conn *c, const Farm__Envelope *message, const void *payload, size_t payload_size)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	if (envelope_pack(message, payload, payload_size, &frame, &size, &e))
		conn_close(c, e.text);
	else
		conn_send_frame(c, frame, size);
}

size_t conn_unsent(const struct conn *c)
{
	return c->unsent;
}

void conn_close_when_sent(struct conn *c, const char *why)
{
	if (c->closing || c->linger_until)
		return;
	text_copy(c->why, sizeof c->why, why);
	c->linger_until = uv_now(c->tcp.loop) + LINGER_MS;
	tick_every(c, TICK_MS);
	if (!c->unsent && !c->in_flight)
		conn_close(c, c->why);
}
