/* SPDX-License-Identifier: Apache-2.0 */
/* Progress and remaining time of a job. */
#ifndef COORDINATOR_CORE_FORECAST_H
#define COORDINATOR_CORE_FORECAST_H

#include "coordinator/core/job.h"

double job_progress(const struct job *j, double now);
/* s; middle NAN: unknown. idle: nothing is being done for it, and its rate says nothing: only a time may be known. */
struct forecast_range job_eta(const struct job *j, bool idle, double now);
/* Call when the error of the prefix is known. */
void job_note_look(struct job *j, double rel_error, double rel_mse, double degrees, bool doubtful, double cpu_seconds);
void job_forecast(struct job *j); /* recomputes it from its history */
/* Seconds until the error is halved, at the present rate. */
struct forecast_range job_halving_seconds(const struct job *j, double now);

#endif
