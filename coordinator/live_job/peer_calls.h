/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the jobs need from the connections: a table of functions, filled in by peers.h. Jobs know peers by number
 * only. A call for a peer that is gone does nothing, and none of the functions fails. The loop's thread.
 */
#ifndef COORDINATOR_LIVE_JOB_PEER_CALLS_H
#define COORDINATOR_LIVE_JOB_PEER_CALLS_H

#include "common/blob/blob.h"
#include "coordinator/core/farm.h"

#include <stdbool.h>

struct live_job;
struct peers;

struct peer_calls {
	struct peers *user;					     /* the first argument of every function */
	const char *(*peer_name)(struct peers *user, uint64_t peer); /* the peer's own name; NULL: it is gone */

	/* Messages to a worker. send_lease: from_seeds: with seeds, whatever the epoch. */
	void (*send_lease)(struct peers *user, uint64_t peer, const struct live_job *job, const struct lease_key *k,
			   bool from_seeds);
	void (*revoke_lease)(struct peers *user, uint64_t peer, const struct lease_key *k);
	void (*acknowledge_result)(struct peers *user, uint64_t peer, const struct lease_key *k, enum ack ack,
				   const char *text);

	/* Disconnect any peer. fault_peer: it has sent something invalid; dismiss_peer: like fault_peer, but the core
	 * has already forgotten the peer. */
	void (*fault_peer)(struct peers *user, uint64_t peer, const char *text);
	void (*dismiss_peer)(struct peers *user, uint64_t peer, const char *text);
	/* The answer to extend_job. refusal: the reason; NULL: the job was extended, and text says how. */
	void (*answer_extension)(struct peers *user, uint64_t peer, const char *refusal, const char *text);

	/* Calls that concern several peers: */
	void (*announce_job_end)(struct peers *user, uint64_t job); /* tells workers that a job has ended */
	void (*release_watchers)(struct peers *user); /* lets clients go that watch a job that has ended */
	/* serves clients that wait for a preview of this job */
	void (*serve_previews)(struct peers *user, uint64_t job);
	/* A file that files_check was asked for has been read. rc: 0, or an error, described by text. */
	void (*announce_file_checked)(struct peers *user, const struct blob_hash *h, int rc, const char *text);
	/* The jobs of the last run have been read; handles the requests that waited for that. */
	void (*resume_requests)(struct peers *user);

	/* Whether a client is fetching the result, or waits for it. */
	bool (*is_result_in_use)(const struct peers *user, uint64_t job);
	/* Returns how many bytes of scene files other connections with this peer's certificate are sending. */
	uint64_t (*uploading_bytes)(struct peers *user, uint64_t peer);
};

#endif
