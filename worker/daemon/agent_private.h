/* SPDX-License-Identifier: Apache-2.0 */
/* The daemon's state, for its two halves: agent.c (connection, life) and lease_queue.c (jobs and leases). */
#ifndef WORKER_DAEMON_AGENT_PRIVATE_H
#define WORKER_DAEMON_AGENT_PRIVATE_H

#include "common/net/conn.h"
#include "worker/daemon/agent.h"
#include "worker/daemon/fetch.h"
#include "worker/daemon/fingerprint.h"
#include "worker/daemon/lease_task.h"

enum { WORLDS_KEPT = 2 /* of jobs that have no lease here now */ };

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
	bool hung; /* a thread of the thread pool is */
};

/* agent.c */
int agent_open(struct agent **a, const struct agent_config *c, struct error *e);
void agent_close(struct agent *a); /* leaves, if it has not left; waits for its threads */
void agent_send(struct agent *a, const Farm__Envelope *m);
/* Leaves when nothing is left to do. */
void agent_settle(struct agent *a);

/* lease_queue.c */
void lease_queue_welcome(struct agent *a); /* (re)connected: asks for work, offers what is still unsent */
void lease_queue_message(struct agent *a, struct envelope *env, const unsigned char *payload, size_t size);
void lease_queue_leave(struct agent *a);	 /* gives back what has not begun */
void lease_queue_stop_all(struct agent *a);	 /* gives up what runs */
enum { STALL_LOOKS = 8 };			 /* without progress, until a thread hangs */
bool lease_queue_watch(struct agent *a);	 /* true: a thread hangs that did not at the last look */
bool lease_queue_is_idle(const struct agent *a); /* no lease is at work, none waits to be acknowledged */
void lease_queue_close(struct agent *a);	 /* after the thread pool has been closed */

#endif
