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
	FRAMES_AT_ONCE = 16, /* frames of a connection that are handled before other connections are read */
	TICK_MS = 250,
	TICK_MS_MOST = 1000,	    /* longest tick, if the peer may be silent for long */
	LINGER_MS = 5000,	    /* time for sending the rest */
	REFUSED_MS = 1000,	    /* time for a refused peer to read the reason */
	HANDSHAKE_MS = 10000,	    /* time for the TLS handshake */
	BYTES_PER_SECOND = 1 << 16, /* least speed of a frame */
	SHORT = 1 << 16,	    /* longest frame that does not need the pool */
};

struct conn {
	uv_tcp_t tcp;
	uv_timer_t timer;
	uv_idle_t later; /* not a timer: one of 0 ms would run again and again before anything else */
	uv_connect_t connecting;
	struct conn_config config;
	const struct conn_events *events;
	void *user;
	struct frame_reader reader;
	struct tls_link *link;	  /* NULL: plaintext */
	struct receive_turn turn; /* the place in the pool of the frame being received */
	struct send_queue out;	  /* its state is the connection's state */
	uint64_t clock, ticked;	  /* ms of the connection's clock and of the loop's clock at the last tick */
	uint64_t begun, last_read, frame_begun; /* ms of the connection's clock */
	uint64_t checked;			/* ms of the loop's clock: the last check of the peer's certificate */
	uint64_t linger_until;			/* ms of the loop's clock; 0: not closing */
	uint64_t paced_at; /* ms of the connection's clock: when the frame last had enough new bytes */
	size_t paced;	   /* bytes of its payload at that time */
	int open_handles;
	struct buf rest; /* plaintext that waits for the next iteration of the loop, from rest_at on */
	size_t rest_at;
	bool goes_on;			 /* there is such a rest; the socket is not read until it is used up */
	unsigned frames;		 /* frames delivered since other connections could be read */
	bool accepted, sniffed, garbled; /* by a listener; the first bytes have been looked at; see conn_garbled */
	int distrust;			 /* what conn_distrust returns */
	char why[256];
};

/* Receives bytes read or decrypted. One buffer suffices: libuv calls back with it before it reads more, and nothing is
 * read inside a callback. */
static _Thread_local char chunk[READ_BYTES];

static void give_back(struct conn *c)
{
	if (c->turn.has || c->turn.waits)
		receive_pool_give(c->config.pool, &c->turn);
}

static void on_handle_closed(uv_handle_t *h)
{
	struct conn *c = h->data;
	if (--c->open_handles)
		return;
	c->events->closed(c->user, c->why);
	frame_reader_fini(&c->reader);
	buf_fini(&c->rest);
	give_back(c);
	tls_link_free(c->link);
	send_queue_fini(&c->out);
	mem_free(c);
}

void conn_close(struct conn *c, const char *why)
{
	if (c->out.state == SEND_CLOSED)
		return;
	send_queue_close(&c->out, SEND_CLOSED);
	if (!c->linger_until)
		text_copy(c->why, sizeof c->why, why);
	uv_close((uv_handle_t *)&c->timer, on_handle_closed);
	uv_close((uv_handle_t *)&c->later, on_handle_closed);
	uv_close((uv_handle_t *)&c->tcp, on_handle_closed);
}

/* ---- the connection's clock ---- */

/* Returns the connection's clock, which stands still while the loop is busy: bytes that arrive then have not been read
 * yet, for which no peer is to blame. */
static uint64_t clock_of(const struct conn *c)
{
	uint64_t since = uv_now(c->tcp.loop) - c->ticked, most = uv_timer_get_repeat(&c->timer);
	return c->clock + (since < most ? since : most);
}

static void tick_every(struct conn *c, uint64_t ms)
{
	if (c->out.state == SEND_CLOSED)
		return;
	c->clock = clock_of(c);
	c->ticked = uv_now(c->tcp.loop);
	uv_timer_set_repeat(&c->timer, ms);
	uv_timer_again(&c->timer);
}

/* ---- reading ---- */

/* libuv reads a connection up to 32 times, while there is something to read, before it reads any other; without a
 * buffer it goes on to the next one. This function refuses a buffer after FRAMES_AT_ONCE frames, so that hundreds of
 * busy connections do not keep others waiting; the rest of a read with more short frames waits likewise (on_later). It
 * also refuses while closed connections hold memory that the loop has yet to free: more requests need memory for
 * answers. */
static void on_alloc(uv_handle_t *h, size_t suggested, uv_buf_t *out)
{
	(void)suggested;
	struct conn *c = h->data;
	bool full = c->frames >= FRAMES_AT_ONCE, pause = full || (c->config.sending && c->config.sending->leaving);
	if (full)
		c->frames = 0;
	*out = uv_buf_init(chunk, pause ? 0 : sizeof chunk);
}

static void deliver_frames(struct conn *c)
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

static void on_read(uv_stream_t *s, ssize_t count, const uv_buf_t *b);

/* Reads from the socket, unless bytes read before come first, or the frame waits for the pool. */
static void read_socket(struct conn *c)
{
	if (c->goes_on || c->turn.waits || c->out.state == SEND_CLOSED)
		return;
	int rc = uv_read_start((uv_stream_t *)&c->tcp, on_alloc, on_read);
	if (rc)
		conn_close(c, uv_strerror(rc));
}

/* Called when the pool has room for the frame. */
static void read_on(struct receive_turn *t)
{
	struct conn *c = (struct conn *)((char *)t - offsetof(struct conn, turn));
	c->last_read = c->frame_begun = c->paced_at = clock_of(c);
	read_socket(c);
}

/* Returns a hash of the name in the peer's certificate or, without one, of its address: the owner in the pool. */
static uint64_t owner_of(const struct conn *c)
{
	char address[64];
	const struct tls_peer *who = conn_peer(c);
	conn_peer_name(c, address, sizeof address);
	const char *name = who ? who->name : address, *port = who ? NULL : strrchr(address, ':');
	return fnv_add(FNV_BEGIN, name, port ? (size_t)(port - name) : strlen(name));
}

/* Takes the size of a frame, of which a part has arrived, from the pool. */
static void take_turn(struct conn *c)
{
	uint64_t size = frame_reader_size(&c->reader);
	if (!c->config.pool || size <= SHORT || c->turn.has || c->turn.waits)
		return;
	c->turn.go = read_on;
	c->turn.owner = owner_of(c);
	if (!receive_pool_take(c->config.pool, &c->turn, size))
		uv_read_stop((uv_stream_t *)&c->tcp);
}

struct buf conn_take_payload(struct conn *c)
{
	struct buf payload = c->reader.payload;
	c->reader.payload = (struct buf){.limit = payload.limit};
	return payload;
}

static void begin_frame(struct conn *c)
{
	c->frame_begun = c->paced_at = c->last_read;
	c->paced = 0;
}

static void keep_pace(struct conn *c)
{
	size_t size = c->reader.payload.size;
	if ((double)(size - c->paced) < c->config.stall_seconds * BYTES_PER_SECOND)
		return;
	c->paced = size;
	c->paced_at = c->last_read;
}

static void on_later(uv_idle_t *h);

/* Handles some frames in plaintext. Returns the number of bytes used. */
static size_t take_frames(struct conn *c, const unsigned char *bytes, size_t size)
{
	size_t at = 0;
	c->last_read = clock_of(c);
	while (at < size && c->out.state == SEND_OPEN && c->frames < FRAMES_AT_ONCE) {
		struct error e;
		size_t used;
		bool was_midway = frame_reader_is_midway(&c->reader);
		int rc = frame_reader_take(&c->reader, bytes + at, size - at, &used, &e);
		at += used;
		if (!was_midway)
			begin_frame(c);
		if (rc < 0) {
			c->garbled = rc == -EILSEQ;
			conn_close(c, e.text);
		} else if (rc) {
			c->frames++;
			deliver_frames(c);
			frame_reader_drop(
				&c->reader); /* now: the next frame, which would do it, may be long in coming */
			give_back(c);
		}
	}
	return at;
}

/* All bytes that were read have been used. */
static void wait_for_more(struct conn *c)
{
	if (!frame_reader_is_midway(&c->reader) || c->out.state != SEND_OPEN)
		return;
	take_turn(c);
	keep_pace(c);
	if (c->events->partial)
		c->events->partial(c->user);
}

/* Handles plaintext; frames beyond FRAMES_AT_ONCE are kept for the next iteration of the loop. */
static void receive(struct conn *c, const unsigned char *bytes, size_t size)
{
	size_t at = take_frames(c, bytes, size);
	c->goes_on = at < size && c->out.state == SEND_OPEN;
	if (!c->goes_on) {
		wait_for_more(c);
		return;
	}
	c->rest.limit = READ_BYTES;
	if (!buf_append(&c->rest, bytes + at, size - at)) {
		conn_close(c, "no memory for what it sent");
		return;
	}
	uv_read_stop((uv_stream_t *)&c->tcp);
	uv_idle_start(&c->later, on_later);
}

/* Closes the connection, but gives the peer time to read an alert with the reason: the kernel would discard the alert
 * if data arrived after the socket was closed. */
static void refuse(struct conn *c, int rc, const char *why)
{
	c->distrust = rc == -EACCES || rc == -EKEYEXPIRED ? rc : 0;
	if (!c->linger_until)
		text_copy(c->why, sizeof c->why, why);
	c->linger_until = uv_now(c->tcp.loop) + REFUSED_MS;
	tick_every(c, TICK_MS);
	send_queue_close(&c->out, SEND_REFUSED);
	if (!c->out.in_flight)
		conn_close(c, why);
}

/* Decrypts and handles the bytes in the link, until frames have to wait. */
static void decrypt(struct conn *c)
{
	struct error e;
	ssize_t n = 1;
	while (n > 0 && c->out.state != SEND_CLOSED && !c->goes_on) {
		bool was_open = tls_link_is_open(c->link);
		n = tls_link_read(c->link, chunk, sizeof chunk, &e);
		send_queue_flush(&c->out);
		if (!was_open && tls_link_is_open(c->link) && c->out.state != SEND_CLOSED) {
			c->last_read = clock_of(c);
			c->checked = uv_now(c->tcp.loop);
			if (c->events->opened && !c->accepted)
				c->events->opened(c->user);
			send_queue_opened(&c->out);
		}
		if (n > 0)
			receive(c, (const unsigned char *)chunk, (size_t)n);
	}
	if (n < 0 && c->out.state != SEND_CLOSED) {
		send_queue_flush(&c->out);
		refuse(c, (int)n, e.text);
	}
}

/* Handles encrypted bytes; without any, starts the handshake. */
static void take_encrypted(struct conn *c, const void *bytes, size_t size)
{
	struct error e;
	int rc = tls_link_take(c->link, bytes, size, &e);
	if (!rc) {
		decrypt(c);
	} else if (c->out.state != SEND_CLOSED) {
		send_queue_flush(&c->out);
		refuse(c, rc, e.text);
	}
}

/* Called in the next iteration of the loop: handles the rest. */
static void on_later(uv_idle_t *h)
{
	struct conn *c = h->data;
	if (c->config.sending && c->config.sending->leaving)
		return;
	c->frames = 0;
	c->rest_at += take_frames(c, c->rest.bytes + c->rest_at, c->rest.size - c->rest_at);
	c->goes_on = c->out.state == SEND_OPEN && c->rest_at < c->rest.size;
	if (c->goes_on)
		return;
	uv_idle_stop(h);
	buf_fini(&c->rest);
	c->rest_at = 0;
	wait_for_more(c);
	if (c->link && c->out.state < SEND_REFUSED)
		decrypt(c);
	read_socket(c);
}

/* Recognises a peer that uses TLS by its first byte, since no frame begins like a TLS record, and refuses it. */
static bool is_tls(struct conn *c, const char *bytes, size_t size)
{
	bool first = !c->sniffed && size;
	c->sniffed = true;
	if (!first || !tls_is_first_byte((unsigned char)*bytes))
		return false;
	if (c->accepted)
		send_queue_raw(&c->out, tls_none_here, sizeof tls_none_here);
	refuse(c, -EACCES, "the peer speaks TLS, and this side does not: both need --tls DIR, or neither");
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
	} else if (c->out.state >= SEND_REFUSED) {
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
	bool awaited = c->turn.has && c->config.pool->first;
	return frame_reader_is_midway(&c->reader) &&
	       ((double)(c->clock - c->frame_begun) > 1000 * allowed ||
		(awaited && (double)(c->clock - c->paced_at) > 1000 * c->config.stall_seconds));
}

/* Checks the peer's certificate again: it may have expired or been revoked. */
static void check_again(struct conn *c, uint64_t now)
{
	struct error e;
	if (!c->link || !tls_link_is_open(c->link) ||
	    (double)(now - c->checked) < 1000 * tls_recheck_seconds(c->config.tls))
		return;
	c->checked = now;
	int rc = tls_link_recheck(c->link, &e);
	c->distrust = rc ? rc : c->distrust;
	if (rc)
		conn_close(c, e.text);
}

/* While the frame waits for the pool, the peer cannot send and is not to blame. Tells the owner, who may inform it. */
static void wait_on(struct conn *c)
{
	c->last_read = c->frame_begun = c->clock;
	if (c->events->partial && c->out.state == SEND_OPEN)
		c->events->partial(c->user);
}

static void on_tick(uv_timer_t *t)
{
	struct conn *c = t->data;
	uint64_t now = uv_now(t->loop);
	c->clock = clock_of(c);
	c->ticked = now;
	check_again(c, now);
	if (c->turn.waits)
		wait_on(c);
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

static void on_send_failed(void *user, const char *why)
{
	conn_close(user, why);
}

/* In SEND_REFUSED nothing is done: the peer has until linger_until to read why it was refused. */
static void on_drained(void *user)
{
	struct conn *c = user;
	if (c->out.state == SEND_DRAINING)
		conn_close(c, c->why);
	else if (c->out.state == SEND_OPEN && c->events->drained)
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
	c->accepted = accepted;
	c->config = *config;
	c->events = events;
	c->user = user;
	frame_reader_init(&c->reader, config->limits);
	send_queue_init(&c->out, (uv_stream_t *)&c->tcp, c->link, config->send_limit, config->sending, &send_events, c);
	rc = uv_tcp_init(loop, &c->tcp);
	if (rc) {
		tls_link_free(c->link);
		mem_free(c);
		return error_set(e, -rc, "no socket: %s", uv_strerror(rc));
	}
	uv_timer_init(loop, &c->timer);
	uv_idle_init(loop, &c->later);
	c->tcp.data = c->timer.data = c->later.data = c->connecting.data = c;
	c->open_handles = 3;
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
	if (c->out.state == SEND_CLOSED)
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
	c->out.limit = bytes;
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

int conn_distrust(const struct conn *c)
{
	return c->distrust;
}

bool conn_garbled(const struct conn *c)
{
	return c->garbled;
}

bool conn_gave_way(const struct conn *c)
{
	return c->out.gave_way;
}

/* ---- writing ---- */

void conn_send_frame(struct conn *c, unsigned char *frame, size_t size)
{
	send_queue_frame(&c->out, frame, size);
}

void conn_send_bytes(struct conn *c, unsigned char *bytes, size_t size)
{
	send_queue_bytes(&c->out, bytes, size);
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
	return c->out.unsent;
}

void conn_close_when_sent(struct conn *c, const char *why)
{
	if (c->out.state != SEND_OPEN)
		return;
	text_copy(c->why, sizeof c->why, why);
	c->linger_until = uv_now(c->tcp.loop) + LINGER_MS;
	send_queue_close(&c->out, SEND_DRAINING);
	tick_every(c, TICK_MS);
	if (send_queue_is_empty(&c->out))
		conn_close(c, c->why);
}
