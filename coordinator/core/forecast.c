/* How far a job is and how long it will take: the bound that looks nearest decides. */
#include "coordinator/core/job.h"

#include <math.h>

static double bootstrap_total(const struct job *j)
{
	return (double)j->plan.bootstrap;
}

static double lease_share(uint64_t merged, double total, const struct job *j)
{
	return (double)merged * total / ((double)j->plan.groups * j->plan.parts);
}

/* Samples and mutations merged. */
static double work_done(const struct job *j)
{
	return lease_share(j->bootstrap_merged, bootstrap_total(j), j) +
	       lease_share(j->leases_merged, (double)plan_round_mutations(&j->plan), j);
}

static double work_of_rounds(const struct job *j, double rounds)
{
	return bootstrap_total(j) + rounds * (double)plan_round_mutations(&j->plan);
}

/* All samples and mutations that the job will need: by the plan, or by the error so far, which falls as 1/sqrt(rounds);
 * more than the two open rounds hold. */
static double work_total(const struct job *j)
{
	double total = INFINITY;
	if (j->plan.rounds != UINT64_MAX)
		total = work_of_rounds(j, (double)j->plan.rounds);
	if (j->plan.target_error > 0 && !isnan(j->rel_error)) {
		double factor = j->rel_error / j->plan.target_error;
		double rounds = fmax((double)j->rel_error_rounds * factor * factor, (double)j->rounds + 2);
		total = fmin(total, work_of_rounds(j, rounds));
	}
	return total;
}

double job_progress(const struct job *j, double now)
{
	if (j->state == JOB_DONE)
		return 1;
	double p = work_done(j) / work_total(j);
	if (j->plan.seconds > 0 && !isnan(j->started) && job_is_live(j))
		p = fmax(p, (now - j->started) / j->plan.seconds);
	return fmin(1, fmax(j->progress_floor, p));
}

double job_eta(const struct job *j, double now)
{
	if (!job_is_live(j))
		return NAN;
	double eta = INFINITY, rate = rate_value(&j->rate, now);
	if (rate > 0)
		eta = fmax(0, work_total(j) - work_done(j)) / rate;
	if (j->plan.seconds > 0 && !isnan(j->started))
		eta = fmin(eta, fmax(0, j->started + j->plan.seconds - now));
	return isfinite(eta) ? eta : NAN;
}
