/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The status socket: lines of JSON for every reader.
 *
 * A reader gets a snapshot first, and then what it subscribes to: jobs, workers, or snapshots. status_tick compares
 * each job with what was last sent about it and sends only changes; nothing is done while nobody is subscribed. A
 * thread makes the text of snapshots, one at a time, and nothing else is sent until that text has been. If the
 * socket's file is removed, it is made anew within a second. When the coordinator stops, the file is removed if it is
 * still the same.
 *
 * If a reader has not read all lines when something changes, it gets no more of them, but one snapshot, the newest,
 * at the first tick after it has read everything. So at most the lines of one moment wait for it. The bytes that wait
 * for readers count together with those that wait for all connections (common/net/send_pool.h): beyond the limit,
 * readers and peers that do not read are disconnected. A line that is neither a subscription nor a question is
 * answered by an error. A reader is disconnected if its line is too long, or if it asks and does not read the
 * answers. If somebody answers at the path already, opening fails with -EADDRINUSE; a file that is not a socket is
 * never removed.
 */
#include "coordinator/status/status.h"

#include "common/base/log.h"
#include "common/base/mem.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/status/status_line.h"
#include "coordinator/status/snapshot.h"
#include "coordinator/status/socket_file.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/queue.h>
#include <unistd.h>

enum { READERS_MAX = 64, LINE_BYTES = 4096, UNREAD_BYTES_MAX = 1 << 20, KERNEL_BUFFER_BYTES = 100000, BACKLOG = 16 };

static const double file_check_seconds = 1;

enum topic { TOPIC_JOBS = 1, TOPIC_WORKERS = 2, TOPIC_SNAPSHOT = 4 };

struct reader {
	LIST_ENTRY(reader) next;
	struct status_socket *socket;
	uv_pipe_t pipe;
	unsigned topics;
	bool is_closing;
	bool has_snapshot; /* it has been sent its first snapshot; only then are its lines read */
	/* Something changed while lines were waiting for this reader: it gets a snapshot once it has read them. */
	bool is_behind;
	size_t unread_bytes; /* bytes of answers that wait for this reader */
	struct send_share send_share;
	size_t line_size;
	char line[LINE_BYTES];
};

/* A snapshot that a thread makes into text, together with the workers' line. The thread is not one of the pool's: all
 * of those may be waiting for a disk, and the status has to be able to say so. */
struct snapshot_task {
	uv_thread_t thread;
	uv_async_t done_async;
	bool has_thread;
	struct status_socket *socket; /* NULL: the socket has been closed */
	struct snapshot *snapshot;
	unsigned changed_topics;			  /* topics of which there is news */
	bool needs_snapshot;				  /* some reader needs the snapshot */
	struct shared_line *snapshot_line, *workers_line; /* their texts; NULL: not needed, or out of memory */
};

struct status_socket {
	struct peers *peers;
	struct jobs *jobs;
	/* NULL: none at the moment. Its data is the status socket, or NULL once the listener is being closed. */
	uv_pipe_t *listener;
	LIST_HEAD(, reader) readers; /* including those that are being closed */
	unsigned reader_count;	     /* readers not being closed */
	bool is_accept_pending;
	/* NULL: none. Nothing else is published while it is being made. */
	struct snapshot_task *task;
	/* A tick found a snapshot being made: the next one is made by a tick, before the first snapshots of new
	 * readers. */
	bool is_tick_pending;
	struct job_view *published_jobs; /* jobs as last sent to subscribers */
	size_t published_job_count;
	uint64_t published_change_count; /* jobs.change_count at the last tick that published */
	char *path;			 /* NULL: the socket was inherited */
	char *group;			 /* group that may connect; NULL: none */
	struct socket_file file;
	double file_checked_at;	 /* s of jobs_now: when the file was last checked */
	bool has_reported_fault; /* a fault of the file has been logged: it cannot be made anew, or another file is at
				its path */
};

/* A line for several readers, whose text is made once; reference-counted. */
struct shared_line {
	unsigned reference_count;
	size_t size;
	char *text; /* allocated by jansson */
};

/* Takes over the reference to o. Returns NULL if out of memory. */
static struct shared_line *shared_line_new(json_t *o)
{
	char *text = json_dumps(o, JSON_COMPACT);
	struct shared_line *l = text ? mem_alloc(1, sizeof *l) : NULL;
	json_decref(o);
	if (l)
		*l = (struct shared_line){1, strlen(text), text};
	else
		free(text);
	return l;
}

static void shared_line_release(struct shared_line *l)
{
	if (!l || --l->reference_count)
		return;
	free(l->text);
	mem_free(l);
}

struct line_write {
	uv_write_t request;
	struct shared_line *line; /* a reference */
	bool is_answer;		  /* an answer to a line of the reader's */
};

static void on_reader_closed(uv_handle_t *h)
{
	struct reader *r = h->data;
	if (r->socket)
		LIST_REMOVE(r, next);
	mem_free(r);
}

static void drop_reader(struct reader *r)
{
	if (r->is_closing)
		return;
	r->is_closing = true;
	r->socket->reader_count--;
	send_pool_close_share(&r->send_share);
	uv_close((uv_handle_t *)&r->pipe, on_reader_closed);
}

static size_t queued_bytes(const struct reader *r)
{
	return uv_stream_get_write_queue_size((const uv_stream_t *)&r->pipe);
}

static uint64_t unsent_bytes(const struct send_share *s)
{
	return queued_bytes((const struct reader *)((const char *)s - offsetof(struct reader, send_share)));
}

static void evict_reader(struct send_share *s)
{
	drop_reader((struct reader *)((char *)s - offsetof(struct reader, send_share)));
}

static uint64_t loop_ms(const struct reader *r)
{
	return uv_now(r->pipe.loop);
}

static void on_written(uv_write_t *w, int status)
{
	struct line_write *s = w->data;
	struct reader *r = w->handle->data;
	r->unread_bytes -= s->is_answer ? s->line->size : 0;
	send_pool_subtract(&r->send_share, s->line->size, loop_ms(r));
	shared_line_release(s->line);
	mem_free(s);
	if (status)
		drop_reader(r);
}

/* Sends a line. At most one tick's lines about changes wait for a reader (see status_tick); the size of waiting
 * answers is bounded here. */
static void send_line(struct reader *r, struct shared_line *l, bool answer)
{
	struct line_write *s = l ? mem_alloc(1, sizeof *s) : NULL;
	size_t size = l ? l->size : 0;
	if (!s || (answer && r->unread_bytes > UNREAD_BYTES_MAX))
		drop_reader(r);
	if (r->is_closing || !send_pool_add(&r->send_share, size, loop_ms(r))) {
		mem_free(s);
		return;
	}
	*s = (struct line_write){.line = l, .is_answer = answer};
	l->reference_count++;
	r->unread_bytes += answer ? size : 0;
	s->request.data = s;
	static char newline[] = "\n";
	uv_buf_t parts[2] = {uv_buf_init(l->text, (unsigned)size), uv_buf_init(newline, 1)};
	if (uv_write(&s->request, (uv_stream_t *)&r->pipe, parts, 2, on_written)) {
		send_pool_subtract(&r->send_share, size, loop_ms(r));
		shared_line_release(l);
		mem_free(s);
		drop_reader(r);
	}
	send_pool_note_progress(&r->send_share, loop_ms(r));
}

/* Takes over the reference to o. */
static void send_object(struct reader *r, json_t *o, bool answer)
{
	struct shared_line *l = shared_line_new(o);
	send_line(r, l, answer);
	shared_line_release(l);
}

static void send_answer(struct reader *r, json_t *o)
{
	send_object(r, o, true);
}

static void set_subscription(struct reader *r, const json_t *list)
{
	static const struct {
		const char *name;
		enum topic topic;
	} topics[] = {{"jobs", TOPIC_JOBS}, {"workers", TOPIC_WORKERS}, {"snapshot", TOPIC_SNAPSHOT}};
	unsigned wanted = 0;
	bool is_known = true;
	for (size_t i = 0; i < json_array_size(list); i++) {
		const char *name = json_string_value(json_array_get(list, i));
		unsigned found = 0;
		for (size_t k = 0; name && k < sizeof topics / sizeof *topics; k++)
			if (strcmp(name, topics[k].name) == 0)
				found = topics[k].topic;
		is_known = is_known && found;
		wanted |= found;
	}
	if (is_known)
		r->topics |= wanted;
	else
		send_answer(r, line_error("only jobs, workers and snapshot can be subscribed to"));
}

static void handle_line(struct reader *r, size_t size)
{
	json_error_t fault;
	json_t *o = json_loadb(r->line, size, JSON_REJECT_DUPLICATES, &fault);
	const json_t *list = json_object_get(o, "subscribe"), *job = json_object_get(o, "job"),
		     *before = json_object_get(o, "endedBefore");
	if (json_is_array(list))
		set_subscription(r, list);
	else if (json_is_string(job))
		send_answer(r, line_job(r->socket->jobs, json_string_value(job)));
	else if (json_is_string(before) || json_is_null(before))
		send_answer(r, line_ended_jobs(r->socket->jobs, json_string_value(before)));
	else
		send_answer(r, line_error("expected {\"subscribe\":[...]} with jobs, workers, snapshot, "
					  "{\"job\":\"j1\"}, or {\"endedBefore\":\"j1\"}"));
	json_decref(o);
}

static void on_alloc(uv_handle_t *h, size_t suggested, uv_buf_t *out)
{
	(void)suggested;
	struct reader *r = h->data;
	*out = uv_buf_init(r->line + r->line_size, (unsigned)(LINE_BYTES - r->line_size));
}

static void on_read(uv_stream_t *stream, ssize_t count, const uv_buf_t *b)
{
	(void)b;
	struct reader *r = stream->data;
	if (count < 0) {
		drop_reader(r);
		return;
	}
	r->line_size += (size_t)count;
	for (char *end; !r->is_closing && (end = memchr(r->line, '\n', r->line_size));) {
		size_t n = (size_t)(end - r->line);
		handle_line(r, n);
		r->line_size -= n + 1;
		memmove(r->line, end + 1, r->line_size);
	}
	if (!r->is_closing && r->line_size == LINE_BYTES)
		drop_reader(r);
}

static void start_snapshot(struct status_socket *t, unsigned changed_topics);

static void on_connection(uv_stream_t *listener, int status)
{
	struct status_socket *t = listener->data;
	if (!t)
		return;
	struct reader *r = status ? NULL : mem_alloc(1, sizeof *r);
	t->is_accept_pending = !r && !status; /* until it is accepted, it blocks all other readers */
	if (!r)
		return;
	uv_pipe_init(listener->loop, &r->pipe, 0);
	r->pipe.data = r;
	r->socket = t;
	r->send_share =
		(struct send_share){.pool = &t->peers->send_pool, .unsent_bytes = unsent_bytes, .evict = evict_reader};
	LIST_INSERT_HEAD(&t->readers, r, next);
	t->reader_count++;
	if (uv_accept(listener, (uv_stream_t *)&r->pipe)) {
		drop_reader(r);
		return;
	}
	/* Some systems would otherwise buffer hundreds of snapshots, which are old when they are read. */
	int room = KERNEL_BUFFER_BYTES;
	uv_send_buffer_size((uv_handle_t *)&r->pipe, &room);
	/* The line fits into the kernel's buffer, so it is sent before the reader is dropped. */
	if (t->reader_count > READERS_MAX) {
		send_answer(r, line_error("the status has too many readers: 64 others are connected to its socket"));
		drop_reader(r);
		return;
	}
	r->is_behind = true;
	if (!t->is_tick_pending)
		start_snapshot(t, 0);
}

static const struct job_view *find_published_job(const struct status_socket *t, uint64_t id)
{
	for (size_t i = 0; i < t->published_job_count; i++)
		if (t->published_jobs[i].record.id == id)
			return &t->published_jobs[i];
	return NULL;
}

static void publish_object(struct status_socket *t, enum topic topic, json_t *o)
{
	struct shared_line *l = shared_line_new(o);
	for (struct reader *r = LIST_FIRST(&t->readers); r; r = LIST_NEXT(r, next))
		if ((r->topics & topic) && !r->is_behind)
			send_line(r, l, false);
	shared_line_release(l);
}

static bool wants_snapshot(const struct reader *r, unsigned changed_topics)
{
	return !r->is_closing && (r->is_behind ? queued_bytes(r) == 0 : changed_topics & r->topics & TOPIC_SNAPSHOT);
}

static void run_snapshot_task(void *making)
{
	struct snapshot_task *m = making;
	if (m->needs_snapshot)
		m->snapshot_line = shared_line_new(snapshot_to_json(m->snapshot));
	if (m->changed_topics & TOPIC_WORKERS)
		m->workers_line = shared_line_new(snapshot_workers_to_json(m->snapshot));
	uv_async_send(&m->done_async);
}

static void on_task_closed(uv_handle_t *h)
{
	mem_free(h->data);
}

static void on_snapshot_done(uv_async_t *done)
{
	struct snapshot_task *m = done->data;
	struct status_socket *t = m->socket;
	if (m->has_thread)
		uv_thread_join(&m->thread);
	for (struct reader *r = t ? LIST_FIRST(&t->readers) : NULL; r; r = LIST_NEXT(r, next)) {
		if ((m->changed_topics & r->topics & TOPIC_WORKERS) && !r->is_behind)
			send_line(r, m->workers_line, false);
		if (!m->needs_snapshot || !wants_snapshot(r, m->changed_topics))
			continue;
		r->is_behind = false;
		send_line(r, m->snapshot_line, false);
		if (!r->has_snapshot && !r->is_closing && uv_read_start((uv_stream_t *)&r->pipe, on_alloc, on_read))
			drop_reader(r);
		r->has_snapshot = true;
	}
	if (t)
		t->task = NULL;
	snapshot_free(m->snapshot);
	shared_line_release(m->snapshot_line);
	shared_line_release(m->workers_line);
	uv_close((uv_handle_t *)done, on_task_closed);
}

/* Begins to make a snapshot if a reader needs one: those subscribed to snapshots if something changed, and those that
 * were behind and have read everything. One snapshot serves all, because making it takes tens of milliseconds with a
 * thousand workers. changed_topics: topics of which there is news. */
static void start_snapshot(struct status_socket *t, unsigned changed_topics)
{
	bool snapshot_needed = false, workers = false;
	for (struct reader *r = LIST_FIRST(&t->readers); r; r = LIST_NEXT(r, next)) {
		snapshot_needed = snapshot_needed || wants_snapshot(r, changed_topics);
		workers = workers || (!r->is_behind && changed_topics & r->topics & TOPIC_WORKERS);
	}
	if (t->task || !(snapshot_needed || workers))
		return;
	struct snapshot_task *m = mem_alloc(1, sizeof *m);
	struct snapshot *n = m ? snapshot_new(t->peers) : NULL;
	if (!n) { /* every reader that should have been sent something is behind now */
		for (struct reader *r = LIST_FIRST(&t->readers); r; r = LIST_NEXT(r, next))
			r->is_behind = r->is_behind || changed_topics & r->topics;
		mem_free(m);
		return;
	}
	*m = (struct snapshot_task){
		.socket = t, .snapshot = n, .changed_topics = changed_topics, .needs_snapshot = snapshot_needed};
	t->task = m;
	m->done_async.data = m;
	uv_async_init(t->jobs->loop, &m->done_async, on_snapshot_done);
	m->has_thread = uv_thread_create(&m->thread, run_snapshot_task, m) == 0;
	if (!m->has_thread)
		run_snapshot_task(m);
}

/* Sends the jobs that have changed to their subscribers. */
static void publish_changes(struct status_socket *t)
{
	struct job_view *views;
	size_t count = jobs_list_views(t->jobs, LINES_ENDED_MAX, &views);
	for (size_t i = 0; i < count; i++) {
		const struct job_view *before = find_published_job(t, views[i].record.id);
		if (before && memcmp(before, &views[i], sizeof *before) == 0)
			continue;
		bool details = !record_is_ended(&views[i].record) || (before && !record_is_ended(&before->record));
		json_t *o = line_new("job");
		json_object_set_new(o, "job", view_to_json(&views[i], details));
		publish_object(t, TOPIC_JOBS, o);
	}
	mem_free(t->published_jobs);
	t->published_jobs = views;
	t->published_job_count = count;
}

static void on_listener_closed(uv_handle_t *h)
{
	mem_free(h);
}

static void close_listener(struct status_socket *t)
{
	if (!t->listener)
		return;
	t->listener->data = NULL;
	uv_close((uv_handle_t *)t->listener, on_listener_closed);
	t->listener = NULL;
}

/* Listens on fd, a bound socket, which belongs to the listener or is closed afterwards. */
static int listen_on(struct status_socket *t, int fd, struct error *e)
{
	const char *what = t->path ? t->path : "inherited status socket";
	uv_pipe_t *l = mem_alloc(1, sizeof *l);
	int fault = l ? uv_pipe_init(t->jobs->loop, l, 0) : UV_ENOMEM;
	if (fault) {
		mem_free(l);
		close(fd);
		return error_set(e, -fault, "%s: %s", what, uv_strerror(fault));
	}
	close_listener(t);
	l->data = t;
	t->listener = l;
	fault = uv_pipe_open(l, fd);
	if (fault)
		close(fd);
	else
		fault = uv_listen((uv_stream_t *)l, BACKLOG, on_connection);
	if (fault)
		close_listener(t);
	return fault ? error_set(e, -fault, "%s: %s", what, uv_strerror(fault)) : 0;
}

static void log_report(const struct status_socket *t, const char *text)
{
	log_event(LOG_STATUS_SOCKET, "path=%s text=%s", log_quote(t->path).text, log_quote(text).text);
}

/* Logs a fault once, although every check finds it again. */
static void report_once(struct status_socket *t, const char *text)
{
	if (!t->has_reported_fault)
		log_report(t, text);
	t->has_reported_fault = true;
}

/* Checks the socket's file. It may be removed while the coordinator runs, by a program that clears old files away or
 * by hand. Nobody could connect then until a restart, so it is made anew; existing connections stay. A file that
 * somebody else has put there is left alone. */
static void check_socket_file(struct status_socket *t)
{
	struct error e;
	if (!t->path || jobs_now(t->jobs) < t->file_checked_at + file_check_seconds)
		return;
	t->file_checked_at = jobs_now(t->jobs);
	enum socket_file_state state = socket_file_check(&t->file);
	if (state == SOCKET_FILE_REPLACED)
		report_once(t, "another file is where the status socket was: nobody can ask for the status");
	if (state == SOCKET_FILE_INTACT)
		t->has_reported_fault = false;
	if (state != SOCKET_FILE_MISSING)
		return;
	int fd = socket_file_open(&t->file, &e), rc = fd < 0 ? fd : listen_on(t, fd, &e);
	if (rc) {
		socket_file_remove(&t->file); /* the file may exist although no socket listens on it */
		error_prefix(&e, rc, "the status socket's file was removed, and cannot be made anew yet");
		report_once(t, e.text);
		return;
	}
	log_report(t, "the status socket's file was removed, and has been made anew");
	t->has_reported_fault = false;
}

void status_tick(struct status_socket *t)
{
	unsigned topics = 0;
	if (!t)
		return;
	check_socket_file(t);
	if (t->is_accept_pending && t->listener)
		on_connection((uv_stream_t *)t->listener, 0);
	t->is_tick_pending = t->task;
	if (t->task) /* changes are looked for after the snapshot has been sent, so that no newer line precedes it */
		return;
	for (struct reader *r = LIST_FIRST(&t->readers); r; r = LIST_NEXT(r, next))
		topics |= r->topics;
	bool changed = topics && t->published_change_count != t->jobs->change_count;
	for (struct reader *r = LIST_FIRST(&t->readers); changed && r; r = LIST_NEXT(r, next))
		r->is_behind = r->is_behind || (r->topics && queued_bytes(r));
	if (changed)
		t->published_change_count = t->jobs->change_count;
	if (changed && (topics & TOPIC_JOBS))
		publish_changes(t);
	start_snapshot(t, changed ? topics : 0);
}

static void free_socket(struct status_socket *t)
{
	if (!t)
		return;
	mem_free(t->published_jobs);
	mem_free(t->path);
	mem_free(t->group);
	mem_free(t);
}

int status_open(struct status_socket **out, struct peers *s, int inherited, const char *path, const char *group,
		struct error *e)
{
	if (inherited >= 0 && group)
		return error_set(
			e, EINVAL,
			"--status-group: the socket belongs to the service manager: set SocketGroup= in its unit");
	struct status_socket *t = mem_alloc(1, sizeof *t);
	if (!t || (inherited < 0 && !(t->path = mem_strdup(path))) || (group && !(t->group = mem_strdup(group)))) {
		free_socket(t);
		return error_set(e, ENOMEM, "no memory for the status socket");
	}
	t->peers = s;
	t->jobs = s->jobs;
	t->file_checked_at = jobs_now(s->jobs);
	t->file = (struct socket_file){.path = t->path, .group = t->group};
	*out = t;
	int fd = t->path ? socket_file_open(&t->file, e) : inherited;
	return fd < 0 ? fd : listen_on(t, fd, e);
}

void status_close(struct status_socket *t)
{
	if (!t)
		return;
	for (struct reader *r; (r = LIST_FIRST(&t->readers));) {
		drop_reader(r);
		LIST_REMOVE(r, next);
		r->socket = NULL;
	}
	if (t->task)
		t->task->socket = NULL;
	if (t->path)
		socket_file_remove(&t->file);
	close_listener(t);
	free_socket(t);
}
