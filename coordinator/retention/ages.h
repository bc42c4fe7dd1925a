/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The age of finished jobs, in observed time (store/age_clock.h), which a note in the ledger carries from one run to
 * the next. A jump of the wall clock ages nothing. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_AGES_H
#define COORDINATOR_RETENTION_AGES_H

#include "coordinator/live_job/jobs.h"

/* If the note is missing or damaged, observed time starts again: finished jobs then count as new. Never fails. */
void ages_open(struct jobs *jobs);
double ages_now(const struct jobs *jobs); /* s */
void ages_keep(const struct jobs *jobs);  /* stores it; if the disk refuses, the next call tries again */

#endif
