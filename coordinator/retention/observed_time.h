/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Observed time (store/age_clock.h), by which the age of finished jobs is measured. A note in the ledger carries it
 * from one run to the next. No jump of the wall clock ages anything. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_OBSERVED_TIME_H
#define COORDINATOR_RETENTION_OBSERVED_TIME_H

#include "coordinator/live_job/jobs.h"

/* Continues observed time from the note. If the note is missing or damaged, observed time starts again, and finished
 * jobs count as new. Never fails. */
void observed_time_open(struct jobs *jobs);
double observed_time_now(const struct jobs *jobs); /* observed time in s */
/* Stores it in the note; if the disk refuses, the next call tries again. */
void observed_time_store(const struct jobs *jobs);

#endif
