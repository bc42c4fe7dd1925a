/* SPDX-License-Identifier: Apache-2.0 */
/*
 * In plaintext a frame goes to libuv at once, as two buffers: its checked prefix and its bytes. With TLS it waits in a
 * list and is encrypted piece by piece while libuv has less than WINDOW bytes to write. A frame's memory is only freed
 * after its last piece, so until then the pool counts the encrypted pieces in addition (count_copied); they may exceed
 * the pool's limit until something else is to be sent. on_written encrypts more, and calls `drained` when nothing is
 * left.
 *
 * A failure is reported once to the owner, who closes the stream: no memory, an error of the stream or of TLS, or a
 * peer that does not read, if this queue or all queues together hold too much.
 */
#include "common/net/send_queue.h"

#include "common/base/mem.h"
#include "common/wire/frame.h"

#include <assert.h>
#include <string.h>

enum {
	PIECE = 1 << 16,  /* bytes encrypted at a time */
	WINDOW = 1 << 20, /* most encrypted bytes that the kernel has not taken yet */
	FRAME_COST = 256, /* memory per waiting frame besides its bytes */
};

/* The bytes that are sent in place of a frame's prefix. */
struct head {
	unsigned char bytes[FRAME_CHECKED_PREFIX];
	size_t size;
};

struct send_frame {
	STAILQ_ENTRY(send_frame) next;
	struct head head; /* empty once it has been encrypted */
	unsigned char *bytes;
	size_t size, at; /* of the bytes; offset of the next one to encrypt */
	size_t plain;	 /* part of `unsent` that has not been passed on to a struct writing */
};

/* A write of libuv. */
struct writing {
	uv_write_t request;
	struct send_queue *queue;
	struct head head;
	unsigned char *bytes;
	size_t size, plain; /* its parts of in_flight and of unsent */
};

static uint64_t loop_ms(const struct send_queue *q)
{
	return uv_now(q->stream->loop);
}

/* Adds to the bytes that wait; false if this connection has to give way. */
static bool count(struct send_queue *q, size_t bytes)
{
	if (!send_pool_add(&q->share, bytes, loop_ms(q)))
		return false;
	q->unsent += bytes;
	return true;
}

static void count_off(struct send_queue *q, size_t bytes)
{
	q->unsent -= bytes;
	send_pool_sub(&q->share, bytes, loop_ms(q));
}

static uint64_t unsent_bytes(const struct send_share *s)
{
	const struct send_queue *q = (const struct send_queue *)((const char *)s - offsetof(struct send_queue, share));
	return uv_stream_get_write_queue_size(q->stream);
}

static void give_way(struct send_share *s);

void send_queue_init(struct send_queue *q, uv_stream_t *stream, struct tls_link *link, size_t limit,
		     struct send_pool *pool, const struct send_events *events, void *user)
{
	*q = (struct send_queue){.stream = stream, .link = link, .limit = limit, .events = events, .user = user};
	q->share = (struct send_share){.pool = pool, .left = unsent_bytes, .give_way = give_way};
	STAILQ_INIT(&q->frames);
}

static void count_copied(struct send_queue *q, size_t bytes)
{
	send_pool_adjust(&q->share, (int64_t)bytes - (int64_t)q->copied);
	q->copied = bytes;
}

static void drop_first(struct send_queue *q)
{
	struct send_frame *f = STAILQ_FIRST(&q->frames);
	count_copied(q, 0);
	STAILQ_REMOVE_HEAD(&q->frames, next);
	mem_free(f->bytes);
	mem_free(f);
}

void send_queue_fini(struct send_queue *q)
{
	send_queue_close(q, SEND_CLOSED);
	while (!STAILQ_EMPTY(&q->frames))
		drop_first(q);
	count_off(q, q->unsent);
}

bool send_queue_is_empty(const struct send_queue *q)
{
	return !q->unsent && !q->in_flight;
}

void send_queue_close(struct send_queue *q, enum send_state to)
{
	if (to > q->state)
		q->state = to;
	if (q->state == SEND_CLOSED)
		send_pool_leave(&q->share);
}

static void fail(struct send_queue *q, const char *why)
{
	if (q->state != SEND_CLOSED)
		q->events->failed(q->user, why);
}

static void give_way(struct send_share *s)
{
	struct send_queue *q = (struct send_queue *)((char *)s - offsetof(struct send_queue, share));
	q->gave_way = true;
	fail(q, "too much waits to be sent to all peers, and this one does not read its part");
}

static void send_pending(struct send_queue *q);

static void on_written(uv_write_t *r, int status)
{
	struct writing *w = r->data;
	struct send_queue *q = w->queue;
	q->in_flight -= w->size;
	count_off(q, w->plain);
	mem_free(w->bytes);
	mem_free(w);
	if (status)
		fail(q, uv_strerror(status));
	else
		send_pending(q);
	if (q->state != SEND_CLOSED && send_queue_is_empty(q))
		q->events->drained(q->user);
}

/* Sends `head`, then the bytes after the first `skip`. Frees the bytes, also after a failure. */
static void to_kernel(struct send_queue *q, struct head head, unsigned char *bytes, size_t size, size_t skip,
		      size_t plain)
{
	struct writing *w = mem_alloc(1, sizeof *w);
	if (!w) {
		mem_free(bytes);
		fail(q, "no memory to send");
		return;
	}
	*w = (struct writing){
		.queue = q, .head = head, .bytes = bytes, .size = head.size + size - skip, .plain = plain};
	w->request.data = w;
	uv_buf_t both[] = {uv_buf_init((char *)w->head.bytes, (unsigned)head.size),
			   uv_buf_init((char *)bytes + skip, (unsigned)(size - skip))};
	int rc = uv_write(&w->request, q->stream, both, 2, on_written);
	if (rc) {
		mem_free(bytes);
		mem_free(w);
		fail(q, uv_strerror(rc));
		return;
	}
	q->in_flight += head.size + size - skip;
}

static void copy_to_kernel(struct send_queue *q, const void *bytes, size_t size, size_t plain)
{
	unsigned char *copy = mem_alloc(size, 1);
	if (copy)
		to_kernel(q, (struct head){.size = 0}, memcpy(copy, bytes, size), size, 0, plain);
	else
		fail(q, "no memory to send");
}

void send_queue_raw(struct send_queue *q, const void *bytes, size_t size)
{
	copy_to_kernel(q, bytes, size, 0);
}

/* Sends the output of TLS, which stands for `plain` bytes of frames. */
static void flush(struct send_queue *q, size_t plain)
{
	const unsigned char *bytes;
	size_t size = tls_link_output(q->link, &bytes);
	if (!size || q->state == SEND_CLOSED)
		return;
	if (q->in_flight > 2 * WINDOW) /* a peer that sends requests and does not read the answers */
		fail(q, "the peer does not read what is sent to it");
	else
		copy_to_kernel(q, bytes, size, plain);
	tls_link_output_taken(q->link);
}

/* Encrypts the next piece of the first frame. Returns 1 if that was the last piece, 0 if more is left, -1 after a
 * failure. */
static int encrypt_piece(struct send_queue *q)
{
	static _Thread_local unsigned char joined[PIECE];
	struct send_frame *f = STAILQ_FIRST(&q->frames);
	struct error e;
	size_t most = PIECE - f->head.size, size = f->size - f->at < most ? f->size - f->at : most;
	const unsigned char *bytes = f->bytes + f->at;
	if (f->head.size) { /* joined, so that it shares a TLS record with the following bytes */
		memcpy(joined, f->head.bytes, f->head.size);
		memcpy(joined + f->head.size, bytes, size);
		bytes = joined;
	}
	if (tls_link_write(q->link, bytes, f->head.size + size, &e)) {
		fail(q, e.text);
		return -1;
	}
	f->head.size = 0;
	f->at += size;
	bool last = f->at == f->size;
	size_t plain = last ? f->plain : size;
	f->plain -= plain;
	count_copied(q, q->copied + plain);
	flush(q, plain);
	return last;
}

static void send_pending(struct send_queue *q)
{
	if (!q->link || !tls_link_is_open(q->link))
		return;
	while (!STAILQ_EMPTY(&q->frames) && q->in_flight < WINDOW && q->state < SEND_REFUSED) {
		int last = encrypt_piece(q);
		if (last < 0)
			return;
		if (last)
			drop_first(q);
	}
}

void send_queue_flush(struct send_queue *q)
{
	flush(q, 0);
}

void send_queue_opened(struct send_queue *q)
{
	send_pending(q);
}

/* Appends a frame to the list. Takes ownership of the bytes, also after a failure. */
static void append(struct send_queue *q, struct head head, unsigned char *bytes, size_t size, size_t skip)
{
	struct send_frame *f = mem_alloc(1, sizeof *f);
	if (!f) {
		mem_free(bytes);
		fail(q, "no memory to send");
		return;
	}
	*f = (struct send_frame){.head = head, .bytes = bytes, .size = size, .at = skip, .plain = size + FRAME_COST};
	STAILQ_INSERT_TAIL(&q->frames, f, next);
	send_pending(q);
}

static void send_all(struct send_queue *q, struct head head, unsigned char *bytes, size_t size, size_t skip)
{
	size_t room = q->unsent < q->limit ? q->limit - q->unsent : 0;
	if (q->state != SEND_OPEN) {
		mem_free(bytes);
	} else if (q->unsent && size > room) {
		mem_free(bytes);
		fail(q, "the peer does not read what is sent to it");
	} else if (!count(q, size + FRAME_COST)) {
		mem_free(bytes);
	} else if (q->link) {
		append(q, head, bytes, size, skip);
	} else {
		to_kernel(q, head, bytes, size, skip, size + FRAME_COST);
	}
	send_pool_look(&q->share, loop_ms(q));
}

void send_queue_frame(struct send_queue *q, unsigned char *frame, size_t size)
{
	struct head head = {.size = q->sent ? FRAME_CHECKED_PREFIX : FRAME_PREFIX};
	assert(size > FRAME_PREFIX);
	if (q->sent)
		frame_add_checksums(head.bytes, frame, frame + FRAME_PREFIX, size - FRAME_PREFIX);
	else
		memcpy(head.bytes, frame, FRAME_PREFIX);
	q->sent = true;
	send_all(q, head, frame, size, FRAME_PREFIX);
}

void send_queue_bytes(struct send_queue *q, unsigned char *bytes, size_t size)
{
	send_all(q, (struct head){.size = 0}, bytes, size, 0);
}
