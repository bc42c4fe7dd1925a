/* SPDX-License-Identifier: Apache-2.0 */
/* The daemon's state. agent.c has connection and shutdown, lease_queue.c what the coordinator says of jobs and leases,
 * lease_list.c the leases, scenes_kept.c the scenes in memory, fetch.c files, outgoing.c messages, hang_watch.c threads
 * that make no progress. */
#ifndef WORKER_DAEMON_AGENT_STATE_H
#define WORKER_DAEMON_AGENT_STATE_H

#include "common/net/conn.h"
#include "worker/daemon/config.h"
#include "worker/daemon/lease_task.h"
#include "worker/render/fingerprint.h"

enum { WORLDS_KEPT = 2 /* worlds kept of jobs without leases here */ };

/* Whose scene is in memory while only one may be there: see scenes_kept_admit. Times are those of clock_seconds. */
struct scene_turn {
	uint64_t job;
	bool waits;   /* another job waits for its turn */
	double since; /* when that began */
	double asked; /* when a lease of another job was last refused */
};

struct fetch;

struct agent {
	struct agent_config config;
	uv_loop_t loop;
	uv_timer_t retry, heartbeat, grace, pulse, watch;
	uv_signal_t on_term, on_int;
	uv_getaddrinfo_t resolving;
	bool resolves;	   /* the coordinator's name is being looked up */
	unsigned attempt;  /* of the name's addresses, in turn */
	struct tls *tls;   /* NULL: plaintext */
	struct conn *conn; /* NULL: not connected */
	bool welcome;	   /* hello was accepted */
	double back_off;   /* s before the next attempt */
	char fingerprint[FINGERPRINT_MAX];
	struct cache cache;
	struct thread_pool *thread_pool;
	struct job_cache *job_caches;
	struct fetch *fetches;
	struct lease_task *leases;
	struct scene_turn turn;
	uint64_t clock;	  /* counter of uses of job_caches */
	bool backlog;	  /* too many results wait to be acknowledged: no new leases */
	uint64_t busy_at; /* ms of the loop: when it last had a lease */
	bool watched;	  /* the service manager expects notifications */
	bool leaving, gone;
	bool refused; /* permanently */
	char why[256];
	bool hung;			/* a thread of the pool hangs */
	void (*settle)(struct agent *); /* called after each change of the leases: it may be time to leave */
};

#endif
