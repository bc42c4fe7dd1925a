/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Predicts the cost of a smaller error. Input are the "looks", the estimates of the error that a render so far, or a
 * pilot, has made; results are the work and time at which a render will reach its target (common/estimate/merge.h),
 * with 90 % intervals. Pure, deterministic, no allocation; any thread.
 *
 * Model. x = log(relMSE x work) is a level plus a trend in log(work). The trend is 0 if the error falls as
 * 1/sqrt(work), and positive while rare bursts of light are still to come or chains remember their seeds. A look
 * observes x with the spread of chi-square over its degrees of freedom. Each look contains all samples of the looks
 * before it, so the deviations of two looks correlate by the square root of the ratio of their work. Level and trend
 * are fitted by generalized least squares to the looks of about the last decade of work, the trend with a prior around
 * 0; after the last look the trend decays.
 *
 * Then renders are simulated, each with a level, a trend, a time per sample and a deviation at each look, until the
 * upper end of the interval meets the target. If light is rare, that interval is unknown, and a render of samples goes
 * on until a multiple of the estimate meets the target (stated_error_upper); simulated renders are in such doubt as
 * often as the looks at about the same work, half of which is a lasting property of the render. The results are
 * quantiles of the costs of the simulated renders, and so account for the margin, the schedule of looks and the luck of
 * the stopping rule.
 */
#ifndef COMMON_ESTIMATE_FORECAST_H
#define COMMON_ESTIMATE_FORECAST_H

#include "common/estimate/image.h"

enum { FORECAST_LOOKS_MAX = 64 };

struct forecast_look {
	double work;				/* mutations or samples, in the units of plan_round_mutations */
	double cpu_seconds, seconds;		/* CPU time of leases, wall-clock time; both without the bootstrap */
	double rel_mse, rel_mse_upper, degrees; /* estimate, upper end of its 90 % interval, degrees of freedom */
	uint64_t is_doubtful; /* 1: the interval is not known (enum error_doubt), and no render stops at this look */
};

/* Copies the numbers of a look between this struct and a message, whose members have the same names. */
#define FORECAST_COPY_LOOK(to, from)                                                                          \
	((to)->work = (from)->work, (to)->cpu_seconds = (from)->cpu_seconds, (to)->seconds = (from)->seconds, \
	 (to)->rel_mse = (from)->rel_mse, (to)->rel_mse_upper = (from)->rel_mse_upper,                        \
	 (to)->degrees = (from)->degrees)

struct forecast_history {
	uint32_t count;
	struct forecast_look looks[FORECAST_LOOKS_MAX]; /* by increasing work; if there are too many, the oldest go */
};

/* The median and the ends of a 90 % interval. INFINITY: beyond any simulated render. */
struct forecast_range {
	double low, middle, high;
};

struct forecast_cost {
	struct forecast_range rounds, work, cpu_seconds, seconds; /* without the bootstrap */
};

/* Which render made the looks. */
enum forecast_run {
	FORECAST_SAME, /* the render itself: it continues from the last look */
	FORECAST_NEW,  /* a pilot: the render starts from the beginning, with other random numbers */
};

/* Adds a look, unless it is invalid (no finite error above 0, impossible numbers) or has no more work than the last. */
void forecast_add_look(struct forecast_history *h, const struct forecast_look *l);
/* Adds the look that an image of the render gives after these times. */
void forecast_add_image(struct forecast_history *h, const struct plan *p, const struct canvas_image *img,
			double cpu_seconds, double seconds);
/* Returns the first look at which a render with this target would have stopped; NULL if there is none yet. */
const struct forecast_look *forecast_stopping_look(const struct forecast_history *h, double target);

/* The functions that return bool return false, and store nothing, if there are no looks. */

/* Stores the relative error at the last look. */
bool forecast_current_error(const struct forecast_history *h, struct forecast_range *error);
/* Stores the relative error that the render will have after this much work. */
bool forecast_error_at(const struct forecast_history *h, double work, struct forecast_range *error);
/* Returns the estimate, below the target, at which the render will stop if its error stays in doubt because light is
 * rare (stated_error_rare_stop). 0: it is not in doubt now, or made of chains, whose doubt ends. */
double forecast_stopping_error(const struct forecast_history *h, const struct plan *p, double target);
/* Stores the cost at which a render with the rounds of plan p, whose bounds are ignored, will reach this target. With
 * FORECAST_SAME, simulated renders are in doubt now if the last look is, and the cost includes that of the looks. With
 * FORECAST_NEW, a pilot that went far beyond the target is judged by its looks around the target. */
bool forecast_cost_of_target(const struct forecast_history *h, const struct plan *p, double target,
			     enum forecast_run run, struct forecast_cost *c);
/* Stores the cost of halving the error, counted from the last look, in rounds of plan p. */
bool forecast_cost_of_halving(const struct forecast_history *h, const struct plan *p, struct forecast_cost *c);

#endif
