/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's checkpoint (jobs/jN/checkpoint): films, seeds, chain states and the rest of a live job, so that its journal
 * can begin anew. Written when the journal is longer than the limit and than the last checkpoint, so that disk and
 * bytes written stay within a small multiple of the films. Order of steps: an empty journal G + 1; the checkpoint under
 * a temporary name, which says that G + 1 follows it; its rename; only then does journal G go. Wherever the machine
 * stops, one checkpoint and its journal are whole. Writing runs in the pool while the live job is busy; the rest on the
 * loop's thread.
 */
#ifndef COORDINATOR_JOBS_CHECKPOINT_H
#define COORDINATOR_JOBS_CHECKPOINT_H

#include "coordinator/job/jobs.h"

/* Starts one for each order whose journal is long enough. Not while an update is carried out. */
void checkpoint_where_due(struct jobs *jobs);

#endif
