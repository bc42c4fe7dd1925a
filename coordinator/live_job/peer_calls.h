/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the jobs need from the connections: a table of functions, filled in by peers.h. Jobs know peers by number only.
 * Calls for a peer that is gone do nothing; nothing here fails. The loop's thread.
 */
#ifndef COORDINATOR_LIVE_JOB_PEER_CALLS_H
#define COORDINATOR_LIVE_JOB_PEER_CALLS_H

#include "common/blob/blob.h"
#include "coordinator/core/farm.h"

#include <stdbool.h>

struct live_job;
struct peers;

struct peer_calls {
	struct peers *user;					/* first argument of all of them */
	const char *(*name)(struct peers *user, uint64_t peer); /* its own name; NULL: it is gone */

	/* To a worker. send_lease: anew: with seeds, whatever the epoch. */
	void (*send_lease)(struct peers *user, uint64_t peer, const struct live_job *job, const struct lease_key *k,
			   bool anew);
	void (*revoke)(struct peers *user, uint64_t peer, const struct lease_key *k);
	void (*acknowledge)(struct peers *user, uint64_t peer, const struct lease_key *k, enum ack ack,
			    const char *text);

	/* To any peer. fault: it sent something invalid and is disconnected; dismiss: the same, and the core has
	 * forgotten it. */
	void (*fault)(struct peers *user, uint64_t peer, const char *text);
	void (*dismiss)(struct peers *user, uint64_t peer, const char *text);
	/* The answer to extend_job. refusal: the reason; NULL: done, and the text says what. */
	void (*extended)(struct peers *user, uint64_t peer, const char *refusal, const char *text);

	/* To everybody concerned. */
	void (*job_ended)(struct peers *user, uint64_t job);  /* workers */
	void (*jobs_let_go)(struct peers *user);	      /* clients that watch a job that ended */
	void (*films_free)(struct peers *user, uint64_t job); /* those waiting for a preview */
	/* A file that files_check has begun to read: 0, or an error and its sentence. */
	void (*file_read)(struct peers *user, const struct blob_hash *h, int rc, const char *text);
	void (*jobs_read)(
		struct peers *user); /* the jobs of the last run have been read: requests that waited for that */

	bool (*uses_result)(const struct peers *user, uint64_t job); /* a client is fetching or awaiting it */
	/* Bytes of scenes that other connections with this peer's certificate are sending. */
	uint64_t (*uploading)(struct peers *user, uint64_t peer);
};

#endif
