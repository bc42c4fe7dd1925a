/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Leases that two workers compute: their answers are compared before one counts. The choice is a hash of the job and
 * the lease's key, so it does not depend on workers or order. An answer is identified by the digest of what affects
 * bits; a worker's first answer is noted, and one that equals another worker's note is merged. Memory for this is
 * allocated when the job is submitted.
 */
#ifndef COORDINATOR_CORE_VERIFY_H
#define COORDINATOR_CORE_VERIFY_H

#include "coordinator/core/proof.h"

#include <stdbool.h>

struct job;
struct peer_class;

void verify_forget(struct farm *f, struct job *j, const struct slot *s); /* answers received for it */
void verify_forget_job(struct farm *f, struct job *j);
void verify_forget_worker(struct farm *f, const struct identity *who);
/* Moves a job of which nothing counts yet to workers of another fingerprint if its own have no second worker. */
void verify_change_class(struct farm *f);
/* Whether workers of this class may begin a job that must be verified. If no class has two workers, any may. */
bool verify_may_begin(const struct farm *f, const struct job *j, const struct peer_class *c);
/* Why the job waits for another worker; false: it does not wait. */
bool verify_why(const struct farm *f, const struct job *j, char *text, size_t size);

#endif
