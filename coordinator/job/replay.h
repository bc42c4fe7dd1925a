/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What was merged of a job, from its checkpoint and its journal into its live job, by the code that live batches go
 * through, so that the bits are the same. A result counts when the one before it of its chains is there and its round
 * is open. One that was damaged on the disk is left out, and those that need it wait in the journal until it has been
 * computed again (late.h): the image holds the same.
 */
#ifndef COORDINATOR_JOB_REPLAY_H
#define COORDINATOR_JOB_REPLAY_H

#include "coordinator/job/live_job.h"

#include <stdatomic.h>

/* Of a replay that another thread looks at. */
struct replay_progress {
	_Atomic uint64_t read; /* of the bytes that replay_bytes says */
	atomic_bool stop;      /* it is to end soon, with -ECANCELED */
};
/* How much is read of this job: its journals once, its checkpoint twice. */
uint64_t replay_bytes(const struct spool *spool, uint64_t job);

/* A second and more. By any thread while nobody else has the live job. When it fails (-EBADMSG: something of it is
 * damaged or gone; -EPROTO: of another version) the live job is of no use but to be dropped. p: NULL: nobody looks. */
int replay_films(const struct spool *spool, struct live_job *job, struct replay_progress *p, struct error *e);

/* Whether a result can be merged now. */
enum replay_place { REPLAY_FITS, REPLAY_MERGED /* it is */, REPLAY_LATE /* something is missing before it */ };
enum replay_place replay_place(const struct live_job *job, const struct lease_key *k);

#endif
