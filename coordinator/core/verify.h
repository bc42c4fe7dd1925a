/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Leases that two workers compute: a result counts only when two answers are equal. The choice is a hash of the job
 * and the lease's key, so it does not depend on workers or order. Answers are compared by a digest of everything that
 * affects bits: a worker's first answer is noted, and one that equals another worker's note is merged. Memory for
 * this is allocated when the job is submitted.
 */
#ifndef COORDINATOR_CORE_VERIFY_H
#define COORDINATOR_CORE_VERIFY_H

#include "coordinator/core/proof.h"

#include <stdbool.h>

struct job;
struct peer_class;

/* Forgets the answers noted for the slot. */
void verify_forget_slot(struct farm *f, struct job *j, const struct slot *s);
void verify_forget_job(struct farm *f, struct job *j);
void verify_forget_worker(struct farm *f, const struct identity *identity);
/* Unpins each job of which nothing is merged yet if its class has at most one active worker and another class has
 * more: workers of that other class can then start it again. */
void verify_unpin_stranded_jobs(struct farm *f);
/* Whether workers of this class may begin a job that must be verified: the class has at least two active workers, or
 * no other class has. */
bool verify_class_can_begin(const struct farm *f, const struct job *j, const struct peer_class *c);
/* Writes why the job waits for another worker to verify a lease. Returns false if it does not wait for that. */
bool verify_describe_wait(const struct farm *f, const struct job *j, char *text, size_t size);

#endif
