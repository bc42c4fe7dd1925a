#include "common/net/conn.h"

#include "common/base/mem.h"
#include "common/base/text.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { READ_BYTES = 1 << 16, TICK_MS = 250, LINGER_MS = 5000, BYTES_PER_SECOND = 1 << 16 };

struct conn {
	uv_tcp_t tcp;
	uv_timer_t timer;
	uv_connect_t connecting;
	struct conn_config config;
	const struct conn_events *events;
	void *user;
	struct frame_reader reader;
	size_t unsent;
	uint64_t heard, frame_begun; /* ms of the loop's clock */
	uint64_t linger_until;       /* 0: not leaving */
	int open_handles;
	bool closing;
	char why[256];
	char chunk[READ_BYTES];
};

struct sending {
	uv_write_t request;
	unsigned char *bytes;
	size_t size;
};

static void on_handle_closed(uv_handle_t *h)
{
	struct conn *c = h->data;
	if (--c->open_handles)
		return;
	c->events->closed(c->user, c->why);
	frame_reader_fini(&c->reader);
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

/* ---- reading ---- */

static void on_alloc(uv_handle_t *h, size_t suggested, uv_buf_t *out)
{
	(void)suggested;
	struct conn *c = h->data;
	*out = uv_buf_init(c->chunk, sizeof c->chunk);
}

static void deliver(struct conn *c)
{
	struct envelope env;
	struct error e;
	if (envelope_unpack(&env, c->reader.header.bytes, c->reader.header.size, &e)) {
		conn_close(c, e.text);
		return;
	}
	c->events->message(c->user, &env, c->reader.payload.bytes, c->reader.payload.size);
	envelope_fini(&env);
}

static void on_read(uv_stream_t *s, ssize_t count, const uv_buf_t *b)
{
	struct conn *c = s->data;
	if (count < 0) {
		conn_close(c, count == UV_EOF ? "the peer hung up" : uv_strerror((int)count));
		return;
	}
	size_t at = 0, size = (size_t)count;
	c->heard = uv_now(s->loop);
	while (at < size && !c->closing && !c->linger_until) {
		struct error e;
		size_t used;
		bool was_midway = frame_reader_is_midway(&c->reader);
		int rc = frame_reader_take(&c->reader, (const unsigned char *)b->base + at, size - at, &used, &e);
		at += used;
		if (!was_midway)
			c->frame_begun = c->heard;
		if (rc < 0)
			conn_close(c, e.text);
		else if (rc)
			deliver(c);
	}
}

/* ---- time ---- */

static bool has_stalled(const struct conn *c, uint64_t now)
{
	double allowed = c->config.stall_seconds + (double)c->reader.payload_size / BYTES_PER_SECOND;
	return frame_reader_is_midway(&c->reader) && (double)(now - c->frame_begun) > 1000 * allowed;
}

static void on_tick(uv_timer_t *t)
{
	struct conn *c = t->data;
	uint64_t now = uv_now(t->loop);
	if (c->linger_until && now >= c->linger_until)
		conn_close(c, c->why);
	else if (has_stalled(c, now))
		conn_close(c, "a frame was begun and not finished in time");
	else if (c->config.quiet_seconds > 0 && (double)(now - c->heard) > 1000 * c->config.quiet_seconds)
		conn_close(c, "nothing was heard for too long");
}

/* ---- life ---- */

static int conn_new(struct conn **out, uv_loop_t *loop, const struct conn_config *config,
		    const struct conn_events *events, void *user, struct error *e)
{
	struct conn *c = mem_alloc(1, sizeof *c);
	if (!c)
		return error_set(e, ENOMEM, "no memory for a connection");
	c->config = *config;
	c->events = events;
	c->user = user;
	frame_reader_init(&c->reader, config->limits);
	int rc = uv_tcp_init(loop, &c->tcp);
	if (rc) {
		mem_free(c);
		return error_set(e, -rc, "no socket: %s", uv_strerror(rc));
	}
	uv_timer_init(loop, &c->timer);
	c->tcp.data = c->timer.data = c->connecting.data = c;
	c->open_handles = 2;
	c->heard = uv_now(loop);
	*out = c;
	return 0;
}

static int start(struct conn *c)
{
	uv_tcp_nodelay(&c->tcp, 1);
	uv_tcp_keepalive(&c->tcp, 1, 60);
	c->heard = uv_now(c->tcp.loop);
	return uv_read_start((uv_stream_t *)&c->tcp, on_alloc, on_read);
}

static void on_connected(uv_connect_t *r, int status)
{
	struct conn *c = r->data;
	if (c->closing)
		return;
	int rc = status ? status : start(c);
	if (rc)
		conn_close(c, uv_strerror(rc));
	else if (c->events->opened)
		c->events->opened(c->user);
}

int conn_connect(struct conn **out, uv_loop_t *loop, const struct net_addr *a, const struct conn_config *config,
		 const struct conn_events *events, void *user, struct error *e)
{
	struct conn *c = NULL;
	int rc = conn_new(&c, loop, config, events, user, e);
	if (rc)
		return rc;
	uv_timer_start(&c->timer, on_tick, TICK_MS, TICK_MS);
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
	int rc = conn_new(&c, listener->loop, config, events, user, e);
	if (rc)
		return rc;
	uv_timer_start(&c->timer, on_tick, TICK_MS, TICK_MS);
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

void conn_set_quiet(struct conn *c, double seconds)
{
	c->config.quiet_seconds = seconds;
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

/* ---- writing ---- */

static void on_sent(uv_write_t *r, int status)
{
	struct sending *s = r->data;
	struct conn *c = r->handle->data;
	c->unsent -= s->size;
	mem_free(s->bytes);
	mem_free(s);
	if (c->closing)
		return;
	if (status)
		conn_close(c, uv_strerror(status));
	else if (c->unsent)
		return;
	else if (c->linger_until)
		conn_close(c, c->why);
	else if (c->events->drained)
		c->events->drained(c->user);
}

void conn_send_frame(struct conn *c, unsigned char *frame, size_t size)
{
	struct sending *s = NULL;
	const char *fault = NULL;
	if (c->closing || c->linger_until)
		goto drop;
	if (c->unsent && size > c->config.send_limit - (c->unsent < c->config.send_limit ? c->unsent : c->config.send_limit))
		fault = "the peer does not take what is sent to it";
	else if (!(s = mem_alloc(1, sizeof *s)))
		fault = "no memory to send";
	if (fault) {
		conn_close(c, fault);
		goto drop;
	}
	s->bytes = frame;
	s->size = size;
	s->request.data = s;
	uv_buf_t b = uv_buf_init((char *)frame, (unsigned)size);
	int rc = uv_write(&s->request, (uv_stream_t *)&c->tcp, &b, 1, on_sent);
	if (!rc) {
		c->unsent += size;
		return;
	}
	conn_close(c, uv_strerror(rc));
drop:
	mem_free(s);
	mem_free(frame);
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
	if (!c->unsent)
		conn_close(c, c->why);
}
