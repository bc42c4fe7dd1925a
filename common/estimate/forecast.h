/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a smaller error will cost: from the looks at the error of a render so far, or of a pilot, the work and the time
 * at which a render will stop by its target (common/estimate/merge.h), with 90 % intervals. Pure, deterministic, no
 * allocation; any thread.
 *
 * Model. x = log(relMSE x work) is a level, plus a trend in log(work): 0 where the error falls as 1/sqrt(work), above 0
 * where light comes in rare bursts that a short render has not met, or where chains have not forgotten their seeds.
 * What is seen of it is an estimate with the spread of chi-square over the degrees of freedom; since each look holds
 * all samples of those before it, the deviations of two looks correlate as the root of the ratio of their works. Level
 * and trend are fitted by generalized least squares to the looks of the last decade or so, the trend with a prior
 * around 0; from the last look on it dies down. Renders are then played: a level, a trend, the price of a sample, and
 * along the ladder of looks the deviations, until the upper end of the estimate's interval meets the target. The
 * quantiles of what they cost are the answer, so that margin, ladder and luck of the rule are in it.
 */
#ifndef COMMON_ESTIMATE_FORECAST_H
#define COMMON_ESTIMATE_FORECAST_H

#include "common/estimate/image.h"

enum { FORECAST_LOOKS = 64 };

struct forecast_look {
	double work;		     /* mutations or samples, as plan_round_mutations counts */
	double cpu_seconds, seconds; /* of leases, of the wall clock; the bootstrap apart */
	double rel_mse, rel_mse_upper, degrees;
	uint64_t doubtful; /* 1: the interval is not known (enum error_doubt), and no render ends by this look */
};

struct forecast_history {
	uint32_t count;
	struct forecast_look looks[FORECAST_LOOKS]; /* work grows; the first ones go when there are too many */
};

struct forecast_range { /* median, and the ends of a 90 % interval; INFINITY: beyond what can be counted */
	double low, middle, high;
};

struct forecast_cost {
	struct forecast_range rounds, work, cpu_seconds, seconds; /* from the first round on */
};

/* Whose looks they are. */
enum forecast_run {
	FORECAST_SAME, /* the render's own: it goes on from the last look */
	FORECAST_NEW,  /* a pilot's: the render starts anew, with other random numbers */
};

/* A look that is none (no finite error above 0, numbers that no render has), or of no more work than the last, is
 * passed over. */
void forecast_add_look(struct forecast_history *h, const struct forecast_look *l);
/* What an image says after these seconds. */
void forecast_add(struct forecast_history *h, const struct plan *p, const struct canvas_image *img, double cpu_seconds,
		  double seconds);
/* The first look that would have ended a render; NULL: none yet. */
const struct forecast_look *forecast_reached(const struct forecast_history *h, double target);
/* Relative error at the last look. false: nothing is known, as below. */
bool forecast_error(const struct forecast_history *h, struct forecast_range *error);
/* Of a render that has done so much work. */
bool forecast_error_at(const struct forecast_history *h, double work, struct forecast_range *error);
/* When a render of plan p (its rounds; its bounds are not looked at) will stop by this target. */
bool forecast_target(const struct forecast_history *h, const struct plan *p, double target, enum forecast_run run,
		     struct forecast_cost *c);
/* What it costs beyond the last look to halve the error; rounds are those of p. */
bool forecast_halving(const struct forecast_history *h, const struct plan *p, struct forecast_cost *c);

#endif
