/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Predicts what a smaller error will cost: from the estimates of the error ("looks") of a render so far, or of a pilot,
 * the work and time at which a render will reach its target (common/estimate/merge.h), with 90 % intervals. Pure,
 * deterministic, no allocation; any thread.
 *
 * Model. x = log(relMSE x work) is a level plus a trend in log(work): 0 if the error falls as 1/sqrt(work), positive if
 * light comes in rare bursts that a short render has not met, or while chains remember their seeds. A look observes x
 * with the spread of chi-square over its degrees of freedom. Each look contains all samples of those before it, so the
 * deviations of two looks correlate by the root of the ratio of their work. Level and trend are fitted by generalized
 * least squares to the looks of about the last decade, the trend with a prior around 0; after the last look it decays.
 * Then renders are simulated: a level, a trend, the time per sample, and a deviation at each look, until the upper end
 * of the interval meets the target. Samples whose light is rare leave that interval unknown, and a render then goes on
 * until a multiple of the estimate meets the target (stated_error_upper): simulated renders are in doubt as often as
 * the looks, half of it for good. The quantiles of their costs are the result, which therefore includes the margin, the
 * schedule of looks and the luck of the stopping rule.
 */
#ifndef COMMON_ESTIMATE_FORECAST_H
#define COMMON_ESTIMATE_FORECAST_H

#include "common/estimate/image.h"

enum { FORECAST_LOOKS = 64 };

struct forecast_look {
	double work;		     /* mutations or samples, in the units of plan_round_mutations */
	double cpu_seconds, seconds; /* CPU time of leases, wall-clock time; both without the bootstrap */
	double rel_mse, rel_mse_upper, degrees;
	uint64_t doubtful; /* 1: the interval is not known (enum error_doubt), and no render stops at this look */
};

/* The numbers of one, from this struct to a message or back: their members have the same names. */
#define FORECAST_COPY_LOOK(to, from)                                                                          \
	((to)->work = (from)->work, (to)->cpu_seconds = (from)->cpu_seconds, (to)->seconds = (from)->seconds, \
	 (to)->rel_mse = (from)->rel_mse, (to)->rel_mse_upper = (from)->rel_mse_upper,                        \
	 (to)->degrees = (from)->degrees)

struct forecast_history {
	uint32_t count;
	struct forecast_look
		looks[FORECAST_LOOKS]; /* ordered by work; the oldest are dropped when there are too many */
};

struct forecast_range { /* median, and the ends of a 90 % interval; INFINITY: beyond what can be represented */
	double low, middle, high;
};

struct forecast_cost {
	struct forecast_range rounds, work, cpu_seconds, seconds; /* from the first round on */
};

/* Whose looks they are. */
enum forecast_run {
	FORECAST_SAME, /* the render's own: it continues from the last look */
	FORECAST_NEW,  /* a pilot's: the render starts over, with other random numbers */
};

/* Ignores a look that is invalid (no finite error above 0, impossible numbers) or has no more work than the last. */
void forecast_add_look(struct forecast_history *h, const struct forecast_look *l);
/* The look that an image gives after these seconds. */
void forecast_add(struct forecast_history *h, const struct plan *p, const struct canvas_image *img, double cpu_seconds,
		  double seconds);
/* The first look at which a render would have stopped; NULL: none yet. */
const struct forecast_look *forecast_reached(const struct forecast_history *h, double target);
/* Relative error at the last look. false: not known, as below. */
bool forecast_error(const struct forecast_history *h, struct forecast_range *error);
/* The error of a render after this much work. */
bool forecast_error_at(const struct forecast_history *h, double work, struct forecast_range *error);
/* The estimate at which the render of these looks will stop because its error is in doubt and may stay so: below the
 * target (stated_error_rare_stop). 0: it is not in doubt, or made of chains, whose doubt ends. */
double forecast_stop_in_doubt(const struct forecast_history *h, const struct plan *p, double target);
/* When a render of plan p (its rounds; its bounds are ignored) will reach this target. The looks of the same render
 * also tell whether it is in doubt now. */
bool forecast_target(const struct forecast_history *h, const struct plan *p, double target, enum forecast_run run,
		     struct forecast_cost *c);
/* The cost of halving the error, counted from the last look; rounds are those of p. */
bool forecast_halving(const struct forecast_history *h, const struct plan *p, struct forecast_cost *c);

#endif
