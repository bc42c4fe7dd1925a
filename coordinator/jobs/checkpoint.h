/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's checkpoint (jobs/jN/checkpoint): films, seeds, chain states and the rest of a live job, so that its journal
 * can start over. It is written when the journal is longer than the limit and than the last checkpoint, so the disk
 * space and the bytes written stay within a small multiple of the films. The steps: create an empty journal G + 1;
 * write the checkpoint, which refers to G + 1, under a temporary name; rename it; only then delete journal G.
 * Wherever the machine stops, one checkpoint and its journal are complete. The pool writes while the live job is
 * busy; everything else runs on the loop's thread.
 */
#ifndef COORDINATOR_JOBS_CHECKPOINT_H
#define COORDINATOR_JOBS_CHECKPOINT_H

#include "coordinator/live_job/jobs.h"

/* Starts a checkpoint for the first job that needs one. Does nothing while an update is being carried out. */
void checkpoint_start_due(struct jobs *jobs);

#endif
