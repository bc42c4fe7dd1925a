/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads a job's merged results from its checkpoint and journal into a live job, with the code that merges results of
 * workers, so the bits are the same. A result is merged if the previous epoch of its chains is merged and its round
 * is open. A damaged result is skipped, and later results that depend on it wait in the journal until it has been
 * computed again (late_results.h); the image is the same.
 */
#ifndef COORDINATOR_LIVE_JOB_REPLAY_H
#define COORDINATOR_LIVE_JOB_REPLAY_H

#include "coordinator/live_job/live_job.h"

#include <stdatomic.h>

/* Progress of a replay, for another thread to watch. */
struct replay_progress {
	_Atomic uint64_t bytes_read; /* journals are read once, the checkpoint twice */
	atomic_bool stop_requested;  /* set by the watching thread: stop soon, with -ECANCELED */
};

/* Takes a second or more. p: NULL: nobody watches. Any thread that owns the live job. After a failure (-EBADMSG:
 * something is damaged or missing; -EPROTO: another version; -ECANCELED) the live job can only be dropped. */
int replay_films(const struct spool *spool, struct live_job *job, struct replay_progress *p, struct error *e);

/* Says whether a result can be merged now. */
enum replay_readiness {
	REPLAY_READY,  /* it can be merged now */
	REPLAY_MERGED, /* it is merged already */
	REPLAY_LATE    /* it cannot be merged yet: an earlier result is missing */
};
enum replay_readiness replay_readiness(const struct live_job *job, const struct lease_key *k);

#endif
