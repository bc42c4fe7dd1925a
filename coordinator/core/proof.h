/* SPDX-License-Identifier: Apache-2.0 */
/* The answers to a lease that two workers compute, while they wait for each other (verify.h), and the choice of
 * those leases. */
#ifndef COORDINATOR_CORE_PROOF_H
#define COORDINATOR_CORE_PROOF_H

#include "coordinator/core/worker_registry.h"

enum { VERIFY_MOST = 4 /* limit of answers that all differ: the job cannot be computed reproducibly */ };

struct proof {
	uint32_t count;
	struct identity *who[VERIFY_MOST];
	struct batch_digest digest[VERIFY_MOST];
};

struct job;
struct peer;
struct slot;

bool proof_chosen(const struct job *j, const struct lease_key *k);
/* How many workers may hold the slot's open lease at once, apart from copies of slow ones: two before there is an
 * answer. */
uint32_t proof_copies(const struct job *j, const struct slot *s);
/* The worker may not get the slot's lease: it has answered already, or another connection of it holds it. */
bool proof_bars(const struct job *j, const struct slot *s, const struct peer *p);
/* A worker holds or has answered the slot's lease, and another one is needed. */
bool proof_waits(const struct job *j, const struct slot *s);

enum verify_answer {
	VERIFY_AGREES, /* with another worker's answer: it counts */
	VERIFY_NOTED,
	VERIFY_DIFFERS,	    /* noted, but differs from earlier ones */
	VERIFY_REPEATED,    /* the same worker sent the same before */
	VERIFY_CONTRADICTS, /* the same worker sent something else before */
	VERIFY_HOPELESS,    /* VERIFY_MOST workers gave as many different answers */
};
enum verify_answer proof_take(struct job *j, struct slot *s, struct identity *who, const struct batch_digest *d);
/* "a, b, c": the workers that answered. */
void proof_names(const struct job *j, const struct slot *s, char *text, size_t size);

struct proof *proof_of(const struct job *j, const struct slot *s);

#endif
