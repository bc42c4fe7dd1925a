/* SPDX-License-Identifier: Apache-2.0 */
/* The daemon's state: agent.c has the connection and the end, lease_queue.c jobs and leases, fetch.c files, outgoing.c
 * what is sent. */
#ifndef WORKER_DAEMON_AGENT_STATE_H
#define WORKER_DAEMON_AGENT_STATE_H

#include "common/net/conn.h"
#include "worker/daemon/config.h"
#include "worker/daemon/lease_task.h"
#include "worker/render/fingerprint.h"

enum { WORLDS_KEPT = 2 /* of jobs that have no lease here now */ };

struct fetch;

struct agent {
	struct agent_config config;
	uv_loop_t loop;
	uv_timer_t retry, heartbeat, grace, pulse, watch;
	uv_signal_t on_term, on_int;
	struct net_addr address;
	struct tls *tls;   /* NULL: plaintext */
	struct conn *conn; /* NULL: not connected */
	bool welcome;	   /* hello was accepted */
	double back_off;   /* s before the next attempt */
	char fingerprint[FINGERPRINT_MAX];
	struct cache cache;
	struct thread_pool *thread_pool;
	struct job_cache *bundles;
	struct fetch *fetches;
	struct lease_task *leases;
	uint64_t clock;	  /* of uses of bundles */
	bool backlog;	  /* so many results wait to be acknowledged that no more are made */
	uint64_t busy_at; /* ms of the loop: when it had a lease last */
	bool watched;	  /* the service manager waits to hear of us */
	bool leaving, gone;
	bool refused; /* for good */
	char why[256];
	bool hung;			/* a thread of the thread pool is */
	void (*settle)(struct agent *); /* after each change of the leases: it may be time to leave */
};

#endif
