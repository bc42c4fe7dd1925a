/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Observed time (store/age_clock.h), by which the age of finished jobs is measured. A note in the ledger carries it
 * from one run to the next. No jump of the wall clock ages anything. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_AGES_H
#define COORDINATOR_RETENTION_AGES_H

#include "coordinator/live_job/jobs.h"

/* Continues observed time from the note. If the note is missing or damaged, observed time starts again, and finished
 * jobs count as new. Never fails. */
void ages_open(struct jobs *jobs);
double ages_now(const struct jobs *jobs); /* observed time in s */
void ages_keep(const struct jobs *jobs);  /* stores it in the note; if the disk refuses, the next call tries again */

#endif
