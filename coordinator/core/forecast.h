/* SPDX-License-Identifier: Apache-2.0 */
/* Progress and remaining time of a job. */
#ifndef COORDINATOR_CORE_FORECAST_H
#define COORDINATOR_CORE_FORECAST_H

#include "coordinator/core/job.h"

/* In [0,1]; never less than the job's progress_floor. */
double job_progress(const struct job *j, double now);
/* Remaining time in s; `middle` is NAN if unknown. idle: no worker computes the job, so its rate predicts nothing and
 * only a time bound gives an answer. */
struct forecast_range job_eta(const struct job *j, bool idle, double now);
/* Adds an estimate of the error of the complete rounds to the job's history. Call it when the estimate is known. */
void job_note_look(struct job *j, double rel_error, double rel_mse, double degrees, bool doubtful, double cpu_seconds);
void job_update_forecast(struct job *j); /* recomputes target_cost and halving_cost from the history of estimates */
/* Seconds until the error is halved, at the present rate of the job; as last forecast if it has no rate. */
struct forecast_range job_halving_seconds(const struct job *j, double now);

#endif
