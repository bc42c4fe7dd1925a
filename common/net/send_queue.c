/* SPDX-License-Identifier: Apache-2.0 */
/*
 * In plaintext a frame goes to libuv at once, as two buffers: its checked prefix and its bytes. With TLS it waits in a
 * list and is encrypted piece by piece while libuv has less than WINDOW_BYTES bytes to write. A frame's memory is only
 * freed after its last piece, so until then the pool counts the encrypted pieces in addition (set_copied); they may
 * exceed the pool's limit until something else is to be sent. on_written encrypts more, and calls `drained` when
 * nothing is left.
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
	PIECE_SIZE = 1 << 16,	/* bytes encrypted at a time */
	WINDOW_BYTES = 1 << 20, /* most encrypted bytes that the kernel has not taken yet */
	FRAME_OVERHEAD = 256,	/* memory per waiting frame besides its bytes */
};

/* The bytes that are sent in place of a frame's prefix. */
struct sent_prefix {
	unsigned char bytes[FRAME_CHECKED_PREFIX_SIZE];
	size_t size;
};

struct send_frame {
	STAILQ_ENTRY(send_frame) next;
	struct sent_prefix prefix; /* empty once it has been encrypted */
	unsigned char *bytes;
	size_t size, offset;	/* of the bytes; offset of the next one to encrypt */
	size_t plaintext_bytes; /* part of `unsent_bytes` that has not been passed on to a struct write_request */
};

/* A write of libuv. */
struct write_request {
	uv_write_t request;
	struct send_queue *queue;
	struct sent_prefix prefix;
	unsigned char *bytes;
	size_t size, plaintext_bytes; /* its parts of in_flight_bytes and of unsent_bytes */
};

static uint64_t loop_ms(const struct send_queue *q)
{
	return uv_now(q->stream->loop);
}

/* Adds to the bytes that wait; false if this connection has to give way. */
static bool add_unsent(struct send_queue *q, size_t bytes)
{
	if (!send_pool_add(&q->share, bytes, loop_ms(q)))
		return false;
	q->unsent_bytes += bytes;
	return true;
}

static void subtract_unsent(struct send_queue *q, size_t bytes)
{
	q->unsent_bytes -= bytes;
	send_pool_subtract(&q->share, bytes, loop_ms(q));
}

static uint64_t kernel_queue_bytes(const struct send_share *s)
{
	const struct send_queue *q = (const struct send_queue *)((const char *)s - offsetof(struct send_queue, share));
	return uv_stream_get_write_queue_size(q->stream);
}

static void evict_queue(struct send_share *s);

void send_queue_init(struct send_queue *q, uv_stream_t *stream, struct tls_link *link, size_t limit,
		     struct send_pool *pool, const struct send_events *events, void *user)
{
	*q = (struct send_queue){.stream = stream, .link = link, .max_bytes = limit, .events = events, .user = user};
	q->share = (struct send_share){.pool = pool, .unsent_bytes = kernel_queue_bytes, .evict = evict_queue};
	STAILQ_INIT(&q->frames);
}

static void set_copied(struct send_queue *q, size_t bytes)
{
	send_pool_adjust(&q->share, (int64_t)bytes - (int64_t)q->copied_bytes);
	q->copied_bytes = bytes;
}

static void drop_first_frame(struct send_queue *q)
{
	struct send_frame *f = STAILQ_FIRST(&q->frames);
	set_copied(q, 0);
	STAILQ_REMOVE_HEAD(&q->frames, next);
	mem_free(f->bytes);
	mem_free(f);
}

void send_queue_fini(struct send_queue *q)
{
	send_queue_close(q, SEND_CLOSED);
	while (!STAILQ_EMPTY(&q->frames))
		drop_first_frame(q);
	subtract_unsent(q, q->unsent_bytes);
}

bool send_queue_is_empty(const struct send_queue *q)
{
	return !q->unsent_bytes && !q->in_flight_bytes;
}

void send_queue_close(struct send_queue *q, enum send_state to)
{
	if (to > q->state)
		q->state = to;
	if (q->state == SEND_CLOSED)
		send_pool_close_share(&q->share);
}

static void report_failure(struct send_queue *q, const char *why)
{
	if (q->state != SEND_CLOSED)
		q->events->failed(q->user, why);
}

static void evict_queue(struct send_share *s)
{
	struct send_queue *q = (struct send_queue *)((char *)s - offsetof(struct send_queue, share));
	q->was_evicted = true;
	report_failure(q, "too much waits to be sent to all peers, and this one does not read its part");
}

static void send_pending(struct send_queue *q);

static void on_written(uv_write_t *r, int status)
{
	struct write_request *w = r->data;
	struct send_queue *q = w->queue;
	q->in_flight_bytes -= w->size;
	subtract_unsent(q, w->plaintext_bytes);
	mem_free(w->bytes);
	mem_free(w);
	if (status)
		report_failure(q, uv_strerror(status));
	else
		send_pending(q);
	if (q->state != SEND_CLOSED && send_queue_is_empty(q))
		q->events->drained(q->user);
}

/* Sends `prefix`, then the bytes after the first `skip`. Frees the bytes, also after a failure. */
static void write_stream(struct send_queue *q, struct sent_prefix prefix, unsigned char *bytes, size_t size,
			 size_t skip, size_t plain)
{
	struct write_request *w = mem_alloc(1, sizeof *w);
	if (!w) {
		mem_free(bytes);
		report_failure(q, "no memory to send");
		return;
	}
	*w = (struct write_request){.queue = q,
				    .prefix = prefix,
				    .bytes = bytes,
				    .size = prefix.size + size - skip,
				    .plaintext_bytes = plain};
	w->request.data = w;
	uv_buf_t both[] = {uv_buf_init((char *)w->prefix.bytes, (unsigned)prefix.size),
			   uv_buf_init((char *)bytes + skip, (unsigned)(size - skip))};
	int rc = uv_write(&w->request, q->stream, both, 2, on_written);
	if (rc) {
		mem_free(bytes);
		mem_free(w);
		report_failure(q, uv_strerror(rc));
		return;
	}
	q->in_flight_bytes += prefix.size + size - skip;
}

static void write_copy(struct send_queue *q, const void *bytes, size_t size, size_t plain)
{
	unsigned char *copy = mem_alloc(size, 1);
	if (copy)
		write_stream(q, (struct sent_prefix){.size = 0}, memcpy(copy, bytes, size), size, 0, plain);
	else
		report_failure(q, "no memory to send");
}

void send_queue_send_raw(struct send_queue *q, const void *bytes, size_t size)
{
	write_copy(q, bytes, size, 0);
}

/* Sends the output of TLS, which stands for `plaintext_bytes` bytes of frames. */
static void flush_tls(struct send_queue *q, size_t plaintext_bytes)
{
	const unsigned char *bytes;
	size_t size = tls_link_output(q->link, &bytes);
	if (!size || q->state == SEND_CLOSED)
		return;
	if (q->in_flight_bytes > 2 * WINDOW_BYTES) /* a peer that sends requests and does not read the answers */
		report_failure(q, "the peer does not read what is sent to it");
	else
		write_copy(q, bytes, size, plaintext_bytes);
	tls_link_clear_output(q->link);
}

/* Encrypts the next piece of the first frame. Returns 1 if that was the last piece, 0 if more is left, -1 after a
 * failure. */
static int encrypt_piece(struct send_queue *q)
{
	static _Thread_local unsigned char joined[PIECE_SIZE];
	struct send_frame *f = STAILQ_FIRST(&q->frames);
	struct error e;
	size_t max_size = PIECE_SIZE - f->prefix.size,
	       size = f->size - f->offset < max_size ? f->size - f->offset : max_size;
	const unsigned char *bytes = f->bytes + f->offset;
	if (f->prefix.size) { /* joined, so that it shares a TLS record with the following bytes */
		memcpy(joined, f->prefix.bytes, f->prefix.size);
		memcpy(joined + f->prefix.size, bytes, size);
		bytes = joined;
	}
	if (tls_link_write(q->link, bytes, f->prefix.size + size, &e)) {
		report_failure(q, e.text);
		return -1;
	}
	f->prefix.size = 0;
	f->offset += size;
	bool last = f->offset == f->size;
	size_t plain = last ? f->plaintext_bytes : size;
	f->plaintext_bytes -= plain;
	set_copied(q, q->copied_bytes + plain);
	flush_tls(q, plain);
	return last;
}

static void send_pending(struct send_queue *q)
{
	if (!q->link || !tls_link_is_open(q->link))
		return;
	while (!STAILQ_EMPTY(&q->frames) && q->in_flight_bytes < WINDOW_BYTES && q->state < SEND_REFUSED) {
		int last = encrypt_piece(q);
		if (last < 0)
			return;
		if (last)
			drop_first_frame(q);
	}
}

void send_queue_flush(struct send_queue *q)
{
	flush_tls(q, 0);
}

void send_queue_start(struct send_queue *q)
{
	send_pending(q);
}

/* Appends a frame to the list. Takes ownership of the bytes, also after a failure. */
static void append_frame(struct send_queue *q, struct sent_prefix head, unsigned char *bytes, size_t size, size_t skip)
{
	struct send_frame *f = mem_alloc(1, sizeof *f);
	if (!f) {
		mem_free(bytes);
		report_failure(q, "no memory to send");
		return;
	}
	*f = (struct send_frame){
		.prefix = head, .bytes = bytes, .size = size, .offset = skip, .plaintext_bytes = size + FRAME_OVERHEAD};
	STAILQ_INSERT_TAIL(&q->frames, f, next);
	send_pending(q);
}

static void queue_bytes(struct send_queue *q, struct sent_prefix head, unsigned char *bytes, size_t size, size_t skip)
{
	size_t free_bytes = q->unsent_bytes < q->max_bytes ? q->max_bytes - q->unsent_bytes : 0;
	if (q->state != SEND_OPEN) {
		mem_free(bytes);
	} else if (q->unsent_bytes && size > free_bytes) {
		mem_free(bytes);
		report_failure(q, "the peer does not read what is sent to it");
	} else if (!add_unsent(q, size + FRAME_OVERHEAD)) {
		mem_free(bytes);
	} else if (q->link) {
		append_frame(q, head, bytes, size, skip);
	} else {
		write_stream(q, head, bytes, size, skip, size + FRAME_OVERHEAD);
	}
	send_pool_note_progress(&q->share, loop_ms(q));
}

void send_queue_send_frame(struct send_queue *q, unsigned char *frame, size_t size)
{
	struct sent_prefix head = {.size = q->has_sent_first_frame ? FRAME_CHECKED_PREFIX_SIZE : FRAME_PREFIX_SIZE};
	assert(size > FRAME_PREFIX_SIZE);
	if (q->has_sent_first_frame)
		frame_checked_prefix_write(head.bytes, frame, frame + FRAME_PREFIX_SIZE, size - FRAME_PREFIX_SIZE);
	else
		memcpy(head.bytes, frame, FRAME_PREFIX_SIZE);
	q->has_sent_first_frame = true;
	queue_bytes(q, head, frame, size, FRAME_PREFIX_SIZE);
}

void send_queue_send_bytes(struct send_queue *q, unsigned char *bytes, size_t size)
{
	queue_bytes(q, (struct sent_prefix){.size = 0}, bytes, size, 0);
}
