/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator: jobs, connections and status on one loop and one thread; heavy work on films goes to the pool.
 * server_run returns when a signal has stopped it.
 */
#ifndef COORDINATOR_SERVER_SERVER_H
#define COORDINATOR_SERVER_SERVER_H

#include "coordinator/job/jobs.h"
#include "coordinator/peers/peers.h"

int server_run(const struct server_config *c, struct error *e);

/* ---- for whoever turns its loop ---- */

struct status_socket;

struct server {
	uv_loop_t loop;
	uv_timer_t tick;
	uv_prepare_t look;
	uv_check_t check;
	double looked; /* s: when the loop looked at its sockets last */
	uv_signal_t on_term, on_int;
	struct jobs jobs;
	struct peers peers;
	struct status_socket *status;
	double tls_next;		/* when its files are looked at again */
	double watchdog, watchdog_next; /* the service manager's patience (0: none waits), and when it is told again
					   that we run */
};

/* It listens; the jobs of an earlier run are read by its loop (recovery.h). */
int server_open(struct server **s, const struct server_config *c, struct error *e);
int server_await_jobs(struct server *s, struct error *e); /* turns the loop until they are */
void server_stop(struct server *s);  /* no more is begun; the loop ends when what is under way has ended */
void server_close(struct server *s); /* stops it, if no signal has */

#endif
