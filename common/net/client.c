/* SPDX-License-Identifier: Apache-2.0 */
/*
 * client_open connects and exchanges Hello. client_call sends a message and runs the loop until the next message
 * arrives, a deadline passes, or the connection is lost. Fetching reads chunk by chunk into a temporary file that is
 * renamed when complete, and removed if a signal ends the program before. A fetch that the coordinator drops on the way
 * begins again, a few times.
 *
 * Failures: -ECONNREFUSED, -ECONNRESET and -ETIMEDOUT may be retried (client_exit_code has the exit code of each); a
 * refusal carries the coordinator's sentence.
 */
#include "common/net/client.h"

#include "common/base/io.h"
#include "common/base/mem.h"
#include "common/base/output_target.h"
#include "common/base/text.h"
#include "common/base/temp_file.h"
#include "common/net/jitter.h"

#include <assert.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
	HEADER_LIMIT = 1 << 22,
	PAYLOAD_LIMIT = 1 << 21,
	WAITING_MESSAGES_MAX = 4096, /* most messages received before client_receive asks for them */
	WAITING_BYTES_MAX = 1 << 26, /* most bytes of these messages */
	ANSWER_SECONDS = 60,
	HELLO_SECONDS = 10,
	FETCH_ATTEMPTS = 5,
};
static const double initial_backoff_seconds = 0.5; /* s before the second attempt; doubles each time; with jitter */

/* A message that client_receive has not returned yet. */
struct received_message {
	STAILQ_ENTRY(received_message) next;
	struct client_message message;
};

struct client {
	uv_loop_t loop;
	uv_timer_t timeout, heartbeat;
	struct conn *conn; /* NULL: closed */
	STAILQ_HEAD(, received_message) received;
	uint64_t wait_timeout_ms; /* how long the current call waits without any message */
	unsigned received_count;  /* messages in `received` */
	size_t received_bytes;	  /* their memory */
	struct tls *tls;	  /* NULL: plaintext */
	bool is_open, has_timed_out;
	int certificate_error; /* what conn_certificate_error returned for the connection */
	char name[128];	       /* the program's name */
	char close_reason[256];
	char warning[384], note[256]; /* for client_print_notes */
};

static void on_opened(void *user)
{
	struct client *cl = user;
	cl->is_open = true;
}

static void on_timeout(uv_timer_t *t)
{
	struct client *cl = t->data;
	cl->has_timed_out = true;
}

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct client *cl = user;
	if (env->message->body_case == FARM__ENVELOPE__BODY_HEARTBEAT) { /* the coordinator still works on the answer */
		if (uv_is_active((uv_handle_t *)&cl->timeout))
			uv_timer_start(&cl->timeout, on_timeout, cl->wait_timeout_ms, 0);
		return;
	}
	struct received_message *w = mem_alloc(1, sizeof *w);
	if (!w) {
		conn_close(cl->conn, "no memory for a message of the coordinator");
		return;
	}
	w->message.payload.limit = size;
	cl->received_bytes += env->bytes + size;
	if (++cl->received_count > WAITING_MESSAGES_MAX || cl->received_bytes > WAITING_BYTES_MAX ||
	    !buf_append(&w->message.payload, payload, size)) {
		mem_free(w);
		conn_close(cl->conn, "the coordinator sends more than was requested");
		return;
	}
	w->message.envelope = *env;
	memset(env, 0, sizeof *env);
	STAILQ_INSERT_TAIL(&cl->received, w, next);
}

static void on_closed(void *user, const char *why)
{
	struct client *cl = user;
	cl->certificate_error = conn_certificate_error(cl->conn);
	cl->conn = NULL;
	text_copy(cl->close_reason, sizeof cl->close_reason, why);
}

static const struct conn_events events = {.opened = on_opened, .message = on_message, .closed = on_closed};

static void on_heartbeat(uv_timer_t *t)
{
	struct client *cl = t->data;
	if (cl->conn)
		conn_send(cl->conn, ENVELOPE(HEARTBEAT, heartbeat), NULL, 0);
}

static void start_timeout(struct client *cl, double seconds)
{
	cl->has_timed_out = false;
	uv_timer_stop(&cl->timeout);
	uv_update_time(&cl->loop);
	cl->wait_timeout_ms = (uint64_t)(1000 * (seconds >= 0 ? seconds : 0));
	if (seconds >= 0)
		uv_timer_start(&cl->timeout, on_timeout, cl->wait_timeout_ms, 0);
}

int client_send(struct client *cl, const Farm__Envelope *m, const void *payload, size_t size, struct error *e)
{
	if (cl->conn)
		conn_send(cl->conn, m, payload, size);
	start_timeout(cl, ANSWER_SECONDS);
	while (cl->conn && conn_unsent_bytes(cl->conn) && !cl->has_timed_out)
		uv_run(&cl->loop, UV_RUN_ONCE);
	if (!cl->conn && STAILQ_EMPTY(&cl->received))
		return error_set(e, ECONNRESET, "the connection to the coordinator is lost: %s", cl->close_reason);
	return cl->has_timed_out ? error_set(e, ETIMEDOUT, "the coordinator does not read what is sent to it") : 0;
}

int client_receive(struct client *cl, double seconds, struct client_message *m, struct error *e)
{
	memset(m, 0, sizeof *m);
	start_timeout(cl, seconds);
	while (STAILQ_EMPTY(&cl->received) && cl->conn && !cl->has_timed_out)
		uv_run(&cl->loop, UV_RUN_ONCE);
	struct received_message *w = STAILQ_FIRST(&cl->received);
	if (!w && !cl->conn)
		return error_set(e, ECONNRESET, "the connection to the coordinator is lost: %s", cl->close_reason);
	if (!w)
		return error_set(e, ETIMEDOUT, "the coordinator did not answer in time");
	*m = w->message;
	STAILQ_REMOVE_HEAD(&cl->received, next);
	cl->received_count--;
	cl->received_bytes -= m->envelope.bytes + m->payload.size;
	mem_free(w);
	if (m->envelope.message->body_case != FARM__ENVELOPE__BODY_FAULT)
		return 0;
	error_set(e, EPROTO, "the coordinator says: %s", m->envelope.message->fault->text);
	client_message_fini(m);
	return -EPROTO;
}

int client_call(struct client *cl, const Farm__Envelope *m, Farm__Envelope__BodyCase expected,
		struct client_message *answer, struct error *e)
{
	memset(answer, 0, sizeof *answer);
	int rc = client_send(cl, m, NULL, 0, e);
	if (!rc)
		rc = client_receive(cl, ANSWER_SECONDS, answer, e);
	if (!rc && answer->envelope.message->body_case != expected) {
		client_message_fini(answer);
		rc = error_set(e, EPROTO, "the coordinator's answer does not match the request");
	}
	return rc;
}

void client_message_fini(struct client_message *m)
{
	envelope_fini(&m->envelope);
	buf_fini(&m->payload);
}

static int refuse_coordinator(const struct client *cl, const char *host_port, struct error *e)
{
	return error_set(e, -cl->certificate_error, "%s: %s", host_port, cl->close_reason);
}

static int exchange_hello(struct client *cl, const char *host_port, struct error *e)
{
	struct client_message answer;
	int rc = client_send(
		cl, ENVELOPE(HELLO, hello, .version = FARM_VERSION, .role = FARM__ROLE__ROLE_CLIENT, .name = cl->name),
		NULL, 0, e);
	if (!rc)
		rc = client_receive(cl, HELLO_SECONDS, &answer, e);
	if (rc && cl->certificate_error)
		return refuse_coordinator(cl, host_port, e);
	if (rc)
		return rc == -EPROTO ? rc : error_set(e, ECONNREFUSED, "no coordinator answers at %s", host_port);
	const Farm__Envelope *a = answer.envelope.message;
	if (a->body_case != FARM__ENVELOPE__BODY_HELLO_ACK)
		rc = error_set(e, ECONNREFUSED, "what answers at %s is not a coordinator", host_port);
	else if (!a->hello_ack->accepted)
		rc = error_set(e, EPROTO, "the coordinator at %s refuses: %s", host_port, a->hello_ack->text);
	else if (a->hello_ack->heartbeat_ms >= 10)
		uv_timer_start(&cl->heartbeat, on_heartbeat, a->hello_ack->heartbeat_ms, a->hello_ack->heartbeat_ms);
	if (!rc) {
		text_copy(cl->note, sizeof cl->note, a->hello_ack->text);
		text_clean(cl->note);
	}
	client_message_fini(&answer);
	return rc;
}

/* Tries one of a name's addresses; cl->is_open tells whether a connection was opened. */
static int try_address(struct client *cl, const struct net_addr *a, struct error *e)
{
	const struct conn_config config = {{HEADER_LIMIT, PAYLOAD_LIMIT}, 1 << 23, 30, 0, cl->tls, NULL, NULL};
	if (cl->conn) /* the attempt with the address before */
		conn_close(cl->conn, "no answer in time");
	while (cl->conn)
		uv_run(&cl->loop, UV_RUN_ONCE);
	int rc = conn_connect(&cl->conn, &cl->loop, a, &config, &events, cl, e);
	start_timeout(cl, HELLO_SECONDS);
	while (!rc && cl->conn && !cl->is_open && !cl->has_timed_out)
		uv_run(&cl->loop, UV_RUN_ONCE);
	return rc;
}

int client_open(struct client **out, const char *host_port, const char *tls, bool insecure, const char *name,
		struct error *e)
{
	struct net_addrs to;
	int rc = net_addrs_resolve(&to, host_port, e);
	if (!rc)
		rc = net_addrs_filter_allowed(&to, host_port, insecure || (tls && *tls), e);
	if (rc)
		return rc;
	struct client *cl = mem_alloc(1, sizeof *cl);
	if (!cl)
		return error_set(e, ENOMEM, "no memory for a connection");
	signal(SIGPIPE, SIG_IGN);
	STAILQ_INIT(&cl->received);
	text_copy(cl->name, sizeof cl->name, name);
	if (tls && *tls)
		rc = tls_open(&cl->tls, tls, e);
	if (rc) {
		mem_free(cl);
		return rc == -EPERM ? rc : client_local_error(rc);
	}
	if (cl->tls)
		tls_expiry_warning(cl->tls, time(NULL), cl->warning, sizeof cl->warning);
	rc = uv_loop_init(&cl->loop);
	if (rc) {
		tls_close(cl->tls);
		mem_free(cl);
		return error_set(e, -rc, "no event loop: %s", uv_strerror(rc));
	}
	uv_timer_init(&cl->loop, &cl->timeout);
	uv_timer_init(&cl->loop, &cl->heartbeat);
	cl->timeout.data = cl->heartbeat.data = cl;
	for (unsigned i = 0; !rc && i < to.count && !cl->is_open && !cl->certificate_error; i++)
		rc = try_address(cl, &to.addrs[i], e);
	if (!rc && !cl->is_open && cl->certificate_error)
		rc = refuse_coordinator(cl, host_port, e);
	else if (!rc && !cl->is_open)
		rc = error_set(e, ECONNREFUSED, "no coordinator at %s: %s", host_port,
			       cl->has_timed_out ? "no answer in time" : cl->close_reason);
	if (!rc)
		rc = exchange_hello(cl, host_port, e);
	if (rc)
		client_close(cl);
	else
		*out = cl;
	return rc;
}

void client_print_notes(const struct client *cl, const char *program)
{
	if (*cl->warning)
		fprintf(stderr, "%s: warning: %s\n", program, cl->warning);
	if (*cl->note)
		fprintf(stderr, "%s: %s\n", program, cl->note);
}

void client_close(struct client *cl)
{
	if (!cl)
		return;
	if (cl->conn)
		conn_close(cl->conn, "done");
	uv_close((uv_handle_t *)&cl->timeout, NULL);
	uv_close((uv_handle_t *)&cl->heartbeat, NULL);
	uv_run(&cl->loop, UV_RUN_DEFAULT);
	int rc = uv_loop_close(&cl->loop);
	assert(rc == 0);
	(void)rc;
	tls_close(cl->tls);
	for (struct received_message *w; (w = STAILQ_FIRST(&cl->received));) {
		STAILQ_REMOVE_HEAD(&cl->received, next);
		client_message_fini(&w->message);
		mem_free(w);
	}
	mem_free(cl);
}

int client_exit_code(int rc)
{
	if (rc == -ECONNREFUSED || rc == -ECONNRESET || rc == -ETIMEDOUT || rc == -EHOSTUNREACH)
		return 75;
	if (rc == -EINVAL || rc == -EPERM)
		return 2;
	return rc == -EACCES || rc == -EKEYEXPIRED || rc == -EPROTO ? 6 : 1;
}

int client_local_error(int rc)
{
	return rc ? -EIO : 0;
}

/* ---- fetching ---- */

static int fetch_chunk(struct client *cl, uint64_t job, Farm__What what, uint64_t offset, struct client_message *answer,
		       struct error *e)
{
	int rc = client_call(cl, ENVELOPE(FETCH, fetch, .job = job, .what = what, .offset = offset),
			     FARM__ENVELOPE__BODY_FETCH_CHUNK, answer, e);
	if (rc)
		return rc;
	const Farm__FetchChunk *c = answer->envelope.message->fetch_chunk;
	if (*c->error) /* -EAGAIN after the first chunk: the file was there before, so it may be there again */
		rc = error_set(e, offset ? EAGAIN : ENOENT, "%s", c->error);
	else if (c->offset != offset || (answer->payload.size == 0 && offset < c->size) ||
		 answer->payload.size > c->size - offset)
		rc = error_set(e, EPROTO, "the coordinator sends other bytes than requested");
	if (rc)
		client_message_fini(answer);
	return rc;
}

/* path: the name of the file in an error. */
static int write_all(int fd, const char *path, const unsigned char *bytes, size_t size, struct error *e)
{
	int rc = io_write_all(fd, bytes, size);
	return rc ? error_set(e, EIO, "%s: %s", path, strerror(-rc)) : 0;
}

static int fetch_remaining(struct client *cl, struct client_message *first, uint64_t job, Farm__What what, int fd,
			   const char *path, struct error *e)
{
	uint64_t size = first->envelope.message->fetch_chunk->size, offset = first->payload.size;
	int rc = write_all(fd, path, first->payload.bytes, first->payload.size, e);
	while (!rc && offset < size) {
		struct client_message answer;
		rc = fetch_chunk(cl, job, what, offset, &answer, e);
		if (rc)
			break;
		if (answer.envelope.message->fetch_chunk->size != size)
			rc = error_set(e, EIO, "the file changed while it was fetched");
		if (!rc)
			rc = write_all(fd, path, answer.payload.bytes, answer.payload.size, e);
		offset += answer.payload.size;
		client_message_fini(&answer);
	}
	return rc;
}

/* Waits while the loop keeps running, so that heartbeats are still sent. */
static void wait_with_heartbeats(struct client *cl, double seconds)
{
	uint64_t end = uv_hrtime() + (uint64_t)(1e9 * seconds);
	start_timeout(cl, seconds);
	while (cl->conn && !cl->has_timed_out && uv_hrtime() < end)
		uv_run(&cl->loop, UV_RUN_ONCE);
}

static int restart_fetch(struct client *cl, uint64_t job, Farm__What what, int fd, const char *path, struct error *e)
{
	struct client_message first;
	if (ftruncate(fd, 0) || lseek(fd, 0, SEEK_SET))
		return error_set(e, EIO, "%s: %s", path, strerror(errno));
	int rc = fetch_chunk(cl, job, what, 0, &first, e);
	if (rc)
		return rc;
	rc = fetch_remaining(cl, &first, job, what, fd, path, e);
	client_message_fini(&first);
	return rc;
}

/* Fetches all chunks into a file, and begins again from the first one if the coordinator has dropped the fetch: it may
 * have another image by now. */
static int fetch_with_retries(struct client *cl, struct client_message *first, uint64_t job, Farm__What what, int fd,
			      const char *path, struct error *e)
{
	double backoff = initial_backoff_seconds;
	int rc = fetch_remaining(cl, first, job, what, fd, path, e);
	for (int i = 2; rc == -EAGAIN && i <= FETCH_ATTEMPTS; i++, backoff *= 2) {
		fprintf(stderr, "%s: %s; fetching it again (%d of %d)\n", cl->name, e->text, i, FETCH_ATTEMPTS);
		wait_with_heartbeats(cl, jitter_seconds(backoff));
		rc = restart_fetch(cl, job, what, fd, path, e);
	}
	return rc == -EAGAIN ? error_prefix(e, rc, "given up after %d attempts", FETCH_ATTEMPTS) : rc;
}

/* Renames a file, unless there is one of the new name. On file systems without RENAME_NOREPLACE, an empty file reserves
 * the name first; hard links would not work on all of them. */
static int rename_to_new(const char *temporary, const char *path)
{
	if (renameat2(AT_FDCWD, temporary, AT_FDCWD, path, RENAME_NOREPLACE) == 0)
		return 0;
	if (errno != EINVAL && errno != ENOSYS)
		return -1;
	int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	if (fd < 0)
		return -1;
	close(fd);
	if (rename(temporary, path) == 0)
		return 0;
	int code = errno;
	unlink(path);
	errno = code;
	return -1;
}

/* Renames a temporary file. replace: an existing file of that name is replaced, otherwise it is -EEXIST. */
static int rename_temporary(const char *temporary, const char *path, bool replace, struct error *e)
{
	if ((replace ? rename(temporary, path) : rename_to_new(temporary, path)) == 0)
		return 0;
	return error_set(e, errno == EEXIST ? EEXIST : EIO, "%s: %s", path, strerror(errno));
}

static int copy_file(int from, int to, const char *path, struct error *e)
{
	unsigned char piece[1 << 16];
	ssize_t n = lseek(from, 0, SEEK_SET);
	int rc = 0;
	while (!rc && n >= 0 && (n = read(from, piece, sizeof piece)) > 0)
		rc = write_all(to, path, piece, (size_t)n, e);
	return n < 0 ? error_set(e, EIO, "a temporary file: %s", strerror(errno)) : rc;
}

/* Fetches into a temporary file, then copies it to the target: bytes written to a pipe could not be taken back if the
 * connection broke. */
static int fetch_to_stream(struct client *cl, struct client_message *first, uint64_t job, Farm__What what,
			   const struct output_target *t, const char *name, struct error *e)
{
	FILE *temporary = tmpfile();
	if (!temporary)
		return error_set(e, EIO, "cannot make a temporary file: %s", strerror(errno));
	int rc = fetch_with_retries(cl, first, job, what, fileno(temporary), "a temporary file", e);
	int fd = rc ? -1 : output_target_open(t, e);
	if (!rc && fd < 0)
		rc = client_local_error(fd);
	if (!rc)
		rc = copy_file(fileno(temporary), fd, name, e);
	if (fd >= 0 && close(fd) && !rc)
		rc = error_set(e, EIO, "%s: %s", name, strerror(errno));
	fclose(temporary);
	return rc;
}

/* A log that fits into one chunk needs no temporary file, for which a full disk may have no room. */
int client_fetch_log(struct client *cl, uint64_t job, int fd, struct error *e)
{
	static const char name[] = "stdout";
	struct client_message first;
	int rc = fetch_chunk(cl, job, FARM__WHAT__WHAT_LOG, 0, &first, e);
	if (rc)
		return rc;
	const Farm__FetchChunk *c = first.envelope.message->fetch_chunk;
	FILE *temporary = first.payload.size < c->size ? tmpfile() : NULL;
	if (first.payload.size == c->size) {
		rc = write_all(fd, name, first.payload.bytes, first.payload.size, e);
	} else if (!temporary) {
		rc = error_set(e, EIO, "cannot make a temporary file: %s", strerror(errno));
	} else {
		rc = fetch_with_retries(cl, &first, job, FARM__WHAT__WHAT_LOG, fileno(temporary), "a temporary file",
					e);
		rc = rc ? rc : copy_file(fileno(temporary), fd, name, e);
		fclose(temporary);
	}
	client_message_fini(&first);
	return rc;
}

static int fetch_file(struct client *cl, struct client_message *first, uint64_t job, Farm__What what, const char *path,
		      bool replace, struct error *e)
{
	char temporary[OUTPUT_TARGET_PATH_MAX + 8];
	struct output_target t;
	int found = output_target_resolve(&t, path, e);
	if (found)
		return found;
	if (t.writes_directly)
		return fetch_to_stream(cl, first, job, what, &t, output_target_display_name(path), e);
	path = t.path;
	int n = snprintf(temporary, sizeof temporary, "%s.XXXXXX", path);
	if (n < 0 || (size_t)n >= sizeof temporary)
		return error_set(e, ENAMETOOLONG, "%s: the name is too long", path);
	int fd = temp_file_begin(temporary, e);
	if (fd < 0)
		return error_prefix(e, -EIO, "%s: cannot make a file there", path);
	mode_t mask = umask(0);
	umask(mask);
	int rc = fetch_with_retries(cl, first, job, what, fd, path, e);
	if (!rc && (fchmod(fd, 0666 & ~mask) || fsync(fd)))
		rc = error_set(e, EIO, "%s: %s", path, strerror(errno));
	if (close(fd) && !rc)
		rc = error_set(e, EIO, "%s: %s", path, strerror(errno));
	if (!rc)
		rc = rename_temporary(temporary, path, replace, e);
	if (rc)
		unlink(temporary);
	temp_file_end();
	return rc;
}

int client_fetch(struct client *cl, uint64_t job, Farm__What what, const char *path, struct error *e)
{
	struct client_message first;
	int rc = fetch_chunk(cl, job, what, 0, &first, e);
	if (rc)
		return rc;
	rc = fetch_file(cl, &first, job, what, path, true, e);
	client_message_fini(&first);
	return rc;
}

static const char *base_name(const char *path)
{
	const char *slash = strrchr(path, '/');
	return slash ? slash + 1 : path;
}

int client_preview_name(const char *path, char *name, size_t size, struct error *e)
{
	const char *last = base_name(path), *dot = strrchr(last, '.');
	int stem = (int)((dot && dot != last ? dot : last + strlen(last)) - path);
	int n = snprintf(name, size, "%.*s.preview%s", stem, path, path + stem);
	return n < 0 || (size_t)n >= size ? error_set(e, ENAMETOOLONG, "%s: the name is too long", path) : 0;
}

int client_fetch_preview(struct client *cl, uint64_t job, const char *path, bool *is_renamed, struct error *e)
{
	char preview_path[OUTPUT_TARGET_PATH_MAX];
	struct output_target t;
	struct client_message first;
	int rc = output_target_resolve(&t, path, e);
	*is_renamed = false;
	if (!rc)
		rc = fetch_chunk(cl, job, FARM__WHAT__WHAT_PREVIEW, 0, &first, e);
	if (rc)
		return rc;
	const char *final = base_name(first.envelope.message->fetch_chunk->output);
	*is_renamed = !t.writes_directly && *final &&
		      (strcmp(base_name(path), final) == 0 || strcmp(base_name(t.path), final) == 0);
	if (*is_renamed)
		rc = client_preview_name(path, preview_path, sizeof preview_path, e);
	if (!rc && *is_renamed)
		rc = output_target_resolve(&t, preview_path, e);
	if (!rc && *is_renamed && strcmp(base_name(t.path), final) == 0)
		rc = error_set(e, EEXIST, "%s: leads to %s, which is for the final image", preview_path, t.path);
	if (!rc)
		rc = fetch_file(cl, &first, job, FARM__WHAT__WHAT_PREVIEW, *is_renamed ? preview_path : path, true, e);
	client_message_fini(&first);
	return rc;
}

/* Turns the name of a job's image, which somebody else chose, into a safe file name: without folders, not hidden, and
 * not like an option. A preview gets a name of its own. */
static int choose_name(const char *output, bool preview, char name[CLIENT_NAME_BYTES], struct error *e)
{
	struct stat st;
	const char *last = base_name(output);
	int n = 0;
	if (envelope_text_is_valid(last, CLIENT_NAME_BYTES - 1) && *last && *last != '.' && *last != '-')
		n = preview ? !client_preview_name(last, name, CLIENT_NAME_BYTES, e)
			    : snprintf(name, CLIENT_NAME_BYTES, "%s", last);
	if (n <= 0 || n >= CLIENT_NAME_BYTES)
		return error_set(e, EEXIST, "the name of the job's image cannot be used here: give one with -o FILE");
	return lstat(name, &st) == 0 ? error_set(e, EEXIST, "%s exists: -o FILE replaces it", name) : 0;
}

int client_fetch_to_current_folder(struct client *cl, uint64_t job, Farm__What what, char name[CLIENT_NAME_BYTES],
				   struct error *e)
{
	struct client_message first;
	int rc = fetch_chunk(cl, job, what, 0, &first, e);
	if (rc)
		return rc;
	rc = choose_name(first.envelope.message->fetch_chunk->output, what == FARM__WHAT__WHAT_PREVIEW, name, e);
	if (!rc)
		rc = fetch_file(cl, &first, job, what, name, false, e);
	client_message_fini(&first);
	return rc;
}
