/* SPDX-License-Identifier: Apache-2.0 */
/*
 * fit() fits a level, a trend and their uncertainty to the estimates of the error so far (looks) by generalized least
 * squares; forecast.h explains the model. scenario_of() draws a possible render from that fit, and simulate() lets it
 * run until it would stop; this is repeated PLAYS times, and summarise_costs() takes the quantiles of the costs. The
 * random numbers have constant seeds, so equal looks give equal forecasts everywhere.
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
	PLAYS = 1024,	  /* simulated renders */
	PRIOR_WEIGHT = 6, /* the spread that looks report counts like the scatter of so many looks */
	STEPS_MOST = 256, /* looks of a simulated render; 2^60 rounds have fewer */
	TRIES_MOST = 64,
};
static const double used_share = 1.0 / 16; /* looks at less than this share of the work say little about the future */
static const double burst = 0.15;	   /* spread of a look in addition to chi-square: rare bursts of light */
static const double trend_prior =
	0.2; /* prior standard deviation of the trend: rare bursts of light, and chains that remember their seeds */
static const double memory = 2,
		    memory_sd = 0.8;	/* e-folds of work over which a trend decays; the spread of its logarithm */
static const double drift = 0.08;	/* standard deviation of unforeseen changes of x per e-fold of work */
static const double price_floor = 0.03; /* least relative spread of the time per sample over time */
static const double price_other =
	0.08; /* the same from one render to another: leases of other lengths cost up to 6 % more or less per sample */
static const double near = 4; /* looks at up to so many times the work that a target takes tell what it takes */
static const double log_four = 1.3862943611198906;

/* ---- looks */

#define WORK_MOST 0x1p63 /* plans count work in 64 bits */

void forecast_add_look(struct forecast_history *h, const struct forecast_look *l)
{
	bool sound =
		isfinite(l->rel_mse) && l->rel_mse > 0 && isfinite(l->rel_mse_upper) && l->rel_mse_upper >= l->rel_mse;
	bool counted = l->work < WORK_MOST && isfinite(l->cpu_seconds) && isfinite(l->seconds) && isfinite(l->degrees);
	if (!sound || !counted || !(l->work > (h->count ? h->looks[h->count - 1].work : 0)))
		return;
	if (h->count == FORECAST_LOOKS)
		memmove(h->looks, h->looks + 1, --h->count * sizeof *h->looks);
	h->looks[h->count++] = *l;
}

void forecast_add(struct forecast_history *h, const struct plan *p, const struct canvas_image *img, double cpu_seconds,
		  double seconds)
{
	bool doubtful;
	double upper = stated_error_upper(img, &doubtful);
	struct forecast_look l = {.work = (double)img->rounds * (double)plan_round_mutations(p),
				  .cpu_seconds = cpu_seconds,
				  .seconds = seconds,
				  .rel_mse = img->rel_mse,
				  .rel_mse_upper = upper * upper,
				  .degrees = img->rel_mse_degrees > 0 ? img->rel_mse_degrees : p->groups - 1.0,
				  .doubtful = doubtful};
	forecast_add_look(h, &l);
}

static const struct forecast_look *last_look(const struct forecast_history *h)
{
	return h->count ? &h->looks[h->count - 1] : NULL;
}

const struct forecast_look *forecast_reached(const struct forecast_history *h, double target)
{
	for (uint32_t i = 0; i < h->count; i++)
		if (!h->looks[i].doubtful && sqrt(h->looks[i].rel_mse_upper) <= target)
			return &h->looks[i];
	return NULL;
}

/* Returns a quantile of chi-square divided by its degrees of freedom (Wilson and Hilferty 1931); z: the quantile of the
 * normal distribution for the same probability. */
static double chi_square_share(double degrees, double z)
{
	double s = 2 / (9 * degrees), root = 1 - s + z * sqrt(s);
	return root > 0 ? root * root * root : 0;
}

bool forecast_error(const struct forecast_history *h, struct forecast_range *error)
{
	const struct forecast_look *l = last_look(h);
	if (!l)
		return false;
	*error = (struct forecast_range){sqrt(l->rel_mse / chi_square_share(l->degrees, 1.6448536269514722)),
					 sqrt(l->rel_mse), sqrt(l->rel_mse_upper)};
	return true;
}

/* ---- the fit */

struct fit {
	double work;	     /* work at the last look; t below is log(work / this) */
	double level, trend; /* log(relMSE x work) at the last look, and its growth per e-fold of work */
	double level_sd, trend_sd, correlation; /* uncertainty of level and trend */
	double spread, shift;			/* standard deviation and mean of a look's logarithm around the fit */
	double seen;			   /* e-folds of work covered by the looks; limits the trend into the past */
	double now;			   /* deviation of the last look, in units of spread */
	double margin, margin_sd;	   /* log(upper end / estimate) of looks whose interval is known */
	double doubt;			   /* probability that a look's error is in doubt, from the last look on */
	const struct forecast_history *h;  /* the looks; before the last, the probability is theirs */
	double cpu, cpu_sd, wall, wall_sd; /* seconds per sample, and their relative spread */
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
	double al, at, value, share;
};

static struct innovation innovation_of(const struct forecast_look *l, const struct forecast_look *before,
				       const struct fit *f)
{
	double t = log(l->work / f->work), x = log(l->rel_mse * l->work) - f->shift;
	if (!before)
		return (struct innovation){1, t, x, 1};
	double r = before->work / l->work;
	double t0 = log(before->work / f->work), x0 = log(before->rel_mse * before->work) - f->shift;
	return (struct innovation){1 - r, t - r * t0, x - r * x0, 1 - r * r};
}

/* Fits level, trend and spread to the looks of h from `first` on. */
static void fit_level(struct fit *f, const struct forecast_history *h, uint32_t first)
{
	struct normal_equations q = {0};
	double variance = f->spread * f->spread;
	add_observation(&q, variance / (trend_prior * trend_prior), 0, 1, 0);
	for (uint32_t i = first; i < h->count; i++) {
		struct innovation v = innovation_of(&h->looks[i], i > first ? &h->looks[i - 1] : NULL, f);
		add_observation(&q, 1 / v.share, v.al, v.at, v.value);
	}
	double det = q.ll * q.tt - q.lt * q.lt; /* > 0, because of the prior and the first look */
	f->level = (q.l * q.tt - q.t * q.lt) / det;
	f->trend = (q.ll * q.t - q.lt * q.l) / det;
	double square = 0;
	for (uint32_t i = first; i < h->count; i++) {
		struct innovation v = innovation_of(&h->looks[i], i > first ? &h->looks[i - 1] : NULL, f);
		double d = v.value - v.al * f->level - v.at * f->trend;
		square += d * d / v.share;
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
	return l->doubtful ? 0 : stated_error_rare_factor(sqrt(l->rel_mse), sqrt(l->rel_mse_upper));
}

static bool in_doubt(const struct forecast_look *l)
{
	return l->doubtful || rare_factor(l) > 0;
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
	f->margin = n > 0 ? sum / n : -log(chi_square_share(fmax(last_look(h)->degrees, 1), -1.6448536269514722));
	f->margin_sd = n > 1 ? sqrt(fmax(0, square - n * f->margin * f->margin) / (n - 1)) : f->margin / 2;
}

/* Estimates the share of looks in doubt, with Jeffreys' prior: half a look in doubt and half a look that is not. */
static void fit_doubt(struct fit *f, const struct forecast_history *h, uint32_t first)
{
	double sum = 0.5, n = 1;
	for (uint32_t i = first; i < h->count; i++) {
		sum += in_doubt(&h->looks[i]);
		n++;
	}
	f->doubt = sum / n;
}

static double seconds_spent(const struct forecast_look *l, bool wall)
{
	return wall ? l->seconds : l->cpu_seconds;
}

/* Computes the seconds per sample, and how much they vary between looks, since machines are shared. */
static void fit_price(const struct forecast_history *h, bool wall, double least, double *price, double *sd)
{
	const struct forecast_look *end = last_look(h);
	double square = 0, before = 0, work = 0;
	*price = seconds_spent(end, wall) / end->work;
	for (uint32_t i = 0; i < h->count; i++) {
		const struct forecast_look *l = &h->looks[i];
		double d = (seconds_spent(l, wall) - before) / (l->work - work) / *price - 1;
		square += (l->work - work) / end->work * d * d;
		before = seconds_spent(l, wall);
		work = l->work;
	}
	*sd = *price > 0 ? sqrt(square + least * least) : 0;
}

static struct fit fit(const struct forecast_history *h)
{
	const struct forecast_look *end = last_look(h);
	uint32_t first = 0;
	while (h->looks[first].work < used_share * end->work)
		first++;
	double d = fmax(end->degrees, 1);
	/* Spread and shift of the logarithm of chi-square over its degrees; the spread includes bursts of light. */
	struct fit f = {.work = end->work,
			.h = h,
			.spread = sqrt(2 / d + 2 / (d * d) + burst * burst),
			.shift = -1 / d - 1 / (3 * d * d)};
	f.seen = log(end->work / h->looks[first].work);
	fit_level(&f, h, first);
	f.now = (log(end->rel_mse * end->work) - f.shift - f.level) / f.spread;
	fit_margin(&f, h, first);
	fit_doubt(&f, h, first);
	fit_price(h, false, price_floor, &f.cpu, &f.cpu_sd);
	fit_price(h, true, price_floor, &f.wall, &f.wall_sd);
	return f;
}

/* Fits a new render to a pilot that may have gone far beyond the target: how often its error is in doubt, the margin
 * and the trend are then taken from the looks around the work at which the pilot reached the target, since these change
 * as samples find the rare light. Times per sample are taken from all looks. *around: the looks used. */
static struct fit fit_new(const struct forecast_history *h, double target, struct forecast_history *around)
{
	const struct forecast_look *reached = forecast_reached(h, target);
	*around = *h;
	while (reached && last_look(around)->work > near * reached->work)
		around->count--;
	struct fit f = fit(around);
	fit_price(h, false, price_other, &f.cpu, &f.cpu_sd);
	fit_price(h, true, price_other, &f.wall, &f.wall_sd);
	return f;
}

/* ---- simulated renders */

struct dice {
	uint64_t state;
};

static double uniform(struct dice *d) /* splitmix64 (Steele, Lea, Flood 2014) */
{
	uint64_t z = d->state += UINT64_C(0x9e3779b97f4a7c15);
	z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
	return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}

static double normal(struct dice *d)
{
	double r = sqrt(-2 * log(uniform(d)));
	return r * cos(6.283185307179586 * uniform(d));
}

/* One possible render. Members are as in struct fit, drawn from their distributions. */
struct scenario {
	double level, trend, memory, drift, margin, now, cpu, wall;
	double rare; /* standard normal: how rare the light of the scene is */
	double seen; /* standard normal: the luck of the current look, which changes like its deviation */
};

static struct scenario scenario_of(const struct fit *f, struct dice *d)
{
	double a = normal(d), b = normal(d);
	double trend = f->trend + f->trend_sd * a;
	double level =
		f->level + f->level_sd * (f->correlation * a + sqrt(fmax(0, 1 - f->correlation * f->correlation)) * b);
	struct scenario y = {.level = level, .trend = trend, .now = f->now + (f->level - level) / f->spread};
	/* Separate statements, because C does not define the order in which an initializer is evaluated. */
	y.margin = fmax(0, f->margin + f->margin_sd * normal(d));
	y.memory = memory * exp(memory_sd * normal(d));
	y.drift = drift * normal(d);
	y.cpu = f->cpu * exp(f->cpu_sd * normal(d));
	y.wall = f->wall * exp(f->wall_sd * normal(d));
	y.rare = normal(d);
	y.seen = normal(d);
	return y;
}

/* Returns the probability that a look after this much work is in doubt: the share of the looks at about that work, and
 * for no looks the share at the end. */
static double doubt_at(const struct fit *f, double work)
{
	double sum = f->doubt, n = 1, at = fmax(work, f->h->looks[0].work);
	for (uint32_t i = 0; at < f->work && i < f->h->count; i++) {
		const struct forecast_look *l = &f->h->looks[i];
		if (l->work < 0.5 * at || l->work > 2 * at)
			continue;
		sum += in_doubt(l);
		n++;
	}
	return sum / n;
}

/* Returns whether the look after this much work is in doubt. Of the variance that decides this, half (`rare`) stays the
 * same for a render, and half (`seen`) changes as fast as the deviations of looks. */
static bool is_in_doubt(const struct fit *f, const struct scenario *y, double work)
{
	return 0.5 * erfc(0.5 * (y->rare + y->seen)) < doubt_at(f, work);
}

/* Draws `rare` and `seen` again until the scenario's current look is in doubt exactly if the render's last look is. */
static void condition_on_doubt(const struct fit *f, struct scenario *y, bool doubt, struct dice *d)
{
	for (int i = 0; i < TRIES_MOST && is_in_doubt(f, y, f->work) != doubt; i++) {
		y->rare = normal(d);
		y->seen = normal(d);
	}
}

/* Returns the expected change of log(relMSE x work) over t e-folds of work after the last look. */
static double expected_change(const struct fit *f, const struct scenario *y, double t)
{
	if (t < 0)
		return y->trend * fmax(-f->seen, t);
	return y->trend * y->memory * (1 - exp(-t / y->memory)) + y->drift * t;
}

/* Returns the expected log(relMSE) after this much work. */
static double expected_log_mse(const struct fit *f, const struct scenario *y, double work)
{
	return y->level + expected_change(f, y, log(work / f->work)) - log(work);
}

/* Simulates a render and returns the number of rounds at which it stops. rare_stop: the estimate at which a render in
 * doubt stops; 0: renders are never in doubt. */
static double simulate(const struct fit *f, struct scenario *y, const struct plan *p, double target, double rare_stop,
		       enum forecast_run run, struct dice *d)
{
	double round = (double)plan_round_mutations(p);
	double before = run == FORECAST_SAME ? f->work : 0, deviation = run == FORECAST_SAME ? y->now : 0;
	uint64_t rounds = (uint64_t)fmin(before / round + 0.5, 0x1p62);
	for (int i = 0; i < STEPS_MOST; i++) {
		rounds = merge_error_next(p, rounds);
		double work = (double)rounds * round, r = before / work, news = sqrt(fmax(0, 1 - r * r));
		deviation = r * deviation + news * normal(d);
		before = work;
		double estimate = expected_log_mse(f, y, work) + f->shift + f->spread * deviation;
		if (rare_stop > 0)
			y->seen = r * y->seen + news * normal(d);
		if (rare_stop > 0 && is_in_doubt(f, y, work) ? estimate <= 2 * log(rare_stop)
							     : estimate + y->margin <= 2 * log(target))
			return (double)rounds;
		if (rounds >= UINT64_MAX / 4)
			break;
	}
	return INFINITY;
}

static struct forecast_range range_of(double *x)
{
	qsort(x, PLAYS, sizeof *x, double_compare);
	return (struct forecast_range){x[PLAYS / 20], x[PLAYS / 2], x[PLAYS - 1 - PLAYS / 20]};
}

bool forecast_error_at(const struct forecast_history *h, double work, struct forecast_range *error)
{
	if (!h->count)
		return false;
	struct fit f = fit(h);
	struct dice d = {3};
	double x[PLAYS];
	for (int i = 0; i < PLAYS; i++) {
		struct scenario y = scenario_of(&f, &d);
		x[i] = exp(0.5 * expected_log_mse(&f, &y, work));
	}
	*error = range_of(x);
	return true;
}

struct plays {
	double rounds[PLAYS], work[PLAYS], cpu[PLAYS], wall[PLAYS];
};

static void summarise_costs(struct plays *s, struct forecast_cost *c)
{
	c->rounds = range_of(s->rounds);
	c->work = range_of(s->work);
	c->cpu_seconds = range_of(s->cpu);
	c->seconds = range_of(s->wall);
}

/* Returns the estimate at which a render in doubt stops, by the rule that the latest look in such doubt shows; 0 for
 * renders of chains, which do not stop in doubt. */
static double rare_stop_of(const struct forecast_history *h, const struct plan *p, double target)
{
	double factor = 0;
	if (p->kind != PLAN_SAMPLES || !(target > 0))
		return 0;
	for (uint32_t i = h->count; i > 0 && !(factor > 0); i--)
		factor = rare_factor(&h->looks[i - 1]);
	return stated_error_rare_stop(target, factor);
}

double forecast_stop_in_doubt(const struct forecast_history *h, const struct plan *p, double target)
{
	return h->count && in_doubt(last_look(h)) ? rare_stop_of(h, p, target) : 0;
}

bool forecast_target(const struct forecast_history *h, const struct plan *p, double target, enum forecast_run run,
		     struct forecast_cost *c)
{
	const struct forecast_look *end = last_look(h);
	if (!end)
		return false;
	bool same = run == FORECAST_SAME;
	struct forecast_history around;
	struct fit f = same ? fit(h) : fit_new(h, target, &around);
	struct dice d = {1};
	struct plays s;
	double round = (double)plan_round_mutations(p);
	double rare_stop = rare_stop_of(same ? h : &around, p, target);
	for (int i = 0; i < PLAYS; i++) {
		struct scenario y = scenario_of(&f, &d);
		if (same)
			condition_on_doubt(&f, &y, in_doubt(end), &d);
		s.rounds[i] = simulate(&f, &y, p, target, rare_stop, run, &d);
		s.work[i] = s.rounds[i] * round;
		double more = s.work[i] - (same ? end->work : 0);
		s.cpu[i] = (same ? end->cpu_seconds : 0) + more * y.cpu;
		s.wall[i] = (same ? end->seconds : 0) + more * y.wall;
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

bool forecast_halving(const struct forecast_history *h, const struct plan *p, struct forecast_cost *c)
{
	if (!h->count)
		return false;
	struct fit f = fit(h);
	struct dice d = {2};
	struct plays s;
	for (int i = 0; i < PLAYS; i++) {
		struct scenario y = scenario_of(&f, &d);
		s.work[i] = f.work * (exp(work_to_quarter(&f, &y)) - 1);
		s.rounds[i] = s.work[i] / (double)plan_round_mutations(p);
		s.cpu[i] = s.work[i] * y.cpu;
		s.wall[i] = s.work[i] * y.wall;
	}
	summarise_costs(&s, c);
	return true;
}
