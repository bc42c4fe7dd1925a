/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Connection and lifetime of the worker daemon. resolve_and_connect resolves the coordinator's name and connects; after
 * Hello is accepted, messages go to the lease queue (lease_queue.c), which requests leases, starts them and sends
 * results. Timers send heartbeats, reconnect with growing pauses, and look for threads that make no progress. On
 * SIGTERM the worker leaves: it waits for running leases until the grace period is over, says Bye and ends.
 *
 * Failures: after a lost connection the worker reconnects, for ever; a permanent refusal (another version, a
 * certificate) ends the daemon with AGENT_EXIT_REFUSED; a hanging thread ends the process with AGENT_EXIT_HUNG, after
 * the other threads have finished.
 */
#include "worker/daemon/agent.h"

#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/net/jitter.h"
#include "common/net/notify.h"
#include "common/net/uv_pool.h"
#include "worker/daemon/hang_watch.h"
#include "worker/daemon/lease_queue.h"
#include "worker/daemon/outgoing.h"

#include <assert.h>
#include <signal.h>
#include <stdio.h>
#include <unistd.h>

enum { HEADER_LIMIT = 1 << 22, PAYLOAD_LIMIT = 1 << 28, SEND_LIMIT = 1 << 30 };
static const double initial_backoff = 0.2, max_backoff = 10, stall_seconds = 30, linger_seconds = 5;

static void resolve_and_connect(struct agent *a);
static void disconnect_permanently(struct agent *a);

/* ---- connection ---- */

static void on_retry(uv_timer_t *t)
{
	resolve_and_connect(t->data);
}

/* Reconnects after a pause that doubles each time, with jitter, so that a hundred workers do not reconnect at once. */
static void schedule_reconnect(struct agent *a)
{
	double wait = jitter_seconds(a->backoff_seconds);
	a->backoff_seconds = a->backoff_seconds * 2 < max_backoff ? a->backoff_seconds * 2 : max_backoff;
	uv_timer_start(&a->retry_timer, on_retry, (uint64_t)(1000 * wait), 0);
}

static void on_opened(void *user)
{
	struct agent *a = user;
	char name[128];
	snprintf(name, sizeof name, "%s", a->config.name);
	conn_send(a->conn,
		  ENVELOPE(HELLO, hello, .version = FARM_VERSION, .role = FARM__ROLE__ROLE_WORKER, .name = name,
			   .fingerprint = a->fingerprint, .threads = a->config.threads, .home = a->cache.identity.home,
			   .restarts = a->cache.identity.restarts),
		  NULL, 0);
}

/* Takes up new certificates and revocation lists without a restart. */
static void refresh_tls(struct agent *a)
{
	struct error e;
	char text[384];
	int rc = a->tls ? tls_refresh(a->tls, &e) : 0;
	if (rc > 0)
		log_event(LOG_TLS_READ, "path=%s", log_quote(a->config.tls_folder).text);
	else if (rc < 0)
		log_event(LOG_TLS_FAULT, "text=%s", log_quote(e.text).text);
	if (a->tls && tls_expiry_warning_due(a->tls, time(NULL), text, sizeof text))
		log_event(LOG_TLS_EXPIRY, "text=%s", log_quote(text).text);
}

static void on_heartbeat(uv_timer_t *t)
{
	send_message(t->data, ENVELOPE(HEARTBEAT, heartbeat));
	refresh_tls(t->data);
}

static void handle_hello_ack(struct agent *a, const Farm__HelloAck *ack)
{
	if (!ack->accepted) {
		log_event(LOG_PEER_REFUSED, "coordinator=%s text=%s", a->config.coordinator_address,
			  log_quote(ack->text).text);
		a->is_refused = ack->final || ack->version != FARM_VERSION;
		text_copy(a->refusal, sizeof a->refusal, ack->text);
		conn_close(a->conn, ack->text);
		return;
	}
	uint64_t ms = ack->heartbeat_ms >= 10 ? ack->heartbeat_ms : 10;
	a->is_accepted = true;
	a->attempt_count--; /* so that this address is tried first when the connection is lost */
	a->backoff_seconds = initial_backoff;
	log_event(LOG_CONNECT, "coordinator=%s start=%llu", a->config.coordinator_address,
		  (unsigned long long)a->cache.identity.restarts);
	if (*ack->text)
		log_event(LOG_PEER_FAULT, "coordinator=%s text=%s", a->config.coordinator_address,
			  log_quote(ack->text).text);
	uv_timer_start(&a->heartbeat_timer, on_heartbeat, ms, ms);
	conn_set_idle_timeout(a->conn, 6e-3 * (double)ms + 1);
	lease_queue_on_connect(a);
}

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct agent *a = user;
	const Farm__Envelope *m = env->message;
	if (m->body_case == FARM__ENVELOPE__BODY_FAULT) {
		log_event(LOG_PEER_FAULT, "coordinator=%s text=%s", a->config.coordinator_address,
			  log_quote(m->fault->text).text);
		conn_close(a->conn, m->fault->text);
	} else if (a->is_accepted) {
		lease_queue_handle_message(a, env, payload, size);
	} else if (m->body_case == FARM__ENVELOPE__BODY_HELLO_ACK) {
		handle_hello_ack(a, m->hello_ack);
	} else {
		conn_close(a->conn, "the first answer must be that to hello");
	}
}

static void on_closed(void *user, const char *why)
{
	struct agent *a = user;
	if (!a->has_left)
		log_event(conn_had_bad_checksum(a->conn) ? LOG_PEER_GARBLED
			  : a->is_accepted		 ? LOG_PEER_CLOSED
							 : LOG_CONNECT_FAILED,
			  "coordinator=%s text=%s", a->config.coordinator_address, log_quote(why).text);
	a->conn = NULL;
	a->is_accepted = false;
	uv_timer_stop(&a->heartbeat_timer);
	if (a->is_refused)
		disconnect_permanently(a);
	else if (!a->has_left)
		schedule_reconnect(a);
	agent_leave_if_idle(a);
}

static const struct conn_events events = {.opened = on_opened, .message = on_message, .closed = on_closed};

static void fail_to_connect(struct agent *a, const struct error *e)
{
	log_event(LOG_CONNECT_FAILED, "coordinator=%s text=%s", a->config.coordinator_address, log_quote(e->text).text);
	schedule_reconnect(a);
}

static void on_resolved(uv_getaddrinfo_t *r, int status, struct addrinfo *found)
{
	struct agent *a = r->data;
	struct conn_config config = {{HEADER_LIMIT, PAYLOAD_LIMIT}, SEND_LIMIT, stall_seconds, 10, a->tls, NULL, NULL};
	struct net_addrs to;
	struct error e;
	a->is_resolving = false;
	net_addrs_set(&to, found);
	uv_freeaddrinfo(found);
	if (a->has_left)
		return;
	int rc =
		status ? error_set(&e, EHOSTUNREACH, "'%s': %s", a->config.coordinator_address, uv_strerror(status))
		       : net_addrs_filter_allowed(&to, a->config.coordinator_address, a->config.insecure || a->tls, &e);
	if (!rc)
		rc = conn_connect(&a->conn, &a->loop, &to.addrs[a->attempt_count++ % to.count], &config, &events, a,
				  &e);
	if (rc)
		fail_to_connect(a, &e);
}

/* Looks the name up again for each attempt, since its address may have changed. This may take long, so libuv's pool
 * does it. */
static void resolve_and_connect(struct agent *a)
{
	const struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICSERV};
	char host[NET_HOST_MAX];
	const char *port = "";
	struct error e;
	refresh_tls(a);
	int rc = net_addr_split(a->config.coordinator_address, host, &port, &e);
	a->resolve_request.data = a;
	if (!rc && (rc = uv_getaddrinfo(&a->loop, &a->resolve_request, on_resolved, host, port, &hints)))
		rc = error_set(&e, -rc, "'%s': %s", a->config.coordinator_address, uv_strerror(rc));
	a->is_resolving = !rc;
	if (rc)
		fail_to_connect(a, &e);
}

/* ---- leaving ---- */

static void disconnect_permanently(struct agent *a)
{
	if (a->has_left)
		return;
	a->has_left = true;
	send_message(a, ENVELOPE(BYE, bye));
	if (a->conn)
		conn_close_when_sent(a->conn, "leaving");
	if (a->is_resolving)
		uv_cancel((uv_req_t *)&a->resolve_request);
	uv_close((uv_handle_t *)&a->retry_timer, NULL);
	uv_close((uv_handle_t *)&a->heartbeat_timer, NULL);
	uv_close((uv_handle_t *)&a->grace_timer, NULL);
	uv_close((uv_handle_t *)&a->pulse_timer, NULL);
	uv_close((uv_handle_t *)&a->hang_timer, NULL);
	uv_close((uv_handle_t *)&a->sigterm_handle, NULL);
	uv_close((uv_handle_t *)&a->sigint_handle, NULL);
}

static void on_linger_over(uv_timer_t *t)
{
	disconnect_permanently(t->data);
}

static void on_grace_over(uv_timer_t *t)
{
	struct agent *a = t->data;
	log_event(LOG_STOP, "text=\"the grace period is over: unfinished leases are given up\"");
	lease_queue_stop_all(a);
	uv_timer_start(&a->grace_timer, on_linger_over, (uint64_t)(1000 * linger_seconds), 0);
	agent_leave_if_idle(a);
}

void agent_leave_if_idle(struct agent *a)
{
	if (a->is_leaving && !a->has_left && lease_queue_is_idle(a))
		disconnect_permanently(a);
}

static void begin_leaving(struct agent *a)
{
	notify_send("STOPPING=1");
	a->is_leaving = true;
	lease_queue_return_unstarted(a);
	uv_timer_start(&a->grace_timer, on_grace_over, (uint64_t)(1000 * a->config.grace_seconds), 0);
	agent_leave_if_idle(a);
}

static void on_hang_timer(uv_timer_t *t)
{
	struct agent *a = t->data;
	if (!hang_watch_check(a))
		return;
	log_event(LOG_STOP, "text=\"a thread hangs: the others finish, then the worker exits to be restarted\"");
	a->has_hung_thread = true;
	if (!a->is_leaving)
		begin_leaving(a);
}

static void on_signal(uv_signal_t *h, int number)
{
	struct agent *a = h->data;
	if (a->is_leaving) { /* a second signal ends the worker at once */
		log_event(LOG_STOP, "signal=%d text=\"at once\"", number);
		_exit(0);
	}
	log_event(LOG_STOP, "signal=%d grace=%g", number, a->config.grace_seconds);
	begin_leaving(a);
}

/* ---- start and end ---- */

static void on_pulse(uv_timer_t *t)
{
	struct agent *a = t->data;
	uint64_t now = uv_now(&a->loop);
	if (a->has_watchdog)
		notify_send("WATCHDOG=1");
	if (a->leases)
		a->last_busy_ms = now;
	if (a->is_leaving || !(a->config.idle_seconds > 0) ||
	    (double)(now - a->last_busy_ms) < 1000 * a->config.idle_seconds)
		return;
	log_event(LOG_STOP, "text=\"no lease for %g s\"", a->config.idle_seconds);
	begin_leaving(a);
}

/* Starts the timer that notifies the watchdog, at three times the expected rate, and checks for idleness. It is not
 * needed if there is neither a watchdog nor a limit on idle time. */
static void start_pulse(struct agent *a)
{
	double watchdog = notify_watchdog_seconds(), idle = a->config.idle_seconds, wait = 1;
	a->has_watchdog = watchdog > 0;
	a->last_busy_ms = uv_now(&a->loop);
	if (a->has_watchdog && watchdog / 3 < wait)
		wait = watchdog / 3;
	if (idle > 0 && idle / 4 < wait)
		wait = idle / 4;
	uint64_t ms = wait > 0.01 ? (uint64_t)(1000 * wait) : 10;
	if (a->has_watchdog || idle > 0)
		uv_timer_start(&a->pulse_timer, on_pulse, ms, ms);
}

static void init_handles(struct agent *a)
{
	uv_timer_init(&a->loop, &a->retry_timer);
	uv_timer_init(&a->loop, &a->heartbeat_timer);
	uv_timer_init(&a->loop, &a->grace_timer);
	uv_timer_init(&a->loop, &a->pulse_timer);
	uv_timer_init(&a->loop, &a->hang_timer);
	uv_signal_init(&a->loop, &a->sigterm_handle);
	uv_signal_init(&a->loop, &a->sigint_handle);
	a->retry_timer.data = a->heartbeat_timer.data = a->grace_timer.data = a->pulse_timer.data = a->hang_timer.data =
		a->sigterm_handle.data = a->sigint_handle.data = a;
	uv_signal_start(&a->sigterm_handle, on_signal, SIGTERM);
	uv_signal_start(&a->sigint_handle, on_signal, SIGINT);
	uint64_t look = (uint64_t)(1000 * a->config.stall_seconds / STALL_CHECKS);
	if (a->config.stall_seconds > 0)
		uv_timer_start(&a->hang_timer, on_hang_timer, look + !look, look + !look);
}

static int start_agent(struct agent *a, struct error *e)
{
	struct net_addrs to;
	int rc = a->config.tls_folder && *a->config.tls_folder ? tls_open(&a->tls, a->config.tls_folder, e) : 0;
	if (!rc)
		rc = net_addrs_resolve(&to, a->config.coordinator_address, e);
	if (!rc)
		rc = net_addrs_filter_allowed(&to, a->config.coordinator_address, a->config.insecure || a->tls, e);
	if (!rc)
		rc = cache_open(&a->cache, a->config.cache_folder, a->config.max_cache_bytes, e);
	if (rc)
		return rc;
	rc = uv_loop_init(&a->loop);
	if (rc)
		return error_set(e, -rc, "no event loop: %s", uv_strerror(rc));
	rc = uv_pool_start(&a->loop, e);
	if (!rc)
		rc = thread_pool_new(&a->thread_pool, &a->loop, a->config.threads, e);
	if (rc) {
		uv_run(&a->loop, UV_RUN_DEFAULT);
		uv_loop_close(&a->loop);
	}
	return rc;
}

int agent_open(struct agent **out, const struct agent_config *c, struct error *e)
{
	struct agent *a = mem_alloc(1, sizeof *a);
	if (!a)
		return error_set(e, ENOMEM, "no memory for the worker");
	signal(SIGPIPE, SIG_IGN);
	a->config = *c;
	a->leave_if_idle = agent_leave_if_idle;
	a->cache.lock_fd = -1;
	a->backoff_seconds = initial_backoff;
	fingerprint_make(a->fingerprint);
	int rc = start_agent(a, e);
	if (rc) {
		cache_close(&a->cache);
		tls_close(a->tls);
		mem_free(a);
		return rc;
	}
	log_event(LOG_START, "program=hslt-worker name=%s threads=%u fingerprint=%s", log_quote(c->name).text,
		  c->threads, log_quote(a->fingerprint).text);
	init_handles(a);
	start_pulse(a);
	resolve_and_connect(a);
	*out = a;
	return 0;
}

void agent_close(struct agent *a)
{
	disconnect_permanently(a);
	thread_pool_close(a->thread_pool);
	uv_run(&a->loop, UV_RUN_DEFAULT);
	int closed = uv_loop_close(&a->loop);
	assert(closed == 0);
	(void)closed;
	lease_queue_close(a);
	cache_close(&a->cache);
	tls_close(a->tls);
	mem_free(a);
}

int agent_run(const struct agent_config *c, struct error *e)
{
	struct agent *a;
	int rc = agent_open(&a, c, e);
	if (rc) /* an -EACCES of a file, which must not be taken for the coordinator's refusal */
		return rc == -EACCES ? -EIO : rc;
	notify_send("READY=1"); /* without waiting for a connection, which may take long */
	while (!a->has_left || a->conn)
		uv_run(&a->loop, UV_RUN_ONCE);
	/* Busy threads cannot be joined; everything has been sent. */
	if (a->has_hung_thread || a->is_resolving || thread_pool_pending(a->thread_pool))
		_exit(a->has_hung_thread ? AGENT_EXIT_HUNG : a->is_refused ? AGENT_EXIT_REFUSED : 0);
	int refused =
		a->is_refused ? error_set(e, EACCES, "%s refuses: %s", a->config.coordinator_address, a->refusal) : 0;
	agent_close(a);
	return refused;
}
