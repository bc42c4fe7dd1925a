/* SPDX-License-Identifier: Apache-2.0 */
/* Progress and remaining time of a job. The bound that seems to come first determines both. */
#include "coordinator/core/forecast.h"

#include "common/estimate/merge.h"

#include <math.h>

static double bootstrap_work(const struct job *j)
{
	return (double)j->plan.bootstrap;
}

static double work_of_leases(uint64_t merged, double total, const struct job *j)
{
	return (double)merged * total / ((double)j->plan.groups * j->plan.parts);
}

/* Bootstrap samples and mutations merged so far. */
static double done_work(const struct job *j)
{
	return work_of_leases(j->bootstrap_merged, bootstrap_work(j), j) +
	       work_of_leases(j->leases_merged, (double)plan_round_mutations(&j->plan), j);
}

static double rounds_work(const struct job *j, double rounds)
{
	return bootstrap_work(j) + rounds * (double)plan_round_mutations(&j->plan);
}

/* Returns the rounds that the target error needs if only the last error is known, without a history: it is assumed to
 * fall as 1/sqrt(rounds). */
static double rounds_by_sqrt_rule(const struct job *j)
{
	double factor = j->rel_error / j->plan.target_error;
	return (double)j->rel_error_rounds * factor * factor;
}

/* Returns how many samples and mutations the job will need in total, according to its plan or to the error so far. An
 * error-based estimate is at least the two open rounds more than what is complete. */
static struct forecast_range total_work(const struct job *j)
{
	struct forecast_range total = {INFINITY, INFINITY, INFINITY};
	if (j->plan.rounds != UINT64_MAX)
		total.low = total.middle = total.high = rounds_work(j, (double)j->plan.rounds);
	if (!(j->plan.target_error > 0) || isnan(j->rel_error))
		return total;
	double min_rounds = (double)j->rounds + 2, rule = rounds_by_sqrt_rule(j);
	struct forecast_range rounds = {rule, rule, rule};
	if (j->looks.count)
		rounds = j->target_cost.rounds;
	total.low = fmin(total.low, rounds_work(j, fmax(rounds.low, min_rounds)));
	total.middle = fmin(total.middle, rounds_work(j, fmax(rounds.middle, min_rounds)));
	total.high = fmin(total.high, rounds_work(j, fmax(rounds.high, min_rounds)));
	return total;
}

static bool has_time_bound(const struct job *j)
{
	return j->plan.seconds > 0 && !isnan(j->started_at);
}

/* Returns the seconds until the job's time bound ends it; NAN if the time is over and the rate of the round that has
 * to be completed is unknown. */
static double seconds_to_time_bound(const struct job *j, double rate, double now)
{
	double round = (double)plan_round_mutations(&j->plan);
	return merge_seconds_remaining(&j->plan, job_elapsed(j, now), (done_work(j) - bootstrap_work(j)) / round,
				       rate / round);
}

double job_progress(const struct job *j, double now)
{
	if (j->state == JOB_DONE)
		return 1;
	double p = done_work(j) / total_work(j).middle;
	if (has_time_bound(j) && job_is_live(j)) /* elapsed time never decreases, unlike an estimate from a rate */
		p = fmax(p, fmin(0.99, job_elapsed(j, now) / j->plan.seconds));
	return fmin(1, fmax(j->progress_floor, p));
}

/* Returns the seconds until `total` samples and mutations are merged, or until the job's time is over; NAN: unknown.
 * The rate of the bootstrap is not used to predict that of rounds, because the bootstrap of `path` is so short that
 * its leases mostly wait. */
static double remaining_seconds(const struct job *j, double total, bool idle, double now)
{
	double remaining = INFINITY, rate = idle || !j->leases_merged ? 0 : rate_value(&j->rate, now);
	if (rate > 0)
		remaining = fmax(0, total - done_work(j)) / rate;
	if (has_time_bound(j))
		remaining = fmin(remaining, seconds_to_time_bound(j, rate, now)); /* fmin ignores a NAN */
	return isfinite(remaining) ? remaining : NAN;
}

struct forecast_range job_eta(const struct job *j, bool idle, double now)
{
	if (!job_is_live(j) || job_is_held(j))
		return (struct forecast_range){NAN, NAN, NAN};
	struct forecast_range total = total_work(j);
	return (struct forecast_range){remaining_seconds(j, total.low, idle, now),
				       remaining_seconds(j, total.middle, idle, now),
				       remaining_seconds(j, total.high, idle, now)};
}

void job_note_look(struct job *j, double rel_error, double rel_mse, double degrees, bool doubtful, double cpu_seconds)
{
	/* Some leases are merged ahead of the complete rounds; their CPU time is spent, but they are not in the image
	 * yet. */
	double prefix_fraction = (double)j->rounds * j->slot_count / (double)(j->leases_merged ? j->leases_merged : 1);
	struct forecast_look l = {.work = (double)j->rounds * (double)plan_round_mutations(&j->plan),
				  .cpu_seconds = cpu_seconds * prefix_fraction,
				  .seconds = j->estimate_requested_at - j->first_round_at,
				  .rel_mse = rel_mse,
				  .rel_mse_upper = rel_error * rel_error,
				  .degrees = degrees > 0 ? degrees : j->plan.groups - 1.0,
				  .is_doubtful = doubtful};
	uint32_t count = j->looks.count;
	forecast_add_look(&j->looks, &l);
	if (!j->looks.count || (count == j->looks.count && count < FORECAST_LOOKS_MAX))
		return;
	job_update_forecast(j);
}

void job_update_forecast(struct job *j)
{
	forecast_cost_of_target(&j->looks, &j->plan, j->plan.target_error, FORECAST_SAME, &j->target_cost);
	forecast_cost_of_halving(&j->looks, &j->plan, &j->halving_cost);
}

struct forecast_range job_halving_seconds(const struct job *j, double now)
{
	double rate = rate_value(&j->rate, now);
	const struct forecast_range *work = &j->halving_cost.work;
	if (!job_is_live(j) || !(rate > 0))
		return j->halving_cost.seconds;
	return (struct forecast_range){work->low / rate, work->middle / rate, work->high / rate};
}
