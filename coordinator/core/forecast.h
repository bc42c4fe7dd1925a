/* SPDX-License-Identifier: Apache-2.0 */
/* How far a job is and how long it will take. */
#ifndef COORDINATOR_CORE_FORECAST_H
#define COORDINATOR_CORE_FORECAST_H

#include "coordinator/core/job.h"

double job_progress(const struct job *j, double now);
/* s; middle NAN: unknown. */
struct forecast_range job_eta(const struct job *j, double now);
/* The error of the prefix is known. */
void job_note_look(struct job *j, double rel_error, double rel_mse, double degrees, bool doubtful, double cpu_seconds);
void job_forecast(struct job *j); /* anew, from its looks */
/* Seconds until the error is half of what it is, at the present rate. */
struct forecast_range job_halving_seconds(const struct job *j, double now);

#endif
