/* SPDX-License-Identifier: Apache-2.0 */
/* The daemon's state, shared by agent.c (connection and shutdown), lease_queue.c (messages of the coordinator about
 * jobs and leases), lease_list.c (the list of leases), scene_limit.c (scenes in memory), fetch.c (files), outgoing.c
 * (messages to the coordinator) and hang_watch.c (threads that make no progress). */
#ifndef WORKER_DAEMON_AGENT_STATE_H
#define WORKER_DAEMON_AGENT_STATE_H

#include "common/net/conn.h"
#include "worker/daemon/config.h"
#include "worker/daemon/lease_task.h"
#include "worker/render/fingerprint.h"

enum { IDLE_WORLDS_MAX = 2 /* number of scenes kept in memory for jobs without leases here */ };

/* The job whose scene may be in memory while only one scene may (scene_limit_admit). Times are of clock_seconds. */
struct scene_turn {
	uint64_t job;
	bool has_waiter; /* another job waits for its turn */
	double waiting_since;
	double last_refused_at; /* when a lease of another job was last refused */
};

struct fetch;

struct agent {
	struct agent_config config;
	uv_loop_t loop;
	uv_timer_t retry_timer, heartbeat_timer, grace_timer, pulse_timer, hang_timer;
	uv_signal_t sigterm_handle, sigint_handle;
	uv_getaddrinfo_t resolve_request;
	bool is_resolving;	/* the coordinator's name is being looked up */
	unsigned attempt_count; /* selects one of the name's addresses in turn */
	struct tls *tls;	/* NULL: plaintext */
	struct conn *conn;	/* NULL: not connected */
	bool is_accepted;	/* the coordinator has accepted Hello */
	double backoff_seconds; /* pause before the next attempt */
	char fingerprint[FINGERPRINT_MAX];
	struct cache cache;
	struct thread_pool *thread_pool;
	struct job_cache *job_caches;
	struct fetch *fetches;
	struct lease_task *leases;
	struct scene_turn scene_turn;
	uint64_t use_counter;		       /* counts uses of job_caches */
	bool has_backlog;		       /* too many results wait to be acknowledged: no leases are requested */
	uint64_t last_busy_ms;		       /* by the loop's clock: when the worker last had a lease */
	bool has_watchdog;		       /* the service manager expects notifications */
	bool is_leaving;		       /* no more leases are accepted */
	bool has_left;			       /* Bye has been sent, and the handles are being closed */
	bool is_refused;		       /* the coordinator refuses this worker permanently */
	char refusal[256];		       /* the coordinator's reason */
	bool has_hung_thread;		       /* a thread of the pool hangs */
	void (*leave_if_idle)(struct agent *); /* agent_leave_if_idle; called after each change of the leases */
};

#endif
