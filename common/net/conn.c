/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bytes that libuv reads go through TLS, if used, into the frame reader; `message` is called for each complete frame.
 * Outgoing frames go through the send queue (send_queue.c). A timer notices peers that are silent or stall, and
 * certificates that expire or are revoked meanwhile.
 *
 * A frame of more than 64 KB must get its size from the receive pool, in which certificates, or without TLS addresses,
 * take turns. While a frame waits for that, its connection is not read, and its peer counts as neither silent nor slow.
 * While others wait, a peer that has a part of the pool must keep sending.
 *
 * Failures end the connection, once, with a reason in words: frames beyond the limits, plaintext where TLS is required
 * (and the reverse), a peer that stalls, no memory.
 */
#include "common/net/conn.h"

#include "common/base/fnv.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/net/send_queue.h"

#include <stdio.h>
#include <string.h>

enum {
	READ_BYTES = 1 << 16,
	FRAMES_PER_ITERATION = 16, /* frames of a connection that are handled before other connections are read */
	TICK_MS = 250,
	TICK_MS_MAX = 1000,		/* longest tick, if the peer may be silent for long */
	LINGER_MS = 5000,		/* time for sending the rest */
	REFUSAL_LINGER_MS = 1000,	/* time for a refused peer to read the reason */
	HANDSHAKE_MS = 10000,		/* time for the TLS handshake */
	BYTES_PER_SECOND_MIN = 1 << 16, /* least speed of a frame */
	SHORT_FRAME_MAX = 1 << 16,	/* longest frame that does not need the pool */
};

struct conn {
	uv_tcp_t tcp;
	uv_timer_t timer;
	uv_idle_t resume_handle; /* not a timer: one of 0 ms would run again and again before anything else */
	uv_connect_t connect_request;
	struct conn_config config;
	const struct conn_events *events;
	void *user;
	struct frame_reader reader;
	struct tls_link *link;	      /* NULL: plaintext */
	struct receive_turn turn;     /* the place in the pool of the frame being received */
	struct send_queue send_queue; /* its state is the connection's state */
	uint64_t clock_ms, tick_ms;   /* ms of the connection's clock and of the loop's clock at the last tick */
	uint64_t begin_ms, last_read_ms, frame_begin_ms; /* ms of the connection's clock */
	uint64_t certificate_check_ms; /* ms of the loop's clock: the last check of the peer's certificate */
	uint64_t linger_until_ms;      /* ms of the loop's clock; 0: not closing */
	uint64_t paced_ms;	       /* ms of the connection's clock: when the frame last had enough new bytes */
	size_t paced_bytes;	       /* bytes of its payload at that time */
	int open_handles;
	struct buf backlog; /* plaintext that waits for the next iteration of the loop, from backlog_offset on */
	size_t backlog_offset;
	bool has_backlog;     /* there is such a rest; the socket is not read until it is used up */
	unsigned frame_count; /* frames delivered since other connections could be read */
	/* is_accepted: by a listener */
	bool is_accepted, has_checked_first_byte, had_bad_checksum;
	int certificate_error; /* what conn_certificate_error returns */
	char close_reason[256];
};

/* Receives bytes read or decrypted. One buffer suffices: libuv calls back with it before it reads more, and nothing is
 * read inside a callback. */
static _Thread_local char read_buffer[READ_BYTES];

static void release_turn(struct conn *c)
{
	if (c->turn.is_granted || c->turn.is_waiting)
		receive_pool_release(c->config.receive_pool, &c->turn);
}

static void on_handle_closed(uv_handle_t *h)
{
	struct conn *c = h->data;
	if (--c->open_handles)
		return;
	c->events->closed(c->user, c->close_reason);
	frame_reader_fini(&c->reader);
	buf_fini(&c->backlog);
	release_turn(c);
	tls_link_free(c->link);
	send_queue_fini(&c->send_queue);
	mem_free(c);
}

void conn_close(struct conn *c, const char *why)
{
	if (c->send_queue.state == SEND_CLOSED)
		return;
	send_queue_close(&c->send_queue, SEND_CLOSED);
	if (!c->linger_until_ms)
		text_copy(c->close_reason, sizeof c->close_reason, why);
	uv_close((uv_handle_t *)&c->timer, on_handle_closed);
	uv_close((uv_handle_t *)&c->resume_handle, on_handle_closed);
	uv_close((uv_handle_t *)&c->tcp, on_handle_closed);
}

/* ---- the connection's clock ---- */

/* Returns the connection's clock, which stands still while the loop is busy: bytes that arrive then have not been read
 * yet, for which no peer is to blame. */
static uint64_t connection_ms(const struct conn *c)
{
	uint64_t since = uv_now(c->tcp.loop) - c->tick_ms, max_ms = uv_timer_get_repeat(&c->timer);
	return c->clock_ms + (since < max_ms ? since : max_ms);
}

static void set_tick_interval(struct conn *c, uint64_t ms)
{
	if (c->send_queue.state == SEND_CLOSED)
		return;
	c->clock_ms = connection_ms(c);
	c->tick_ms = uv_now(c->tcp.loop);
	uv_timer_set_repeat(&c->timer, ms);
	uv_timer_again(&c->timer);
}

/* ---- reading ---- */

/* libuv reads a connection up to 32 times, while there is something to read, before it reads any other; without a
 * buffer it goes on to the next one. This function refuses a buffer after FRAMES_PER_ITERATION frames, so that hundreds
 * of busy connections do not keep others waiting; the rest of a read with more short frames waits likewise (on_resume).
 * It also refuses while closed connections hold memory that the loop has yet to free: more requests need memory for
 * answers. */
static void on_alloc(uv_handle_t *h, size_t suggested, uv_buf_t *out)
{
	(void)suggested;
	struct conn *c = h->data;
	bool turn_is_over = c->frame_count >= FRAMES_PER_ITERATION,
	     pause = turn_is_over || (c->config.send_pool && c->config.send_pool->closing_bytes);
	if (turn_is_over)
		c->frame_count = 0;
	*out = uv_buf_init(read_buffer, pause ? 0 : sizeof read_buffer);
}

static void deliver_frame(struct conn *c)
{
	struct envelope env;
	struct error e;
	int rc = envelope_unpack(&env, c->reader.header.bytes, c->reader.header.size, &e);
	if (rc) {
		c->had_bad_checksum = rc == -EILSEQ;
		conn_close(c, e.text);
		return;
	}
	c->events->message(c->user, &env, c->reader.payload.bytes, c->reader.payload.size);
	envelope_fini(&env);
}

static void on_read(uv_stream_t *s, ssize_t count, const uv_buf_t *b);

/* Reads from the socket, unless bytes read before come first, or the frame waits for the pool. */
static void resume_reading(struct conn *c)
{
	if (c->has_backlog || c->turn.is_waiting || c->send_queue.state == SEND_CLOSED)
		return;
	int rc = uv_read_start((uv_stream_t *)&c->tcp, on_alloc, on_read);
	if (rc)
		conn_close(c, uv_strerror(rc));
}

/* Called when the pool has room for the frame. */
static void on_turn_granted(struct receive_turn *t)
{
	struct conn *c = (struct conn *)((char *)t - offsetof(struct conn, turn));
	c->last_read_ms = c->frame_begin_ms = c->paced_ms = connection_ms(c);
	resume_reading(c);
}

/* Returns a hash of the name in the peer's certificate or, without one, of its address: the owner in the pool. */
static uint64_t pool_owner(const struct conn *c)
{
	char address[64];
	const struct tls_peer *who = conn_peer(c);
	conn_peer_name(c, address, sizeof address);
	const char *name = who ? who->name : address, *port = who ? NULL : strrchr(address, ':');
	return fnv_add(FNV_OFFSET_BASIS, name, port ? (size_t)(port - name) : strlen(name));
}

/* Takes the size of a frame, of which a part has arrived, from the pool. */
static void reserve_receive_pool(struct conn *c)
{
	uint64_t size = frame_reader_frame_size(&c->reader);
	if (!c->config.receive_pool || size <= SHORT_FRAME_MAX || c->turn.is_granted || c->turn.is_waiting)
		return;
	c->turn.on_granted = on_turn_granted;
	c->turn.owner = pool_owner(c);
	if (!receive_pool_acquire(c->config.receive_pool, &c->turn, size))
		uv_read_stop((uv_stream_t *)&c->tcp);
}

struct buf conn_take_payload(struct conn *c)
{
	struct buf payload = c->reader.payload;
	c->reader.payload = (struct buf){.limit = payload.limit};
	return payload;
}

static void reset_pace(struct conn *c)
{
	c->frame_begin_ms = c->paced_ms = c->last_read_ms;
	c->paced_bytes = 0;
}

static void update_pace(struct conn *c)
{
	size_t size = c->reader.payload.size;
	if ((double)(size - c->paced_bytes) < c->config.stall_seconds * BYTES_PER_SECOND_MIN)
		return;
	c->paced_bytes = size;
	c->paced_ms = c->last_read_ms;
}

static void on_resume(uv_idle_t *h);

/* Handles some frames in plaintext. Returns the number of bytes used. */
static size_t handle_frames(struct conn *c, const unsigned char *bytes, size_t size)
{
	size_t offset = 0;
	c->last_read_ms = connection_ms(c);
	while (offset < size && c->send_queue.state == SEND_OPEN && c->frame_count < FRAMES_PER_ITERATION) {
		struct error e;
		size_t used;
		bool was_midway = frame_reader_is_midway(&c->reader);
		int rc = frame_reader_feed(&c->reader, bytes + offset, size - offset, &used, &e);
		offset += used;
		if (!was_midway)
			reset_pace(c);
		if (rc < 0) {
			c->had_bad_checksum = rc == -EILSEQ;
			conn_close(c, e.text);
		} else if (rc) {
			c->frame_count++;
			deliver_frame(c);
			/* Reset now: the next frame, which would do it, may be long in coming. */
			frame_reader_reset(&c->reader);
			release_turn(c);
		}
	}
	return offset;
}

/* All bytes that were read have been used. */
static void await_more(struct conn *c)
{
	if (!frame_reader_is_midway(&c->reader) || c->send_queue.state != SEND_OPEN)
		return;
	reserve_receive_pool(c);
	update_pace(c);
	if (c->events->partial)
		c->events->partial(c->user);
}

/* Handles plaintext; frames beyond FRAMES_PER_ITERATION are kept for the next iteration of the loop. */
static void handle_plaintext(struct conn *c, const unsigned char *bytes, size_t size)
{
	size_t offset = handle_frames(c, bytes, size);
	c->has_backlog = offset < size && c->send_queue.state == SEND_OPEN;
	if (!c->has_backlog) {
		await_more(c);
		return;
	}
	c->backlog.limit = READ_BYTES;
	if (!buf_append(&c->backlog, bytes + offset, size - offset)) {
		conn_close(c, "no memory for what it sent");
		return;
	}
	uv_read_stop((uv_stream_t *)&c->tcp);
	uv_idle_start(&c->resume_handle, on_resume);
}

/* Closes the connection, but gives the peer time to read an alert with the reason: the kernel would discard the alert
 * if data arrived after the socket was closed. */
static void refuse_peer(struct conn *c, int rc, const char *why)
{
	c->certificate_error = rc == -EACCES || rc == -EKEYEXPIRED ? rc : 0;
	if (!c->linger_until_ms)
		text_copy(c->close_reason, sizeof c->close_reason, why);
	c->linger_until_ms = uv_now(c->tcp.loop) + REFUSAL_LINGER_MS;
	set_tick_interval(c, TICK_MS);
	send_queue_close(&c->send_queue, SEND_REFUSED);
	if (!c->send_queue.in_flight_bytes)
		conn_close(c, why);
}

/* Decrypts and handles the bytes in the link, until frames have to wait. */
static void handle_decrypted(struct conn *c)
{
	struct error e;
	ssize_t n = 1;
	while (n > 0 && c->send_queue.state != SEND_CLOSED && !c->has_backlog) {
		bool was_open = tls_link_is_open(c->link);
		n = tls_link_read(c->link, read_buffer, sizeof read_buffer, &e);
		send_queue_flush(&c->send_queue);
		if (!was_open && tls_link_is_open(c->link) && c->send_queue.state != SEND_CLOSED) {
			c->last_read_ms = connection_ms(c);
			c->certificate_check_ms = uv_now(c->tcp.loop);
			if (c->events->opened && !c->is_accepted)
				c->events->opened(c->user);
			send_queue_start(&c->send_queue);
		}
		if (n > 0)
			handle_plaintext(c, (const unsigned char *)read_buffer, (size_t)n);
	}
	if (n < 0 && c->send_queue.state != SEND_CLOSED) {
		send_queue_flush(&c->send_queue);
		refuse_peer(c, (int)n, e.text);
	}
}

/* Handles encrypted bytes; without any, starts the handshake. */
static void handle_encrypted(struct conn *c, const void *bytes, size_t size)
{
	struct error e;
	int rc = tls_link_receive(c->link, bytes, size, &e);
	if (!rc) {
		handle_decrypted(c);
	} else if (c->send_queue.state != SEND_CLOSED) {
		send_queue_flush(&c->send_queue);
		refuse_peer(c, rc, e.text);
	}
}

/* Called in the next iteration of the loop: handles the rest. */
static void on_resume(uv_idle_t *h)
{
	struct conn *c = h->data;
	if (c->config.send_pool && c->config.send_pool->closing_bytes)
		return;
	c->frame_count = 0;
	c->backlog_offset +=
		handle_frames(c, c->backlog.bytes + c->backlog_offset, c->backlog.size - c->backlog_offset);
	c->has_backlog = c->send_queue.state == SEND_OPEN && c->backlog_offset < c->backlog.size;
	if (c->has_backlog)
		return;
	uv_idle_stop(h);
	buf_fini(&c->backlog);
	c->backlog_offset = 0;
	await_more(c);
	if (c->link && c->send_queue.state < SEND_REFUSED)
		handle_decrypted(c);
	resume_reading(c);
}

/* Recognises a peer that uses TLS by its first byte, since no frame begins like a TLS record, and refuses it. */
static bool refuse_if_tls(struct conn *c, const char *bytes, size_t size)
{
	bool first = !c->has_checked_first_byte && size;
	c->has_checked_first_byte = true;
	if (!first || !tls_is_first_byte((unsigned char)*bytes))
		return false;
	if (c->is_accepted)
		send_queue_send_raw(&c->send_queue, tls_mismatch_alert, sizeof tls_mismatch_alert);
	refuse_peer(c, -EACCES, "the peer speaks TLS, and this side does not: both need --tls DIR, or neither");
	return true;
}

static void on_read(uv_stream_t *s, ssize_t count, const uv_buf_t *b)
{
	struct conn *c = s->data;
	if (count == UV_ENOBUFS)
		return;
	if (count < 0) {
		bool midway = c->link && !tls_link_is_open(c->link);
		conn_close(c, count != UV_EOF ? uv_strerror((int)count)
			      : midway	      ? "the peer hung up during the TLS handshake"
					      : "the peer hung up");
	} else if (c->send_queue.state >= SEND_REFUSED) {
		return;
	} else if (c->link) {
		handle_encrypted(c, b->base, (size_t)count);
	} else if (!refuse_if_tls(c, b->base, (size_t)count)) {
		handle_plaintext(c, (const unsigned char *)b->base, (size_t)count);
	}
}

/* ---- time ---- */

static bool has_stalled(const struct conn *c)
{
	double allowed = c->config.stall_seconds + (double)c->reader.payload_size / BYTES_PER_SECOND_MIN;
	bool pool_is_contended = c->turn.is_granted && c->config.receive_pool->queue;
	return frame_reader_is_midway(&c->reader) &&
	       ((double)(c->clock_ms - c->frame_begin_ms) > 1000 * allowed ||
		(pool_is_contended && (double)(c->clock_ms - c->paced_ms) > 1000 * c->config.stall_seconds));
}

/* Checks the peer's certificate again: it may have expired or been revoked. */
static void recheck_certificate(struct conn *c, uint64_t now)
{
	struct error e;
	if (!c->link || !tls_link_is_open(c->link) ||
	    (double)(now - c->certificate_check_ms) < 1000 * tls_recheck_seconds(c->config.tls))
		return;
	c->certificate_check_ms = now;
	int rc = tls_link_recheck(c->link, &e);
	c->certificate_error = rc ? rc : c->certificate_error;
	if (rc)
		conn_close(c, e.text);
}

/* While the frame waits for the pool, the peer cannot send and is not to blame. Tells the owner, who may inform it. */
static void excuse_waiting_peer(struct conn *c)
{
	c->last_read_ms = c->frame_begin_ms = c->clock_ms;
	if (c->events->partial && c->send_queue.state == SEND_OPEN)
		c->events->partial(c->user);
}

static void on_tick(uv_timer_t *t)
{
	struct conn *c = t->data;
	uint64_t now = uv_now(t->loop);
	c->clock_ms = connection_ms(c);
	c->tick_ms = now;
	recheck_certificate(c, now);
	if (c->turn.is_waiting)
		excuse_waiting_peer(c);
	if (c->linger_until_ms && now >= c->linger_until_ms)
		conn_close(c, c->close_reason);
	else if (c->link && !tls_link_is_open(c->link) && c->clock_ms - c->begin_ms > HANDSHAKE_MS)
		conn_close(c, "the TLS handshake was not finished in time");
	else if (has_stalled(c))
		conn_close(c, "a frame was not completed in time");
	else if (c->config.idle_timeout_seconds > 0 &&
		 (double)(c->clock_ms - c->last_read_ms) > 1000 * c->config.idle_timeout_seconds)
		conn_close(c, "silent for too long");
}

/* ---- opening and closing ---- */

static void on_send_failed(void *user, const char *why)
{
	conn_close(user, why);
}

/* In SEND_REFUSED nothing is done: the peer has until linger_until_ms to read why it was refused. */
static void on_drained(void *user)
{
	struct conn *c = user;
	if (c->send_queue.state == SEND_DRAINING)
		conn_close(c, c->close_reason);
	else if (c->send_queue.state == SEND_OPEN && c->events->drained)
		c->events->drained(c->user);
}

static const struct send_events send_events = {.failed = on_send_failed, .drained = on_drained};

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
	c->is_accepted = accepted;
	c->config = *config;
	c->events = events;
	c->user = user;
	frame_reader_init(&c->reader, config->limits);
	send_queue_init(&c->send_queue, (uv_stream_t *)&c->tcp, c->link, config->send_limit, config->send_pool,
			&send_events, c);
	rc = uv_tcp_init(loop, &c->tcp);
	if (rc) {
		tls_link_free(c->link);
		mem_free(c);
		return error_set(e, -rc, "no socket: %s", uv_strerror(rc));
	}
	uv_timer_init(loop, &c->timer);
	uv_idle_init(loop, &c->resume_handle);
	c->tcp.data = c->timer.data = c->resume_handle.data = c->connect_request.data = c;
	c->open_handles = 3;
	c->tick_ms = uv_now(loop);
	uv_timer_start(&c->timer, on_tick, TICK_MS, TICK_MS);
	*out = c;
	return 0;
}

static int start_conn(struct conn *c)
{
	uv_tcp_nodelay(&c->tcp, 1);
	uv_tcp_keepalive(&c->tcp, 1, 60);
	c->begin_ms = c->last_read_ms = connection_ms(c);
	int rc = uv_read_start((uv_stream_t *)&c->tcp, on_alloc, on_read);
	if (!rc && c->link)
		handle_encrypted(c, NULL, 0);
	return rc;
}

static void on_connected(uv_connect_t *r, int status)
{
	struct conn *c = r->data;
	if (c->send_queue.state == SEND_CLOSED)
		return;
	int rc = status ? status : start_conn(c);
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
	rc = uv_tcp_connect(&c->connect_request, &c->tcp, (const struct sockaddr *)&a->storage, on_connected);
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
		rc = start_conn(c);
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
	c->send_queue.max_bytes = bytes;
}

void conn_set_idle_timeout(struct conn *c, double seconds)
{
	c->config.idle_timeout_seconds = seconds;
	double ms = 1000 * seconds / 16;
	set_tick_interval(c, ms > TICK_MS_MAX ? TICK_MS_MAX : ms < TICK_MS ? TICK_MS : (uint64_t)ms);
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

int conn_certificate_error(const struct conn *c)
{
	return c->certificate_error;
}

bool conn_had_bad_checksum(const struct conn *c)
{
	return c->had_bad_checksum;
}

bool conn_was_evicted(const struct conn *c)
{
	return c->send_queue.was_evicted;
}

/* ---- writing ---- */

void conn_send_frame(struct conn *c, unsigned char *frame, size_t size)
{
	send_queue_send_frame(&c->send_queue, frame, size);
}

void conn_send_bytes(struct conn *c, unsigned char *bytes, size_t size)
{
	send_queue_send_bytes(&c->send_queue, bytes, size);
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

size_t conn_unsent_bytes(const struct conn *c)
{
	return c->send_queue.unsent_bytes;
}

void conn_close_when_sent(struct conn *c, const char *why)
{
	if (c->send_queue.state != SEND_OPEN)
		return;
	text_copy(c->close_reason, sizeof c->close_reason, why);
	c->linger_until_ms = uv_now(c->tcp.loop) + LINGER_MS;
	send_queue_close(&c->send_queue, SEND_DRAINING);
	set_tick_interval(c, TICK_MS);
	if (send_queue_is_empty(&c->send_queue))
		conn_close(c, c->close_reason);
}
