/* SPDX-License-Identifier: Apache-2.0 */
/* Which leases are verified, that is, computed by two workers (verify.h), and the answers to such a lease while no
 * two of them agree. */
#ifndef COORDINATOR_CORE_PROOF_H
#define COORDINATOR_CORE_PROOF_H

#include "coordinator/core/worker_registry.h"

/* Limit on answers that all differ; when it is reached the job cannot be computed reproducibly. */
enum { VERIFY_ANSWERS_MAX = 4 };

struct proof {
	uint32_t count;
	struct identity *workers[VERIFY_ANSWERS_MAX];
	struct batch_digest digests[VERIFY_ANSWERS_MAX];
};

struct job;
struct peer;
struct slot;

/* Whether this lease is verified: a hash of the job's seed, its id and the lease's key is below the job's fraction. */
bool proof_is_required(const struct job *j, const struct lease_key *k);
/* How many workers may hold the slot's open lease at once, apart from copies of slow leases: two while no answer has
 * been noted, then one. */
uint32_t proof_max_holders(const struct job *j, const struct slot *s);
/* Whether the worker may not get the slot's lease: it has answered already, or holds the lease on another connection.
 */
bool proof_bars_worker(const struct job *j, const struct slot *s, const struct peer *p);
/* Whether the slot waits for another worker: one holds or has answered its lease, and another answer is needed. */
bool proof_is_pending(const struct job *j, const struct slot *s);

enum verify_outcome {
	VERIFY_AGREES, /* equals another worker's answer: the result counts */
	VERIFY_NOTED,
	VERIFY_DIFFERS,	    /* noted; differs from all earlier answers */
	VERIFY_REPEATED,    /* equals what the same worker sent before */
	VERIFY_CONTRADICTS, /* differs from what the same worker sent before */
	VERIFY_HOPELESS,    /* VERIFY_ANSWERS_MAX workers gave as many different answers */
};
/* Compares an answer with the noted ones, and notes it if it is the worker's first and equals none of them. */
enum verify_outcome proof_add_answer(struct job *j, struct slot *s, struct identity *identity,
				     const struct batch_digest *d);
/* Writes the names of the workers that have answered, as in "a, b, c". */
void proof_format_names(const struct job *j, const struct slot *s, char *text, size_t size);

struct proof *proof_for_slot(const struct job *j, const struct slot *s);

#endif
