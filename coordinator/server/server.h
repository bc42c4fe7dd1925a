/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator: jobs, connections and status on one loop in one thread; heavy work on films runs in the thread
 * pool. server_run returns when a signal has stopped it.
 */
#ifndef COORDINATOR_SERVER_SERVER_H
#define COORDINATOR_SERVER_SERVER_H

#include "coordinator/live_job/jobs.h"
#include "coordinator/peers/peers.h"

/* Runs the coordinator until SIGTERM, SIGINT or a fault. Returns 0 or the error. */
int server_run(const struct server_config *c, struct error *e);

/* The rest is for callers that run the loop themselves. */

struct status_socket;

struct server {
	uv_loop_t loop;
	uv_timer_t tick_timer;
	uv_prepare_t before_poll;
	uv_check_t after_poll;
	double polled_at; /* s: when the loop last polled its sockets */
	uv_signal_t sigterm_handle, sigint_handle;
	struct jobs jobs;
	struct peers peers;
	struct status_socket *status;
	double next_tls_check; /* next check of the TLS files */
	/* Interval of the service manager's watchdog (0: none), and when to notify it next. */
	double watchdog_seconds, next_watchdog;
};

/* Starts to listen, and to read the jobs of an earlier run, which the loop continues (recovery.h). */
int server_open(struct server **out, const struct server_config *c, struct error *e);
int server_await_jobs(struct server *s, struct error *e); /* runs the loop until those jobs have been read */
void server_close(struct server *s); /* stops the coordinator, unless a signal has done so, and frees it */

#endif
