/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Leases that two workers compute: whose answers are held against each other before one counts. Which ones is a hash of
 * the job and the lease's key, so that it depends on no worker and no order. An answer is known by the digest of what
 * decides bits; the first one of a worker is noted, one that equals another worker's note is merged. Memory for all of
 * it is taken when the job is submitted.
 */
#ifndef COORDINATOR_CORE_VERIFY_H
#define COORDINATOR_CORE_VERIFY_H

#include "common/film/batch.h"
#include "coordinator/core/worker_registry.h"

#include <stdbool.h>

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

bool verify_chosen(const struct job *j, const struct lease_key *k);
/* Workers that the slot's open lease may be with at once, but for stragglers: two before there is an answer. */
uint32_t verify_copies(const struct job *j, const struct slot *s);
/* It may not have the slot's lease: it answered already, or another connection of it has it. */
bool verify_bars(const struct job *j, const struct slot *s, const struct peer *p);
/* A worker has the slot's lease or has answered it, and it waits for another one. */
bool verify_waits(const struct job *j, const struct slot *s);

enum verify_answer {
	VERIFY_AGREES, /* with another worker's: it counts */
	VERIFY_NOTED,
	VERIFY_DIFFERS,	    /* noted, and differs from those before */
	VERIFY_REPEATED,    /* this worker said so before */
	VERIFY_CONTRADICTS, /* this worker said something else before */
	VERIFY_HOPELESS,    /* VERIFY_MOST workers gave as many answers */
};
enum verify_answer verify_take(struct farm *f, struct job *j, struct slot *s, struct identity *who,
			       const struct batch_digest *d);
/* The answer with this digest is the right one: whoever gave another is told of, and nothing is noted any more. */
void verify_settle(struct farm *f, struct job *j, struct slot *s, const struct batch_digest *right);
/* "a, b, c": who answered. */
void verify_names(const struct job *j, const struct slot *s, char *text, size_t size);

void verify_forget_job(struct farm *f, struct job *j);
void verify_forget_worker(struct farm *f, const struct identity *who);
/* A job of which nothing counts yet goes to workers of another fingerprint where its own have no second one. */
void verify_change_class(struct farm *f);
/* Whether workers of this class may begin a job that must be verified; where no class has two of them, any may. */
bool verify_may_begin(const struct farm *f, const struct job *j, const struct peer_class *c);
/* Why the job waits for another worker; false: it does not. */
bool verify_why(const struct farm *f, const struct job *j, char *text, size_t size);

#endif
