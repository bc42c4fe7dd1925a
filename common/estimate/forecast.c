/* SPDX-License-Identifier: Apache-2.0 */
/*
 * fit_looks() fits a level, a trend and their uncertainty to the estimates of the error so far (looks) by generalized
 * least squares; forecast.h explains the model. draw_scenario() draws a possible render from that fit, and
 * simulate_render() lets it run until it would stop; this is repeated SIMULATIONS times, and summarise_costs() takes
 * the quantiles of the costs. The random numbers have constant seeds, so equal looks give equal forecasts everywhere.
 *
 * Without looks there is no forecast (the functions return false). The cost of a simulated render that never stops is
 * INFINITY.
 */
#include "common/estimate/forecast.h"

#include "common/base/list.h"
#include "common/estimate/merge.h"
#include "common/estimate/stated_error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
	SIMULATIONS = 1024, /* simulated renders */
	PRIOR_WEIGHT = 6,   /* the spread that looks report counts like the scatter of so many looks */
	STEPS_MAX = 256,    /* looks of a simulated render; 2^60 rounds have fewer */
	TRIES_MAX = 64,
};
/* Looks at less than this share of the work say little about the future. */
static const double min_work_share = 1.0 / 16;
static const double burst_sd = 0.15; /* spread of a look in addition to chi-square: rare bursts of light */
/* Prior standard deviation of the trend: rare bursts of light, and chains that remember their seeds. */
static const double trend_prior_sd = 0.2;
/* E-folds of work over which a trend decays; the spread of its logarithm. */
static const double trend_decay_length = 2, trend_decay_length_sd = 0.8;
static const double drift_sd = 0.08;	       /* standard deviation of unforeseen changes of x per e-fold of work */
static const double min_sample_time_sd = 0.03; /* least relative spread of the time per sample over time */
/* The same from one render to another: leases of other lengths cost up to 6 % more or less per sample. */
static const double other_render_sample_time_sd = 0.08;
/* Looks at up to so many times the work that a target takes tell what it takes. */
static const double max_work_ratio = 4;
static const double log_four = 1.3862943611198906;

/* ---- looks */

#define WORK_MAX 0x1p63 /* plans count work in 64 bits */

void forecast_add_look(struct forecast_history *h, const struct forecast_look *l)
{
	bool sound =
		isfinite(l->rel_mse) && l->rel_mse > 0 && isfinite(l->rel_mse_upper) && l->rel_mse_upper >= l->rel_mse;
	bool counted = l->work < WORK_MAX && isfinite(l->cpu_seconds) && isfinite(l->seconds) && isfinite(l->degrees);
	if (!sound || !counted || !(l->work > (h->count ? h->looks[h->count - 1].work : 0)))
		return;
	if (h->count == FORECAST_LOOKS_MAX)
		memmove(h->looks, h->looks + 1, --h->count * sizeof *h->looks);
	h->looks[h->count++] = *l;
}

void forecast_add_image(struct forecast_history *h, const struct plan *p, const struct canvas_image *img,
			double cpu_seconds, double seconds)
{
	bool doubtful;
	double upper = stated_error_upper(img, &doubtful);
	struct forecast_look l = {.work = (double)img->rounds * (double)plan_round_mutations(p),
				  .cpu_seconds = cpu_seconds,
				  .seconds = seconds,
				  .rel_mse = img->rel_mse,
				  .rel_mse_upper = upper * upper,
				  .degrees = img->rel_mse_degrees > 0 ? img->rel_mse_degrees : p->groups - 1.0,
				  .is_doubtful = doubtful};
	forecast_add_look(h, &l);
}

static const struct forecast_look *last_look(const struct forecast_history *h)
{
	return h->count ? &h->looks[h->count - 1] : NULL;
}

const struct forecast_look *forecast_stopping_look(const struct forecast_history *h, double target)
{
	for (uint32_t i = 0; i < h->count; i++)
		if (!h->looks[i].is_doubtful && sqrt(h->looks[i].rel_mse_upper) <= target)
			return &h->looks[i];
	return NULL;
}

/* Returns a quantile of chi-square divided by its degrees of freedom (Wilson and Hilferty 1931); z: the quantile of the
 * normal distribution for the same probability. */
static double scaled_chi_square_quantile(double degrees, double z)
{
	double s = 2 / (9 * degrees), root = 1 - s + z * sqrt(s);
	return root > 0 ? root * root * root : 0;
}

bool forecast_current_error(const struct forecast_history *h, struct forecast_range *error)
{
	const struct forecast_look *l = last_look(h);
	if (!l)
		return false;
	*error = (struct forecast_range){sqrt(l->rel_mse / scaled_chi_square_quantile(l->degrees, 1.6448536269514722)),
					 sqrt(l->rel_mse), sqrt(l->rel_mse_upper)};
	return true;
}

/* ---- the fit */

struct fit {
	double work;	     /* work at the last look; t below is log(work / this) */
	double level, trend; /* log(relMSE x work) at the last look, and its growth per e-fold of work */
	double level_sd, trend_sd, correlation; /* uncertainty of level and trend */
	double spread, spread_mean;		/* standard deviation and mean of a look's logarithm around the fit */
	double covered_efolds;	  /* e-folds of work covered by the looks; limits the trend into the past */
	double last_deviation;	  /* deviation of the last look, in units of spread */
	double margin, margin_sd; /* log(upper end / estimate) of looks whose interval is known */
	double doubt_probability; /* probability that a look's error is in doubt, from the last look on */
	const struct forecast_history *history; /* the looks; before the last, the probability is theirs */
	double cpu_per_sample, cpu_sd, wall_per_sample, wall_sd; /* seconds per sample, and their relative spread */
};

/* The normal equations of level (l) and trend (t). */
struct normal_equations {
	double ll, lt, tt, l, t;
};

static void add_observation(struct normal_equations *q, double weight, double al, double at, double value)
{
	q->ll += weight * al * al;
	q->lt += weight * al * at;
	q->tt += weight * at * at;
	q->l += weight * al * value;
	q->t += weight * at * value;
}

/* The part of a look that is independent of the look before: value = al * level + at * trend + noise, where the noise
 * has the variance share * spread^2. */
struct innovation {
	double level_weight, trend_weight, value, variance_share;
};

static struct innovation compute_innovation(const struct forecast_look *l, const struct forecast_look *previous,
					    const struct fit *f)
{
	double t = log(l->work / f->work), x = log(l->rel_mse * l->work) - f->spread_mean;
	if (!previous)
		return (struct innovation){1, t, x, 1};
	double r = previous->work / l->work;
	double t0 = log(previous->work / f->work), x0 = log(previous->rel_mse * previous->work) - f->spread_mean;
	return (struct innovation){1 - r, t - r * t0, x - r * x0, 1 - r * r};
}

/* Fits level, trend and spread to the looks of h from `first` on. */
static void fit_level(struct fit *f, const struct forecast_history *h, uint32_t first)
{
	struct normal_equations q = {0};
	double variance = f->spread * f->spread;
	add_observation(&q, variance / (trend_prior_sd * trend_prior_sd), 0, 1, 0);
	for (uint32_t i = first; i < h->count; i++) {
		struct innovation v = compute_innovation(&h->looks[i], i > first ? &h->looks[i - 1] : NULL, f);
		add_observation(&q, 1 / v.variance_share, v.level_weight, v.trend_weight, v.value);
	}
	double det = q.ll * q.tt - q.lt * q.lt; /* > 0, because of the prior and the first look */
	f->level = (q.l * q.tt - q.t * q.lt) / det;
	f->trend = (q.ll * q.t - q.lt * q.l) / det;
	double square = 0;
	for (uint32_t i = first; i < h->count; i++) {
		struct innovation v = compute_innovation(&h->looks[i], i > first ? &h->looks[i - 1] : NULL, f);
		double d = v.value - v.level_weight * f->level - v.trend_weight * f->trend;
		square += d * d / v.variance_share;
	}
	/* With rare bursts of light, looks scatter more than by chi-square. */
	variance = (PRIOR_WEIGHT * variance + square) / (PRIOR_WEIGHT + (double)(h->count - first) - 1);
	f->spread = sqrt(variance);
	f->level_sd = sqrt(variance * q.tt / det);
	f->trend_sd = sqrt(variance * q.ll / det);
	f->correlation = -q.lt / sqrt(q.ll * q.tt);
}

static double rare_factor(const struct forecast_look *l)
{
	return l->is_doubtful ? 0 : stated_error_rare_factor(sqrt(l->rel_mse), sqrt(l->rel_mse_upper));
}

static bool look_is_in_doubt(const struct forecast_look *l)
{
	return l->is_doubtful || rare_factor(l) > 0;
}

/* Fits the margin to the looks of h from `first` on, except those whose upper end is only a multiple of the estimate.
 * If there are no others, the margin is that of chi-square. */
static void fit_margin(struct fit *f, const struct forecast_history *h, uint32_t first)
{
	double sum = 0, square = 0, n = 0;
	for (uint32_t i = first; i < h->count; i++) {
		if (rare_factor(&h->looks[i]) > 0)
			continue;
		double margin = log(h->looks[i].rel_mse_upper / h->looks[i].rel_mse);
		sum += margin;
		square += margin * margin;
		n++;
	}
	f->margin =
		n > 0 ? sum / n : -log(scaled_chi_square_quantile(fmax(last_look(h)->degrees, 1), -1.6448536269514722));
	f->margin_sd = n > 1 ? sqrt(fmax(0, square - n * f->margin * f->margin) / (n - 1)) : f->margin / 2;
}

/* Estimates the share of looks in doubt, with Jeffreys' prior: half a look in doubt and half a look that is not. */
static void fit_doubt(struct fit *f, const struct forecast_history *h, uint32_t first)
{
	double sum = 0.5, n = 1;
	for (uint32_t i = first; i < h->count; i++) {
		sum += look_is_in_doubt(&h->looks[i]);
		n++;
	}
	f->doubt_probability = sum / n;
}

static double look_seconds(const struct forecast_look *l, bool wall)
{
	return wall ? l->seconds : l->cpu_seconds;
}

/* Computes the seconds per sample, and how much they vary between looks, since machines are shared. */
static void fit_seconds_per_sample(const struct forecast_history *h, bool wall, double min_sd, double *price,
				   double *sd)
{
	const struct forecast_look *end = last_look(h);
	double square = 0, previous_seconds = 0, work = 0;
	*price = look_seconds(end, wall) / end->work;
	for (uint32_t i = 0; i < h->count; i++) {
		const struct forecast_look *l = &h->looks[i];
		double d = (look_seconds(l, wall) - previous_seconds) / (l->work - work) / *price - 1;
		square += (l->work - work) / end->work * d * d;
		previous_seconds = look_seconds(l, wall);
		work = l->work;
	}
	*sd = *price > 0 ? sqrt(square + min_sd * min_sd) : 0;
}

static struct fit fit_looks(const struct forecast_history *h)
{
	const struct forecast_look *end = last_look(h);
	uint32_t first = 0;
	while (h->looks[first].work < min_work_share * end->work)
		first++;
	double d = fmax(end->degrees, 1);
	/* Spread and shift of the logarithm of chi-square over its degrees; the spread includes bursts of light. */
	struct fit f = {.work = end->work,
			.history = h,
			.spread = sqrt(2 / d + 2 / (d * d) + burst_sd * burst_sd),
			.spread_mean = -1 / d - 1 / (3 * d * d)};
	f.covered_efolds = log(end->work / h->looks[first].work);
	fit_level(&f, h, first);
	f.last_deviation = (log(end->rel_mse * end->work) - f.spread_mean - f.level) / f.spread;
	fit_margin(&f, h, first);
	fit_doubt(&f, h, first);
	fit_seconds_per_sample(h, false, min_sample_time_sd, &f.cpu_per_sample, &f.cpu_sd);
	fit_seconds_per_sample(h, true, min_sample_time_sd, &f.wall_per_sample, &f.wall_sd);
	return f;
}

/* Fits a new render to a pilot that may have gone far beyond the target: how often its error is in doubt, the margin
 * and the trend are then taken from the looks around the work at which the pilot reached the target, since these change
 * as samples find the rare light. Times per sample are taken from all looks. *around: the looks used. */
static struct fit fit_new_render(const struct forecast_history *h, double target, struct forecast_history *around)
{
	const struct forecast_look *reached = forecast_stopping_look(h, target);
	*around = *h;
	while (reached && last_look(around)->work > max_work_ratio * reached->work)
		around->count--;
	struct fit f = fit_looks(around);
	fit_seconds_per_sample(h, false, other_render_sample_time_sd, &f.cpu_per_sample, &f.cpu_sd);
	fit_seconds_per_sample(h, true, other_render_sample_time_sd, &f.wall_per_sample, &f.wall_sd);
	return f;
}

/* ---- simulated renders */

struct random_state {
	uint64_t state;
};

static double draw_uniform(struct random_state *d) /* splitmix64 (Steele, Lea, Flood 2014) */
{
	uint64_t z = d->state += UINT64_C(0x9e3779b97f4a7c15);
	z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
	return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}

static double draw_normal(struct random_state *d)
{
	double r = sqrt(-2 * log(draw_uniform(d)));
	return r * cos(6.283185307179586 * draw_uniform(d));
}

/* One possible render. Members are as in struct fit, drawn from their distributions. */
struct scenario {
	double level, trend, trend_decay_length, drift, margin, last_deviation, cpu_per_sample, wall_per_sample;
	double lasting_deviate; /* standard normal: how rare the light of the scene is */
	double look_deviate;	/* standard normal: the luck of the current look, which changes like its deviation */
};

static struct scenario draw_scenario(const struct fit *f, struct random_state *d)
{
	double a = draw_normal(d), b = draw_normal(d);
	double trend = f->trend + f->trend_sd * a;
	double level =
		f->level + f->level_sd * (f->correlation * a + sqrt(fmax(0, 1 - f->correlation * f->correlation)) * b);
	struct scenario y = {
		.level = level, .trend = trend, .last_deviation = f->last_deviation + (f->level - level) / f->spread};
	/* Separate statements, because C does not define the order in which an initializer is evaluated. */
	y.margin = fmax(0, f->margin + f->margin_sd * draw_normal(d));
	y.trend_decay_length = trend_decay_length * exp(trend_decay_length_sd * draw_normal(d));
	y.drift = drift_sd * draw_normal(d);
	y.cpu_per_sample = f->cpu_per_sample * exp(f->cpu_sd * draw_normal(d));
	y.wall_per_sample = f->wall_per_sample * exp(f->wall_sd * draw_normal(d));
	y.lasting_deviate = draw_normal(d);
	y.look_deviate = draw_normal(d);
	return y;
}

/* Returns the probability that a look after this much work is in doubt: the share of the looks at about that work, and
 * for no looks the share at the end. */
static double doubt_probability_at(const struct fit *f, double work)
{
	double sum = f->doubt_probability, n = 1, reference_work = fmax(work, f->history->looks[0].work);
	for (uint32_t i = 0; reference_work < f->work && i < f->history->count; i++) {
		const struct forecast_look *l = &f->history->looks[i];
		if (l->work < 0.5 * reference_work || l->work > 2 * reference_work)
			continue;
		sum += look_is_in_doubt(l);
		n++;
	}
	return sum / n;
}

/* Returns whether the look after this much work is in doubt. Of the variance that decides this, half
 * (`lasting_deviate`) stays the same for a render, and half (`look_deviate`) changes as fast as the deviations of
 * looks. */
static bool scenario_is_in_doubt(const struct fit *f, const struct scenario *y, double work)
{
	return 0.5 * erfc(0.5 * (y->lasting_deviate + y->look_deviate)) < doubt_probability_at(f, work);
}

/* Draws `lasting_deviate` and `look_deviate` again until the scenario's current look is in doubt exactly if the
 * render's last look is. */
static void condition_on_doubt(const struct fit *f, struct scenario *y, bool doubt, struct random_state *d)
{
	for (int i = 0; i < TRIES_MAX && scenario_is_in_doubt(f, y, f->work) != doubt; i++) {
		y->lasting_deviate = draw_normal(d);
		y->look_deviate = draw_normal(d);
	}
}

/* Returns the expected change of log(relMSE x work) over t e-folds of work after the last look. */
static double expected_change(const struct fit *f, const struct scenario *y, double t)
{
	if (t < 0)
		return y->trend * fmax(-f->covered_efolds, t);
	return y->trend * y->trend_decay_length * (1 - exp(-t / y->trend_decay_length)) + y->drift * t;
}

/* Returns the expected log(relMSE) after this much work. */
static double expected_log_mse(const struct fit *f, const struct scenario *y, double work)
{
	return y->level + expected_change(f, y, log(work / f->work)) - log(work);
}

/* Simulates a render and returns the number of rounds at which it stops. rare_stop: the estimate at which a render in
 * doubt stops; 0: renders are never in doubt. */
static double simulate_render(const struct fit *f, struct scenario *y, const struct plan *p, double target,
			      double rare_stop, enum forecast_run run, struct random_state *d)
{
	double round = (double)plan_round_mutations(p);
	double previous_work = run == FORECAST_SAME ? f->work : 0,
	       deviation = run == FORECAST_SAME ? y->last_deviation : 0;
	uint64_t rounds = (uint64_t)fmin(previous_work / round + 0.5, 0x1p62);
	for (int i = 0; i < STEPS_MAX; i++) {
		rounds = merge_next_error_rounds(p, rounds);
		double work = (double)rounds * round, r = previous_work / work,
		       innovation_weight = sqrt(fmax(0, 1 - r * r));
		deviation = r * deviation + innovation_weight * draw_normal(d);
		previous_work = work;
		double estimate = expected_log_mse(f, y, work) + f->spread_mean + f->spread * deviation;
		if (rare_stop > 0)
			y->look_deviate = r * y->look_deviate + innovation_weight * draw_normal(d);
		if (rare_stop > 0 && scenario_is_in_doubt(f, y, work) ? estimate <= 2 * log(rare_stop)
								      : estimate + y->margin <= 2 * log(target))
			return (double)rounds;
		if (rounds >= UINT64_MAX / 4)
			break;
	}
	return INFINITY;
}

static struct forecast_range quantile_range(double *x)
{
	qsort(x, SIMULATIONS, sizeof *x, compare_doubles);
	return (struct forecast_range){x[SIMULATIONS / 20], x[SIMULATIONS / 2], x[SIMULATIONS - 1 - SIMULATIONS / 20]};
}

bool forecast_error_at(const struct forecast_history *h, double work, struct forecast_range *error)
{
	if (!h->count)
		return false;
	struct fit f = fit_looks(h);
	struct random_state d = {3};
	double x[SIMULATIONS];
	for (int i = 0; i < SIMULATIONS; i++) {
		struct scenario y = draw_scenario(&f, &d);
		x[i] = exp(0.5 * expected_log_mse(&f, &y, work));
	}
	*error = quantile_range(x);
	return true;
}

struct simulated_costs {
	double rounds[SIMULATIONS], work[SIMULATIONS], cpu[SIMULATIONS], wall[SIMULATIONS];
};

static void summarise_costs(struct simulated_costs *s, struct forecast_cost *c)
{
	c->rounds = quantile_range(s->rounds);
	c->work = quantile_range(s->work);
	c->cpu_seconds = quantile_range(s->cpu);
	c->seconds = quantile_range(s->wall);
}

/* Returns the estimate at which a render in doubt stops, by the rule that the latest look in such doubt shows; 0 for
 * renders of chains, which do not stop in doubt. */
static double rare_stop_estimate(const struct forecast_history *h, const struct plan *p, double target)
{
	double factor = 0;
	if (p->kind != PLAN_SAMPLES || !(target > 0))
		return 0;
	for (uint32_t i = h->count; i > 0 && !(factor > 0); i--)
		factor = rare_factor(&h->looks[i - 1]);
	return stated_error_rare_stop(target, factor);
}

double forecast_stopping_error(const struct forecast_history *h, const struct plan *p, double target)
{
	return h->count && look_is_in_doubt(last_look(h)) ? rare_stop_estimate(h, p, target) : 0;
}

bool forecast_cost_of_target(const struct forecast_history *h, const struct plan *p, double target,
			     enum forecast_run run, struct forecast_cost *c)
{
	const struct forecast_look *end = last_look(h);
	if (!end)
		return false;
	bool same = run == FORECAST_SAME;
	struct forecast_history around;
	struct fit f = same ? fit_looks(h) : fit_new_render(h, target, &around);
	struct random_state d = {1};
	struct simulated_costs s;
	double round = (double)plan_round_mutations(p);
	double rare_stop = rare_stop_estimate(same ? h : &around, p, target);
	for (int i = 0; i < SIMULATIONS; i++) {
		struct scenario y = draw_scenario(&f, &d);
		if (same)
			condition_on_doubt(&f, &y, look_is_in_doubt(end), &d);
		s.rounds[i] = simulate_render(&f, &y, p, target, rare_stop, run, &d);
		s.work[i] = s.rounds[i] * round;
		double remaining_work = s.work[i] - (same ? end->work : 0);
		s.cpu[i] = (same ? end->cpu_seconds : 0) + remaining_work * y.cpu_per_sample;
		s.wall[i] = (same ? end->seconds : 0) + remaining_work * y.wall_per_sample;
	}
	summarise_costs(&s, c);
	return true;
}

/* Returns the e-folds of work after which relMSE is a quarter; INFINITY if more than 15. */
static double work_to_quarter(const struct fit *f, const struct scenario *y)
{
	double low = 0, high = 16;
	for (int i = 0; i < 40; i++) {
		double t = 0.5 * (low + high);
		*(t - expected_change(f, y, t) < log_four ? &low : &high) = t;
	}
	return high < 15 ? high : INFINITY;
}

bool forecast_cost_of_halving(const struct forecast_history *h, const struct plan *p, struct forecast_cost *c)
{
	if (!h->count)
		return false;
	struct fit f = fit_looks(h);
	struct random_state d = {2};
	struct simulated_costs s;
	for (int i = 0; i < SIMULATIONS; i++) {
		struct scenario y = draw_scenario(&f, &d);
		s.work[i] = f.work * (exp(work_to_quarter(&f, &y)) - 1);
		s.rounds[i] = s.work[i] / (double)plan_round_mutations(p);
		s.cpu[i] = s.work[i] * y.cpu_per_sample;
		s.wall[i] = s.work[i] * y.wall_per_sample;
	}
	summarise_costs(&s, c);
	return true;
}
