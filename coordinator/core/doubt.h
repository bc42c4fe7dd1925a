/*
 * Chain states that a worker could not go on from. Who refuses them is not to blame, nor is who made them until a second worker
 * says the same: the lease goes to another worker, neither to the one nor to the other while there is a third.
 *  - The third goes on: the refusal was wrong, and is counted as a wrong result.
 *  - The third refuses, too: the states are wrong, which is counted against who made them. The chains of the lease begin anew from
 *    their seeds: an epoch that depends on the plan alone. What the epoch before brought to the films stays.
 *  - There is no third: the chains begin anew, and nobody is to blame.
 * A job does not fail by it. Memory of a slot; nothing survives a restart of the coordinator, which asks again.
 */
#ifndef COORDINATOR_CORE_DOUBT_H
#define COORDINATOR_CORE_DOUBT_H

#include "common/film/batch.h"

#include <stdbool.h>
#include <stddef.h>

struct farm;
struct identity;
struct job;
struct peer;
struct slot;

struct doubt {
	uint64_t maker;   /* the worker whose states the next epoch begins with; 0: not known */
	uint64_t refuser; /* the first that could not read them; 0: nobody */
	bool anew;        /* its chains begin the next epoch from their seeds */
};

/* The lease of this worker is dropped already. */
void doubt_refused(struct farm *f, struct job *j, struct slot *s, const struct peer *p, const char *text);
/* Somebody else is asked about the states. */
bool doubt_waits(const struct slot *s);
bool doubt_bars(const struct farm *f, const struct job *j, const struct slot *s, const struct peer *p);
/* A result of the slot's next epoch is merged: its sender went on from the states. Before job_merge. */
void doubt_settle(struct farm *f, const struct job *j, struct slot *s, const struct identity *who, const struct lease_key *k);
/* Why the job waits for another worker; false: it does not. */
bool doubt_why(const struct farm *f, const struct job *j, char *text, size_t size);

#endif
