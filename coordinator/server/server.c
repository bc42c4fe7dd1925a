/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's event loop.
 *
 * server_open opens the jobs, which starts to read those of the last run (recovery.h), and listens. From then on
 * sockets, timers and the thread pool drive everything: messages of peers become events for the core (step.h). Five
 * times a second a timer drives all periodic work: status, retries, checkpoints, retention, the service manager's
 * watchdog.
 *
 * SIGTERM and SIGINT stop the loop as soon as the work in the thread pool has ended; nothing needs to be written
 * then, because everything acknowledged is on disk. Errors of one job hold or end that job. A fault that makes the
 * spool unusable stops the coordinator with a message (server_run returns it).
 */
#include "coordinator/server/server.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/net/notify.h"
#include "common/net/uv_pool.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/jobs/lifecycle.h"
#include "coordinator/server/limits.h"
#include "coordinator/status/status.h"

#include <assert.h>
#include <signal.h>

enum { BACKLOG = 4096 };

static void on_connection(uv_stream_t *listener, int status)
{
	struct server *s = listener->data;
	if (status == 0 && !s->jobs.is_stopping)
		peers_accept(&s->peers, (struct listener *)listener);
}

static int write_port(const char *path, unsigned port, struct error *e)
{
	char text[16];
	int n = snprintf(text, sizeof text, "%u\n", port);
	return disk_replace(path, text, (size_t)n, 0644, e);
}

/* Listens at one address. With port 0 it binds to a free port, which `a` contains afterwards. Returns 0 or an error
 * code of libuv. */
static int listen_at_address(struct server *s, struct net_addr *a)
{
	uv_tcp_t *l = &s->peers.listeners[s->peers.listener_count++].tcp;
	char text[80];
	int length = sizeof a->storage;
	uv_tcp_init(&s->loop, l);
	l->data = s;
	int rc = uv_tcp_bind(l, (const struct sockaddr *)&a->storage, 0);
	if (!rc)
		rc = uv_listen((uv_stream_t *)l, BACKLOG, on_connection);
	if (!rc)
		rc = uv_tcp_getsockname(l, (struct sockaddr *)&a->storage, &length);
	if (rc)
		return rc;
	net_addr_format(a, text, sizeof text);
	log_event(LOG_LISTEN, "address=%s tls=%s", text, s->peers.tls ? "yes" : "no");
	return 0;
}

/* Looks up the addresses of the name, and refuses those that need TLS or --insecure. */
static int resolve_addresses(const struct server *s, struct net_addrs *l, struct error *e)
{
	const char *address = s->jobs.config.listen_address;
	int rc = net_addrs_resolve(l, address, e);
	for (unsigned i = 0; !rc && i < l->count; i++)
		rc = net_addr_check_allowed(&l->addrs[i], address, s->jobs.config.insecure || s->peers.tls, e);
	return rc;
}

/* Listens at all these addresses, with the same port. Addresses that this machine does not have (::1 without IPv6) are
 * left out, provided that it has another one. */
static int start_listening(struct server *s, struct net_addrs *l, struct error *e)
{
	const char *address = s->jobs.config.listen_address;
	unsigned port = 0;
	int fault = UV_EADDRNOTAVAIL;
	for (unsigned i = 0; i < l->count; i++) {
		if (port)
			net_addr_set_port(&l->addrs[i], port);
		int rc = listen_at_address(s, &l->addrs[i]);
		if (!rc)
			port = net_addr_port(&l->addrs[i]);
		else if (rc != UV_EADDRNOTAVAIL && rc != UV_EAFNOSUPPORT)
			return error_set(e, -rc, "cannot listen at %s: %s", address, uv_strerror(rc));
		else
			fault = rc;
	}
	if (!port)
		return error_set(e, -fault, "cannot listen at %s: %s", address, uv_strerror(fault));
	return s->jobs.config.port_file ? write_port(s->jobs.config.port_file, port, e) : 0;
}

static int open_tls(struct server *s, struct error *e)
{
	int rc = tls_open(&s->peers.tls, s->jobs.config.tls_folder, e);
	if (rc)
		return rc;
	tls_set_recheck(s->peers.tls, s->jobs.config.tls_check_seconds);
	const struct tls_peer *self = tls_own_certificate(s->peers.tls);
	if (self->role == TLS_COORDINATOR)
		return 0;
	return error_set(e, EINVAL,
			 "%s: the certificate of %s is a %s's, and no peer would accept it as a coordinator's",
			 s->jobs.config.tls_folder, self->name, tls_role_name(self->role));
}

/* Looks for a changed certificate or revocation list once a second, and logs warnings about their expiry. */
static void refresh_tls(struct server *s)
{
	struct error e;
	char text[384];
	if (!s->peers.tls || jobs_now(&s->jobs) < s->next_tls_check)
		return;
	s->next_tls_check = jobs_now(&s->jobs) + 1;
	int rc = tls_refresh(s->peers.tls, &e);
	if (rc > 0)
		log_event(LOG_TLS_READ, "path=%s", log_quote(s->jobs.config.tls_folder).text);
	else if (rc < 0)
		log_event(LOG_TLS_FAULT, "text=%s", log_quote(e.text).text);
	if (tls_expiry_warning_due(s->peers.tls, time(NULL), text, sizeof text))
		log_event(LOG_TLS_EXPIRY, "text=%s", log_quote(text).text);
}

/* Called before the loop polls its sockets. After on_after_poll, which is called behind the poll, everything that had
 * arrived by then has been read. */
static void on_before_poll(uv_prepare_t *h)
{
	struct server *s = h->data;
	s->polled_at = jobs_now(&s->jobs);
}

static void on_after_poll(uv_check_t *h)
{
	struct server *s = h->data;
	s->jobs.messages_read_until = s->polled_at;
}

static void on_tick(uv_timer_t *t)
{
	struct server *s = t->data;
	log_report_withheld();
	refresh_tls(s);
	peers_tick(&s->peers);
	status_tick(s->status);
	jobs_tick(&s->jobs);
	if (s->watchdog_seconds > 0 && jobs_now(&s->jobs) >= s->next_watchdog) {
		s->next_watchdog = jobs_now(&s->jobs) + s->watchdog_seconds / 3;
		notify_send("WATCHDOG=1");
	}
}

/* Stops accepting work. The loop ends when the running work has ended. */
static void stop_server(void *server)
{
	struct server *s = server;
	if (s->jobs.is_stopping)
		return;
	notify_send("STOPPING=1");
	jobs_stop(&s->jobs);
	peers_stop(&s->peers);
	uv_close((uv_handle_t *)&s->tick_timer, NULL);
	uv_close((uv_handle_t *)&s->before_poll, NULL);
	uv_close((uv_handle_t *)&s->after_poll, NULL);
	uv_close((uv_handle_t *)&s->sigterm_handle, NULL);
	uv_close((uv_handle_t *)&s->sigint_handle, NULL);
	status_close(s->status);
	s->status = NULL;
}

static void on_signal(uv_signal_t *h, int number)
{
	log_event(LOG_STOP, "signal=%d", number);
	stop_server(h->data);
}

static void init_handles(struct server *s)
{
	jobs_init(&s->jobs);
	peers_init(&s->peers);
	uv_timer_init(&s->loop, &s->tick_timer);
	uv_prepare_init(&s->loop, &s->before_poll);
	uv_check_init(&s->loop, &s->after_poll);
	uv_signal_init(&s->loop, &s->sigterm_handle);
	uv_signal_init(&s->loop, &s->sigint_handle);
	s->tick_timer.data = s->before_poll.data = s->after_poll.data = s;
	s->sigterm_handle.data = s->sigint_handle.data = s;
	uv_signal_start(&s->sigterm_handle, on_signal, SIGTERM);
	uv_signal_start(&s->sigint_handle, on_signal, SIGINT);
	uv_timer_start(&s->tick_timer, on_tick, TICK_MS, TICK_MS);
	uv_prepare_start(&s->before_poll, on_before_poll);
	uv_check_start(&s->after_poll, on_after_poll);
}

void server_close(struct server *s)
{
	stop_server(s);
	uv_run(&s->loop, UV_RUN_DEFAULT);
	int closed = uv_loop_close(&s->loop);
	assert(closed == 0);
	(void)closed;
	jobs_close(&s->jobs);
	tls_close(s->peers.tls);
	mem_free(s);
}

int server_open(struct server **out, const struct server_config *c, struct error *e)
{
	struct server *s = mem_alloc(1, sizeof *s);
	if (!s)
		return error_set(e, ENOMEM, "no memory for the server");
	signal(SIGPIPE, SIG_IGN);
	s->jobs.config = *c;
	s->jobs.loop = &s->loop;
	s->jobs.stop = stop_server;
	s->jobs.stop_user = s;
	s->peers.jobs = &s->jobs;
	s->watchdog_seconds = notify_watchdog_seconds();
	int rc = uv_loop_init(&s->loop);
	if (rc) {
		mem_free(s);
		return error_set(e, -rc, "no event loop: %s", uv_strerror(rc));
	}
	rc = uv_pool_start(&s->loop, e);
	init_handles(s);
	if (!rc)
		rc = s->jobs.config.tls_folder && *s->jobs.config.tls_folder ? open_tls(s, e) : 0;
	struct net_addrs addresses;
	if (!rc) /* before the spool is created */
		rc = resolve_addresses(s, &addresses, e);
	if (!rc)
		rc = limits_reserve_connections(c->max_connections, &s->jobs.config.max_connections, e);
	if (!rc)
		rc = jobs_open(&s->jobs, e);
	int inherited = notify_inherited_socket();
	if (!rc && (inherited >= 0 || c->status_socket))
		rc = status_open(&s->status, &s->peers, inherited, c->status_socket, c->status_group, e);
	if (!rc)
		rc = start_listening(s, &addresses, e);
	if (rc)
		server_close(s);
	else
		*out = s;
	return rc;
}

int server_await_jobs(struct server *s, struct error *e)
{
	while (recovery_is_running(&s->jobs) && !s->jobs.is_stopping)
		uv_run(&s->loop, UV_RUN_ONCE);
	*e = s->jobs.fatal_error;
	return s->jobs.fatal_code;
}

int server_run(const struct server_config *c, struct error *e)
{
	struct server *s;
	int rc = server_open(&s, c, e);
	if (rc)
		return rc;
	notify_send("READY=1");
	uv_run(&s->loop, UV_RUN_DEFAULT);
	rc = s->jobs.fatal_code;
	*e = s->jobs.fatal_error;
	server_close(s);
	return rc;
}
