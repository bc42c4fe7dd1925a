/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads what was merged of a job from its checkpoint and journal into a live job, with the code for live batches, so
 * the bits are the same. A result counts if its predecessor in its chains is present and its round is open. A damaged
 * result is skipped, and those that depend on it wait in the journal until it has been computed again (late.h): the
 * image is the same.
 */
#ifndef COORDINATOR_LIVE_JOB_REPLAY_H
#define COORDINATOR_LIVE_JOB_REPLAY_H

#include "coordinator/live_job/live_job.h"

#include <stdatomic.h>

/* A replay that another thread watches. */
struct replay_progress {
	_Atomic uint64_t read; /* bytes read: journals once, the checkpoint twice */
	atomic_bool stop;      /* stop soon, with -ECANCELED */
};

/* Takes a second or more. Any thread that owns the live job. On failure (-EBADMSG: something is damaged or missing;
 * -EPROTO: another version) the live job can only be dropped. p: NULL: nobody watches. */
int replay_films(const struct spool *spool, struct live_job *job, struct replay_progress *p, struct error *e);

/* Whether a result can be merged now. */
enum replay_place { REPLAY_FITS, REPLAY_MERGED /* yes */, REPLAY_LATE /* an earlier result is missing */ };
enum replay_place replay_place(const struct live_job *job, const struct lease_key *k);

#endif
