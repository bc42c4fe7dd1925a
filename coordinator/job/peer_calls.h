/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the jobs ask of the connections: a table of functions, which whoever has the connections fills in (peers.h).
 * Jobs know a peer by its number alone. One that has gone is passed over; nothing here fails. The loop's thread.
 */
#ifndef COORDINATOR_JOB_PEER_CALLS_H
#define COORDINATOR_JOB_PEER_CALLS_H

#include "coordinator/core/farm.h"

#include <stdbool.h>

struct live_job;

struct peer_calls {
	void *user;					/* first argument of all of them */
	const char *(*name)(void *user, uint64_t peer); /* as it calls itself; NULL: it has gone */

	/* To a worker. send_lease: anew: with seeds, whatever the epoch. */
	void (*send_lease)(void *user, uint64_t peer, const struct live_job *job, const struct lease_key *k, bool anew);
	void (*revoke)(void *user, uint64_t peer, const struct lease_key *k);
	void (*acknowledge)(void *user, uint64_t peer, const struct lease_key *k, enum ack ack, const char *text);

	/* To whoever it is. refused: what it asked for, by the core; fault: it sent what it must not, and is hung up
	 * on; dismiss: the same, and the core has forgotten it. */
	void (*refused)(void *user, uint64_t peer, const char *text);
	void (*fault)(void *user, uint64_t peer, const char *text);
	void (*dismiss)(void *user, uint64_t peer, const char *text);
	/* The answer to extend_job. refusal: why not; NULL: it is done, and the text says what that was. */
	void (*extended)(void *user, uint64_t peer, const char *refusal, const char *text);

	/* To all whom it concerns. */
	void (*job_ended)(void *user, uint64_t job);  /* workers */
	void (*jobs_let_go)(void *user);	      /* clients that watch one of those that ended */
	void (*films_free)(void *user, uint64_t job); /* who waits for a preview */
	void (*jobs_read)(void *user);		      /* all jobs of the last run are there: what waited for that */

	bool (*uses_result)(void *user, uint64_t job); /* a client fetches or awaits it */
	/* Bytes of the scenes that others with this peer's certificate are sending just now. */
	uint64_t (*uploading)(void *user, uint64_t peer);
};

#endif
