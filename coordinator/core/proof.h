/* SPDX-License-Identifier: Apache-2.0 */
/* The answers of a lease that two workers compute, while they wait for each other (verify.h); and which leases those
 * are. */
#ifndef COORDINATOR_CORE_PROOF_H
#define COORDINATOR_CORE_PROOF_H

#include "coordinator/core/worker_registry.h"

enum { VERIFY_MOST = 4 /* answers that all differ: the job cannot be computed here */ };

struct proof {
	uint32_t count;
	struct identity *who[VERIFY_MOST];
	struct batch_digest digest[VERIFY_MOST];
};

struct job;
struct peer;
struct peer_class;
struct slot;

bool proof_chosen(const struct job *j, const struct lease_key *k);
/* Workers that the slot's open lease may be with at once, but for stragglers: two before there is an answer. */
uint32_t proof_copies(const struct job *j, const struct slot *s);
/* It may not have the slot's lease: it answered already, or another connection of it has it. */
bool proof_bars(const struct job *j, const struct slot *s, const struct peer *p);
/* A worker has the slot's lease or has answered it, and it waits for another one. */
bool proof_waits(const struct job *j, const struct slot *s);

enum verify_answer {
	VERIFY_AGREES, /* with another worker's: it counts */
	VERIFY_NOTED,
	VERIFY_DIFFERS,	    /* noted, and differs from those before */
	VERIFY_REPEATED,    /* this worker said so before */
	VERIFY_CONTRADICTS, /* this worker said something else before */
	VERIFY_HOPELESS,    /* VERIFY_MOST workers gave as many answers */
};
enum verify_answer proof_take(struct job *j, struct slot *s, struct identity *who, const struct batch_digest *d);
/* "a, b, c": who answered. */
void proof_names(const struct job *j, const struct slot *s, char *text, size_t size);

struct proof *proof_of(const struct job *j, const struct slot *s);

#endif
