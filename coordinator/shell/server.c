/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's event loop, and how an event runs through it.
 *
 * server_open opens the spool, the ledger and the core, starts to read the jobs of the last run (recovery.h), and
 * listens. From then on whatever happens becomes an event: server_step gives it to the core (core/farm.h), which
 * changes its state and answers with a list of actions, and dispatch.c carries these out. Events that come up meanwhile
 * are queued and follow before server_step returns. Five times a second a timer drives what has to happen by itself:
 * status, retries, checkpoints, retention, the service manager's watchdog.
 *
 * SIGTERM and SIGINT stop the loop when the work in the thread pool has ended; nothing needs to be written then, for
 * everything acknowledged is on disk. Errors of one job hold or end that job. A fault that makes the spool unreadable
 * stops the coordinator with a message (server_run returns it).
 */
#include "coordinator/shell/server.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/net/notify.h"
#include "coordinator/shell/ages.h"
#include "coordinator/shell/checkpoint.h"
#include "coordinator/shell/clear.h"
#include "coordinator/shell/dispatch.h"
#include "coordinator/shell/durable.h"
#include "coordinator/shell/files.h"
#include "coordinator/shell/folder.h"
#include "coordinator/shell/held.h"
#include "coordinator/shell/incoming.h"
#include "coordinator/shell/late.h"
#include "coordinator/shell/limits.h"
#include "coordinator/shell/recovery.h"
#include "coordinator/shell/restore.h"
#include "coordinator/shell/session.h"
#include "coordinator/shell/status.h"
#include "coordinator/shell/trust.h"

#include <assert.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>

enum { BACKLOG = 4096, TICK_MS = 200 };

/* Of what this process may have. */
static uint64_t quarter_of_memory(void)
{
	uint64_t all = uv_get_total_memory(), ours = uv_get_constrained_memory();
	return (ours && ours < all ? ours : all) / 4;
}

void server_config_init(struct server_config *c)
{
	*c = (struct server_config){.listen = "127.0.0.1:7700",
				    .heartbeat_seconds = 5,
				    .retry_seconds = 2,
				    .clear_seconds = 30 * 86400.0,
				    .max_faults = 3,
				    .max_fetches = FETCHES_MOST,
				    .journal_bytes = 64 << 20,
				    .keep_bytes = 2000000000,
				    .film_bytes = quarter_of_memory(),
				    .waiting_bytes = quarter_of_memory(),
				    .hello_seconds = 10,
				    .stall_seconds = 30,
				    .tls_check_seconds = 60};
}

double server_now(const struct server *s)
{
	(void)s;
	return (double)uv_hrtime() * 1e-9;
}

/* ---- the core ---- */

void server_defer(struct server *s, const struct event *ev)
{
	struct deferred *d = mem_alloc(1, sizeof *d);
	if (!d) /* 300 bytes: without them nothing can go on */
		abort();
	d->event = *ev;
	text_copy(d->text, sizeof d->text, ev->text ? ev->text : "");
	d->event.text = d->text;
	*s->deferred_last = d;
	s->deferred_last = &d->next;
}

void server_job_broken(struct server *s, uint64_t job, const char *text)
{
	struct event ev = {.kind = EVENT_JOB_BROKEN, .job = job, .text = text};
	server_defer(s, &ev);
}

static void on_wake(uv_timer_t *t);

static const struct incoming nothing;

static void one_step(struct server *s, struct event *ev, const struct incoming *in)
{
	struct update u;
	ev->time = server_now(s);
	ev->unread = ev->time - s->read;
	if (ev->unread < s->config.heartbeat_seconds + 1e-3 * TICK_MS) /* nobody is missed for so little */
		ev->unread = 0;
	farm_step(s->farm, ev, &u);
	s->changes++;
	dispatch_update(s, &u, in);
	if (isfinite(u.wake) && !s->stopping) {
		double ms = ceil(1000 * (u.wake - server_now(s)));
		uv_timer_start(&s->wake, on_wake, ms > 1 ? (uint64_t)ms : 1, 0);
	} else {
		uv_timer_stop(&s->wake);
	}
}

void server_step(struct server *s, struct event *ev)
{
	if (s->stepping) /* what sessions say while an update is carried out */
		server_defer(s, ev);
	else
		server_step_with(s, ev, &nothing);
}

void server_step_with(struct server *s, struct event *ev, const struct incoming *in)
{
	assert(!s->stepping);
	s->stepping = true;
	one_step(s, ev, in);
	while (s->deferred) {
		struct deferred *d = s->deferred;
		s->deferred = d->next;
		if (!s->deferred)
			s->deferred_last = &s->deferred;
		one_step(s, &d->event, &nothing);
		mem_free(d);
	}
	s->stepping = false;
	dispatch_finish_orders(s);
	late_feed(s);
	checkpoint_where_due(s);
}

static void on_wake(uv_timer_t *t)
{
	struct event ev = {.kind = EVENT_TICK};
	server_step(t->data, &ev);
}

/* ---- orders ---- */

const char *server_film_folder(const struct server *s, const struct plan *p)
{
	uint64_t bytes = canvas_bytes(p) + recovery_film_bytes(s) + (s->reading ? canvas_bytes(&s->reading->plan) : 0);
	for (const struct live_job *o = s->orders; o; o = o->next)
		if (o->canvas && !canvas_is_mapped(o->canvas))
			bytes += canvas_bytes(&o->plan);
	return bytes <= s->config.film_bytes ? NULL : spool_canvas(s->spool);
}

struct live_job *server_live_job(const struct server *s, uint64_t job)
{
	for (struct live_job *o = s->orders; o; o = o->next)
		if (o->id == job)
			return o;
	return NULL;
}

/* One at a time, so that nobody else waits for all of them. */
static void on_drain(uv_timer_t *t)
{
	struct server *s = t->data;
	struct live_job *o = s->orders;
	while (o && (o->busy || !o->waiting))
		o = o->next;
	if (!o)
		return;
	struct waiting_batch *w = live_job_take_waiting(o);
	server_result(s, w->peer, &w->envelope, &w->payload);
	waiting_batch_free(w);
	if (!s->stopping)
		uv_timer_start(&s->drain, on_drain, 0, 0);
}

void server_order_free_again(struct server *s)
{
	if (!s->stopping)
		uv_timer_start(&s->drain, on_drain, 0, 0);
	dispatch_finish_orders(s);
	late_feed(s);
}

/* ---- views ---- */

static void view_order(struct server *s, const struct live_job *o, struct job_view *v)
{
	struct job_status status;
	struct canvas_counts counted;
	view_of_record(v, &o->record);
	if (o->canvas) { /* in the end what the image holds, until then all that has come */
		canvas_counts(o->canvas, !o->ended, &counted);
		record_take_counted(&v->record, &o->plan, &counted, o->black, o->lit.beyond_share);
		record_add_note(&v->record, o->doubts);
	}
	if (o->ended)
		record_add_doubt(&v->record);
	if (!farm_job(s->farm, o->id, server_now(s), &status))
		return;
	view_add_status(v, &status);
	if (o->ended && (o->busy || o->unpublished || o->unrecorded)) { /* not before its image is there */
		text_copy(v->record.state, sizeof v->record.state, job_state_name(JOB_RUNNING));
		if (*o->record.why)
			text_print(v->waiting, sizeof v->waiting, "its %s cannot be written: %s",
				   o->unrecorded ? "record" : "image", o->record.why);
		else
			text_copy(v->waiting, sizeof v->waiting, "its image is being written");
		memcpy(v->owners_waiting, v->waiting, sizeof v->waiting);
		v->record.reason[0] = 0;
		v->record.exit_code = 0;
	}
}

bool server_view(struct server *s, uint64_t job, struct job_view *v)
{
	struct job_record r;
	struct live_job *o = server_live_job(s, job);
	if (o) {
		view_order(s, o, v);
		return true;
	}
	if (recovery_view(s, job, v))
		return true;
	for (size_t i = 0; i < s->ended_count; i++)
		if (s->ended[i].id == job) {
			view_of_record(v, &s->ended[i]);
			return true;
		}
	if (spool_read_record(s->spool, job, &r, NULL))
		return false;
	view_of_record(v, &r);
	return true;
}

static int by_id(const void *a, const void *b)
{
	const struct job_view *x = a, *y = b;
	return (x->record.id > y->record.id) - (x->record.id < y->record.id);
}

size_t server_views(struct server *s, struct job_view **views)
{
	size_t count = s->ended_count + recovery_views(s, NULL), n = 0;
	for (struct live_job *o = s->orders; o; o = o->next)
		count++;
	*views = mem_alloc(count, sizeof **views);
	if (!*views)
		return 0;
	for (size_t i = 0; i < s->ended_count; i++)
		view_of_record(&(*views)[n++], &s->ended[i]);
	for (struct live_job *o = s->orders; o; o = o->next)
		view_order(s, o, &(*views)[n++]);
	n += recovery_views(s, *views + n);
	qsort(*views, count, sizeof **views, by_id);
	return count;
}

/* ---- start ---- */

/* Jobs of an earlier life that have ended, and those that were never accepted: whoever submitted them has no answer. */
static int read_ended(struct server *s, struct error *e)
{
	uint64_t *ids;
	size_t count;
	int rc = spool_jobs(s->spool, &ids, &count, e);
	if (rc)
		return rc;
	s->ended = mem_alloc(ENDED_MAX, sizeof *s->ended);
	if (!s->ended) {
		mem_free(ids);
		return error_set(e, ENOMEM, "no memory for the list of jobs");
	}
	for (size_t i = count > ENDED_MAX ? count - ENDED_MAX : 0; i < count; i++) {
		struct job_record *r = &s->ended[s->ended_count];
		struct error fault;
		if (restore_lives(s, ids[i]))
			continue;
		rc = spool_read_record(s->spool, ids[i], r, &fault);
		if (rc == -ENOENT) /* the number of a job that did not get as far as a record */
			continue;
		if (rc) {
			log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)ids[i],
				  log_quote(fault.text).text);
			continue;
		}
		if (!record_is_ended(r)) {
			text_copy(r->state, sizeof r->state, "failed");
			text_copy(r->reason, sizeof r->reason, job_end_name(END_FAILED));
			text_copy(r->why, sizeof r->why, "the coordinator stopped before the job was accepted");
			r->exit_code = 3;
			r->ended = (double)time(NULL);
			r->ended_seen = ages_now(s);
			if (spool_write_record(s->spool, r, &fault))
				log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(fault.text).text);
		}
		s->ended_count++;
	}
	mem_free(ids);
	log_event(LOG_SPOOL_READ, "path=%s jobs=%zu next=j%llu", log_quote(s->config.spool).text, s->ended_count,
		  (unsigned long long)spool_next_job(s->spool));
	return 0;
}

static void on_connection(uv_stream_t *listener, int status)
{
	struct server *s = listener->data;
	if (status == 0 && !s->stopping)
		session_accept(s);
}

static int write_port(const char *path, unsigned port, struct error *e)
{
	char text[16], temporary[4096];
	int n = snprintf(text, sizeof text, "%u\n", port);
	snprintf(temporary, sizeof temporary, "%s.tmp", path);
	int fd = disk_open(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
	int rc = fd < 0 || disk_write_all(fd, text, (size_t)n) ? error_set(e, errno, "%s: %s", path, strerror(errno))
							       : 0;
	if (fd >= 0)
		disk_close(fd);
	if (!rc && disk_rename(temporary, path))
		rc = error_set(e, errno, "%s: %s", path, strerror(errno));
	return rc;
}

static int start_listening(struct server *s, struct error *e)
{
	struct net_addr a, bound;
	char text[80];
	int length = sizeof bound.storage;
	int rc = net_addr_resolve(&a, s->config.listen, e);
	if (!rc)
		rc = net_addr_allow(&a, s->config.listen, s->config.insecure || s->tls, e);
	if (rc)
		return rc;
	memset(&bound, 0, sizeof bound);
	rc = uv_tcp_bind(&s->listener, (const struct sockaddr *)&a.storage, 0);
	if (!rc)
		rc = uv_listen((uv_stream_t *)&s->listener, BACKLOG, on_connection);
	if (!rc)
		rc = uv_tcp_getsockname(&s->listener, (struct sockaddr *)&bound.storage, &length);
	if (rc)
		return error_set(e, -rc, "cannot listen at %s: %s", s->config.listen, uv_strerror(rc));
	net_addr_format(&bound, text, sizeof text);
	log_event(LOG_LISTEN, "address=%s tls=%s", text, s->tls ? "yes" : "no");
	return s->config.port_file ? write_port(s->config.port_file, net_addr_port(&bound), e) : 0;
}

static int open_tls(struct server *s, struct error *e)
{
	int rc = tls_open(&s->tls, s->config.tls, e);
	if (rc)
		return rc;
	tls_set_recheck(s->tls, s->config.tls_check_seconds);
	const struct tls_peer *self = tls_self(s->tls);
	if (self->role == TLS_COORDINATOR)
		return 0;
	return error_set(e, EINVAL, "%s: the certificate of %s is a %s's, and nobody would take it for a coordinator's",
			 s->config.tls, self->name, tls_role_name(self->role));
}

/* A list of the revoked or a new certificate is taken up within a second. */
static void refresh_tls(struct server *s)
{
	struct error e;
	char text[384];
	if (!s->tls || server_now(s) < s->tls_next)
		return;
	s->tls_next = server_now(s) + 1;
	int rc = tls_refresh(s->tls, &e);
	if (rc > 0)
		log_event(LOG_TLS_READ, "path=%s", log_quote(s->config.tls).text);
	else if (rc < 0)
		log_event(LOG_TLS_FAULT, "text=%s", log_quote(e.text).text);
	if (tls_warning_due(s->tls, time(NULL), text, sizeof text))
		log_event(LOG_TLS_EXPIRY, "text=%s", log_quote(text).text);
}

/* What came before the loop looked at its sockets has been read when it has. */
static void on_look(uv_prepare_t *h)
{
	struct server *s = h->data;
	s->looked = server_now(s);
}

static void on_read(uv_check_t *h)
{
	struct server *s = h->data;
	s->read = s->looked;
}

static void on_tick(uv_timer_t *t)
{
	struct server *s = t->data;
	log_tick();
	refresh_tls(s);
	if (s->caller_waits)
		session_accept(s);
	for (struct session *p = s->sessions; p; p = p->next) {
		session_tick(p);
		held_tick(p);
	}
	if (recovery_is_on(s))
		s->changes++;
	status_tick(s->status);
	durable_tick(s);
	files_tick(s);
	folder_tick(s);
	clear_tick(s);
	checkpoint_where_due(s);
	if (s->watchdog > 0 && server_now(s) >= s->watchdog_next) {
		s->watchdog_next = server_now(s) + s->watchdog / 3;
		notify_send("WATCHDOG=1");
	}
}

void server_stop(struct server *s)
{
	if (s->stopping)
		return;
	s->stopping = true;
	notify_send("STOPPING=1");
	uv_close((uv_handle_t *)&s->listener, NULL);
	uv_close((uv_handle_t *)&s->wake, NULL);
	uv_close((uv_handle_t *)&s->tick, NULL);
	uv_close((uv_handle_t *)&s->drain, NULL);
	uv_close((uv_handle_t *)&s->look, NULL);
	uv_close((uv_handle_t *)&s->check, NULL);
	uv_close((uv_handle_t *)&s->on_term, NULL);
	uv_close((uv_handle_t *)&s->on_int, NULL);
	for (struct session *p = s->sessions; p; p = p->next)
		conn_close(p->conn, "the coordinator stops");
	status_close(s->status);
	s->status = NULL;
	recovery_stop(s);
}

static void on_signal(uv_signal_t *h, int number)
{
	log_event(LOG_STOP, "signal=%d", number);
	server_stop(h->data);
}

static int open_stores(struct server *s, struct error *e)
{
	struct farm_config config;
	int rc = spool_open(&s->spool, s->config.spool, e);
	if (!rc)
		rc = blob_store_open(&s->blobs, spool_blobs(s->spool), s->config.blob_bytes, e);
	if (!rc)
		ages_open(s);
	if (!rc)
		rc = restore_open(s, e);
	if (!rc)
		rc = read_ended(s, e);
	if (rc)
		return rc;
	if (s->config.keep_partials && disk_mkdir(s->config.keep_partials, 0777) && errno != EEXIST)
		return error_set(e, errno, "%s: %s", s->config.keep_partials, strerror(errno));
	farm_config_init(&config);
	config.max_peers = s->config.max_connections;
	config.first_job = spool_next_job(s->spool);
	config.silent_after = 3 * s->config.heartbeat_seconds;
	config.max_faults = s->config.max_faults;
	config.first_pause = 2 * s->config.heartbeat_seconds;
	uv_random(NULL, NULL, &config.verify_seed, sizeof config.verify_seed, 0, NULL);
	config.forget_after = 6 * s->config.heartbeat_seconds;
	rc = farm_new(&s->farm, &config, e);
	if (!rc)
		rc = trust_open(s, e);
	if (!rc)
		rc = recovery_begin(s, e);
	return rc;
}

static void init_handles(struct server *s)
{
	uv_tcp_init(&s->loop, &s->listener);
	uv_timer_init(&s->loop, &s->wake);
	uv_timer_init(&s->loop, &s->tick);
	uv_timer_init(&s->loop, &s->drain);
	uv_prepare_init(&s->loop, &s->look);
	uv_check_init(&s->loop, &s->check);
	uv_signal_init(&s->loop, &s->on_term);
	uv_signal_init(&s->loop, &s->on_int);
	s->listener.data = s->wake.data = s->tick.data = s->drain.data = s->look.data = s->check.data =
		s->on_term.data = s->on_int.data = s;
	uv_signal_start(&s->on_term, on_signal, SIGTERM);
	uv_signal_start(&s->on_int, on_signal, SIGINT);
	uv_timer_start(&s->tick, on_tick, TICK_MS, TICK_MS);
	uv_prepare_start(&s->look, on_look);
	uv_check_start(&s->check, on_read);
	s->read = server_now(s);
}

static void close_stores(struct server *s)
{
	recovery_close(s);
	while (s->orders) {
		struct live_job *next = s->orders->next;
		live_job_free(s->orders);
		s->orders = next;
	}
	while (s->deferred) {
		struct deferred *next = s->deferred->next;
		mem_free(s->deferred);
		s->deferred = next;
	}
	durable_close(s);
	clear_close(s);
	if (s->seen.up > 0)
		ages_keep(s);
	if (s->farm)
		farm_free(s->farm);
	blob_store_close(s->blobs);
	spool_close(s->spool);
	mem_free(s->ended);
	mem_free(s->restored);
}

void server_close(struct server *s)
{
	server_stop(s);
	uv_run(&s->loop, UV_RUN_DEFAULT);
	int closed = uv_loop_close(&s->loop);
	assert(closed == 0);
	(void)closed;
	close_stores(s);
	tls_close(s->tls);
	mem_free(s);
}

int server_open(struct server **out, const struct server_config *c, struct error *e)
{
	struct server *s = mem_alloc(1, sizeof *s);
	if (!s)
		return error_set(e, ENOMEM, "no memory for the server");
	signal(SIGPIPE, SIG_IGN);
	s->config = *c;
	s->deferred_last = &s->deferred;
	s->acks_last = &s->acks;
	s->watchdog = notify_watchdog();
	int rc = uv_loop_init(&s->loop);
	if (rc) {
		mem_free(s);
		return error_set(e, -rc, "no event loop: %s", uv_strerror(rc));
	}
	init_handles(s);
	rc = s->config.tls && *s->config.tls ? open_tls(s, e) : 0;
	if (!rc)
		rc = limits_connections(c->max_connections, &s->config.max_connections, e);
	if (!rc)
		rc = open_stores(s, e);
	int inherited = notify_inherited_unix();
	if (!rc && (inherited >= 0 || c->status_socket))
		rc = status_open(&s->status, s, inherited, c->status_socket, c->status_group, e);
	if (!rc)
		rc = start_listening(s, e);
	if (rc)
		server_close(s);
	else
		*out = s;
	return rc;
}

int server_await_jobs(struct server *s, struct error *e)
{
	while (recovery_is_on(s) && !s->stopping)
		uv_run(&s->loop, UV_RUN_ONCE);
	*e = s->fault_error;
	return s->fault;
}

int server_run(const struct server_config *c, struct error *e)
{
	struct server *s;
	int rc = server_open(&s, c, e);
	if (rc)
		return rc;
	notify_send("READY=1");
	uv_run(&s->loop, UV_RUN_DEFAULT);
	rc = s->fault;
	*e = s->fault_error;
	server_close(s);
	return rc;
}
