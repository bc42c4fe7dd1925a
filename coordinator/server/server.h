/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator: jobs, connections and status on one loop and one thread; heavy work on films runs in the pool.
 * server_run returns when a signal has stopped it.
 */
#ifndef COORDINATOR_SERVER_SERVER_H
#define COORDINATOR_SERVER_SERVER_H

#include "coordinator/live_job/jobs.h"
#include "coordinator/peers/peers.h"

int server_run(const struct server_config *c, struct error *e);

/* ---- for callers that run its loop themselves ---- */

struct status_socket;

struct server {
	uv_loop_t loop;
	uv_timer_t tick;
	uv_prepare_t look;
	uv_check_t check;
	double looked; /* s: when the loop last polled its sockets */
	uv_signal_t on_term, on_int;
	struct jobs jobs;
	struct peers peers;
	struct status_socket *status;
	double tls_next; /* next check of its files */
	double watchdog,
		watchdog_next; /* the service manager's watchdog interval (0: none), and when to notify it next */
};

/* Starts to listen; the loop reads the jobs of an earlier run (recovery.h). */
int server_open(struct server **s, const struct server_config *c, struct error *e);
int server_await_jobs(struct server *s, struct error *e); /* runs the loop until they have been read */
void server_close(struct server *s);			  /* stops it, unless a signal has */

#endif
