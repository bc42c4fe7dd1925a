/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/plot/plot_axis.h"

#include <math.h>

static bool is_plottable(double value, bool log_axis)
{
	return isfinite(value) && (!log_axis || value > 0);
}

bool plot_point_is_shown(const struct plot *p, const struct plot_series *s, size_t i)
{
	if (!is_plottable(s->x[i], p->is_log_x))
		return false;
	if (s->style == PLOT_BAND)
		return s->low && s->high && isfinite(s->low[i]) && is_plottable(s->high[i], p->is_log_y);
	return is_plottable(s->y[i], p->is_log_y);
}

static void extend_axis(struct plot_axis *a, const double *value, size_t i)
{
	if (!value || !is_plottable(value[i], a->is_log))
		return;
	a->min = fmin(a->min, value[i]);
	a->max = fmax(a->max, value[i]);
}

static void add_tic(struct plot_axis *a, double value)
{
	if (value >= a->min * (1 - 1e-9) && value <= a->max * (1 + 1e-9) && a->tic_count < PLOT_TICS_MAX)
		a->tics[a->tic_count++] = value;
}

/* Returns 1, 2 or 5 times a power of 10, such that about five such steps fill the range. */
static double round_step(double range)
{
	double step = pow(10, floor(log10(range / 5)));
	return range / step > 20 ? 5 * step : range / step > 8 ? 2 * step : step;
}

static void place_tics(struct plot_axis *a)
{
	static const double few[] = {1}, some[] = {1, 2, 5}, many[] = {1, 1.5, 2, 3, 4, 5, 7};
	double decades = log10(a->max / a->min);
	if (decades < 0.35) {
		double step = round_step(a->max - a->min);
		for (double k = ceil(a->min / step); k * step <= a->max && a->tic_count < PLOT_TICS_MAX; k++)
			add_tic(a, k * step);
		return;
	}
	const double *set = decades > 3 ? few : decades > 1 ? some : many;
	int count = decades > 3 ? 1 : decades > 1 ? 3 : 7, stride = 1 + (int)(decades / 10);
	for (int k = (int)floor(log10(a->min)); k <= (int)ceil(log10(a->max)); k++)
		for (int i = 0; i < count && k % stride == 0; i++)
			add_tic(a, set[i] * pow(10, k));
}

/* Adds a margin around the points. An axis of amounts begins at 0 if that costs little space, so that heights can be
 * compared. */
static void widen_axis(struct plot_axis *a, bool amounts)
{
	if (a->is_log) {
		double factor = pow(a->max / a->min, 0.06);
		factor = factor > 1.02 ? factor : 1.3;
		a->min /= factor;
		a->max *= factor;
		place_tics(a);
		return;
	}
	double margin = 0.06 * (a->max - a->min);
	if (!(margin > 0))
		margin = a->max != 0 ? 0.3 * fabs(a->max) : 1;
	bool from_zero = a->min >= 0 && (amounts ? a->min < 0.6 * a->max : a->min < margin);
	a->min = from_zero ? 0 : a->min - margin;
	a->max += margin;
}

bool plot_axes(const struct plot *p, struct plot_axis *x, struct plot_axis *y)
{
	*x = (struct plot_axis){.min = INFINITY, .max = -INFINITY, .is_log = p->is_log_x};
	*y = (struct plot_axis){.min = INFINITY, .max = -INFINITY, .is_log = p->is_log_y};
	for (size_t k = 0; k < p->series_count; k++) {
		const struct plot_series *s = &p->series[k];
		for (size_t i = 0; i < s->count; i++) {
			if (!plot_point_is_shown(p, s, i))
				continue;
			extend_axis(x, s->x, i);
			extend_axis(y, s->style == PLOT_BAND ? NULL : s->y, i);
			extend_axis(y, s->low, i);
			extend_axis(y, s->high, i);
		}
	}
	if (!(x->min <= x->max && y->min <= y->max))
		return false;
	widen_axis(x, false);
	widen_axis(y, true);
	return true;
}
