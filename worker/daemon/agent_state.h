/* SPDX-License-Identifier: Apache-2.0 */
/* The daemon's state, shared by agent.c (connection and shutdown), lease_queue.c (messages of the coordinator about
 * jobs and leases), lease_list.c (the list of leases), scenes_kept.c (scenes in memory), fetch.c (files), outgoing.c
 * (messages to the coordinator) and hang_watch.c (threads that make no progress). */
#ifndef WORKER_DAEMON_AGENT_STATE_H
#define WORKER_DAEMON_AGENT_STATE_H

#include "common/net/conn.h"
#include "worker/daemon/config.h"
#include "worker/daemon/lease_task.h"
#include "worker/render/fingerprint.h"

enum { WORLDS_KEPT = 2 /* number of scenes kept in memory for jobs without leases here */ };

/* The job whose scene may be in memory while only one scene may (scenes_kept_admit). Times are of clock_seconds. */
struct scene_turn {
	uint64_t job;
	bool waits;   /* another job waits for its turn */
	double since; /* since when another job has waited */
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
	unsigned attempt;  /* number of connection attempts; selects one of the name's addresses in turn */
	struct tls *tls;   /* NULL: plaintext */
	struct conn *conn; /* NULL: not connected */
	bool welcome;	   /* the coordinator has accepted Hello */
	double back_off;   /* pause before the next attempt, s */
	char fingerprint[FINGERPRINT_MAX];
	struct cache cache;
	struct thread_pool *thread_pool;
	struct job_cache *job_caches;
	struct fetch *fetches;
	struct lease_task *leases;
	struct scene_turn turn;
	uint64_t clock;			/* counter of uses of job_caches */
	bool backlog;			/* too many results wait to be acknowledged: no leases are requested */
	uint64_t busy_at;		/* ms of the loop's clock: when the worker last had a lease */
	bool watched;			/* the service manager expects notifications */
	bool leaving;			/* no more leases are accepted */
	bool gone;			/* Bye has been sent, and the handles are being closed */
	bool refused;			/* the coordinator refuses this worker permanently */
	char why[256];			/* the coordinator's reason */
	bool hung;			/* a thread of the pool hangs */
	void (*settle)(struct agent *); /* agent_settle; called after each change of the leases */
};

#endif
