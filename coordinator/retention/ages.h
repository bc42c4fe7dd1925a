/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How old finished jobs are, by time that was seen to pass (store/seen.h), which the spool's file `clock` brings from
 * one run to the next. No jump of the wall clock makes anything old. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_AGES_H
#define COORDINATOR_RETENTION_AGES_H

#include "coordinator/job/jobs.h"

/* A file that is gone or damaged begins anew: what has ended is then as young as it can be. Never fails. */
void ages_open(struct jobs *jobs);
double ages_now(const struct jobs *jobs); /* s */
void ages_keep(const struct jobs *jobs);  /* writes it down; a disk that does not take it is tried again next time */

#endif
