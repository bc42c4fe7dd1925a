/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All connections: who is here, and the limits that hold for all of them together. They call the jobs; what the jobs
 * want of them comes by the table that peers_init fills in (peer_calls.h). The loop's thread.
 */
#ifndef COORDINATOR_PEERS_PEERS_H
#define COORDINATOR_PEERS_PEERS_H

#include "common/net/conn.h"
#include "coordinator/job/jobs.h"

struct session;

enum { SESSION_BUCKETS = 4096 };

struct peers {
	struct jobs *jobs;
	struct tls *tls;   /* NULL: plaintext */
	uv_tcp_t listener; /* its loop is the jobs' */
	struct session *sessions, *by_id[SESSION_BUCKETS];
	unsigned session_count, fetches;
	size_t held_bytes; /* of what they ask for while jobs are read */
	uint64_t last_peer;
	uint64_t garbled;  /* connections on which bytes were changed */
	bool caller_waits; /* nobody could be let in: to be tried again */
};

/* jobs, tls are set; the jobs' loop is. Fills in jobs->peers. */
void peers_init(struct peers *s);
void peers_accept(struct peers *s); /* somebody calls */
void peers_tick(struct peers *s);   /* every TICK_MS */
void peers_stop(struct peers *s);   /* closes the listener and all connections */

struct session *peers_find(const struct peers *s, uint64_t id); /* NULL: it has gone */
void peers_delist(struct peers *s, struct session *p);		/* its connection has closed */

#endif
