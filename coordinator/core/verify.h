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
#include "coordinator/core/proof.h"

#include <stdbool.h>

struct job;
struct peer_class;

void verify_forget(struct farm *f, struct job *j, const struct slot *s); /* what was answered of it */
void verify_forget_job(struct farm *f, struct job *j);
void verify_forget_worker(struct farm *f, const struct identity *who);
/* A job of which nothing counts yet goes to workers of another fingerprint where its own have no second one. */
void verify_change_class(struct farm *f);
/* Whether workers of this class may begin a job that must be verified; where no class has two of them, any may. */
bool verify_may_begin(const struct farm *f, const struct job *j, const struct peer_class *c);
/* Why the job waits for another worker; false: it does not. */
bool verify_why(const struct farm *f, const struct job *j, char *text, size_t size);

#endif
