/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Prints what a pilot predicts (common/estimate/forecast.h) as a table of errors and their costs, as JSON and as a
 * plot. Each row has the plan of a render with that target, whose rounds are as long as the target makes them. A row
 * that the pilot cannot predict says so instead of giving a number. Fails if the pilot has too few estimates, or if the
 * plot or stdout cannot be written.
 */
#include "worker/cli/render/estimate.h"

#include "common/base/progress.h"
#include "common/json/estimate_json.h"
#include "common/plan/plan_text.h"
#include "worker/cli/plot/plot.h"
#include "worker/cli/render/pilot_request.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>

enum { TARGETS_MAX = 5 };
static const double usual_targets[] = {0.1, 0.05, 0.02, 0.01};

/* One error, and what the render needs for it. */
struct row {
	double target;
	struct plan plan;		     /* of a render with this target: the length of its rounds depends on it */
	const struct forecast_look *reached; /* the estimate of the pilot that has reached it; NULL: none */
	struct forecast_cost cost;	     /* of the render, including its bootstrap */
};

/* The rows of the table. */
struct rows {
	struct row items[TARGETS_MAX];
	size_t count;
};

/* Returns the ratio of the bootstrap samples of a render to those of the pilot. */
static double bootstrap_ratio(const struct estimate *s, const struct plan *render)
{
	return (double)render->bootstrap / (double)s->pilot->bootstrap;
}

static void shift_range(struct forecast_range *r, double more)
{
	r->low += more;
	r->middle += more;
	r->high += more;
}

/* Makes the plan that a render with the row's target gets. */
static int plan_row(const struct estimate *s, struct row *r, struct error *e)
{
	struct plan_request request = *s->request;
	request.target_error = r->target;
	int rc = plan_make(&request, &r->plan, e);
	if (rc || !(s->speed > 0) || !plan_needs_speed(&request, &r->plan))
		return rc;
	request.speed = s->speed;
	return plan_make(&request, &r->plan, e);
}

static int fill_row(const struct estimate *s, struct row *r, struct error *e)
{
	int rc = plan_row(s, r, e);
	if (rc)
		return rc;
	double ratio = bootstrap_ratio(s, &r->plan);
	r->reached = forecast_stopping_look(s->looks, r->target);
	forecast_cost_of_target(s->looks, &r->plan, r->target, FORECAST_NEW, &r->cost);
	shift_range(&r->cost.cpu_seconds, s->bootstrap_cpu_seconds * ratio);
	shift_range(&r->cost.seconds, s->bootstrap_seconds * ratio);
	return 0;
}

static int make_rows(const struct estimate *s, struct rows *rows, struct error *e)
{
	bool given = s->target > 0;
	rows->count = 0;
	for (size_t i = 0; i < sizeof usual_targets / sizeof *usual_targets; i++) {
		if (given && s->target > usual_targets[i])
			rows->items[rows->count++].target = s->target;
		given = given && s->target < usual_targets[i];
		rows->items[rows->count++].target = usual_targets[i];
	}
	if (given)
		rows->items[rows->count++].target = s->target;
	int rc = 0;
	for (size_t i = 0; !rc && i < rows->count; i++)
		rc = fill_row(s, &rows->items[i], e);
	return rc;
}

static int check_estimate_count(const struct estimate *s, struct error *e)
{
	if (s->looks->count >= PILOT_LOOKS_MIN)
		return 0;
	return error_set(
		e, EAGAIN,
		"the pilot has only %u estimate%s of the error, and %d are needed: give it more time (--pilot SECONDS)",
		s->looks->count, s->looks->count == 1 ? "" : "s", PILOT_LOOKS_MIN);
}

/* ---- the table */

static void print_range(FILE *f, const struct forecast_range *r)
{
	char low[32], middle[32], high[32], between[80];
	progress_format_duration(r->low, low, sizeof low);
	progress_format_duration(r->middle, middle, sizeof middle);
	progress_format_duration(r->high, high, sizeof high);
	snprintf(between, sizeof between, "%s - %s", low, high);
	fprintf(f, "  %9s  %-20s", middle, between);
}

static void print_table(const struct estimate *s, const struct rows *rows, FILE *f)
{
	const struct row *row = rows->items;
	char text[64], cpu[64];
	struct forecast_range current;
	forecast_current_error(s->looks, &current);
	progress_format_duration(s->seconds, text, sizeof text);
	progress_format_duration(s->cpu_seconds, cpu, sizeof cpu);
	fprintf(f, "%s: a pilot of %s (%s of CPU time) reached an error of %.3g %% (%.3g - %.3g %%)\n", s->scene, text,
		cpu, 100 * current.middle, 100 * current.low, 100 * current.high);
	fprintf(f, "each with its 90 %% interval; wall-clock time on %s\n", s->machine);
	fprintf(f, "%-8s  %-31s  %-31s\n", "error", "CPU time", "wall clock");
	for (size_t i = 0; i < rows->count; i++) {
		snprintf(text, sizeof text, "%.3g %%", 100 * row[i].target);
		fprintf(f, "%-8s", text);
		print_range(f, &row[i].cost.cpu_seconds);
		print_range(f, &row[i].cost.seconds);
		double doubt = forecast_stopping_error(s->looks, &row[i].plan, row[i].target);
		if (doubt > 0)
			fprintf(f, "  in doubt: stops at %.2g %%", 100 * doubt);
		if (row[i].reached) {
			progress_format_duration(row[i].reached->seconds + s->bootstrap_seconds, text, sizeof text);
			fprintf(f, "  reached after %s by the pilot", text);
		}
		fprintf(f, "\n");
	}
}

/* ---- JSON */

static json_t *reached_to_json(const struct estimate *s, const struct forecast_look *l)
{
	if (!l)
		return json_null();
	return json_pack("{s:f s:f s:f}", "mutations", l->work, "cpuSeconds", l->cpu_seconds + s->bootstrap_cpu_seconds,
			 "wallSeconds", l->seconds + s->bootstrap_seconds);
}

static json_t *targets_to_json(const struct estimate *s, const struct rows *rows)
{
	const struct row *row = rows->items;
	json_t *list = json_array();
	for (size_t i = 0; i < rows->count; i++) {
		double doubt = forecast_stopping_error(s->looks, &row[i].plan, row[i].target);
		json_array_append_new(list, json_pack("{s:f s:o s:o s:o s:o s:o}", "error", row[i].target, "mutations",
						      forecast_range_to_json(&row[i].cost.work), "cpuSeconds",
						      forecast_range_to_json(&row[i].cost.cpu_seconds), "wallSeconds",
						      forecast_range_to_json(&row[i].cost.seconds), "reached",
						      reached_to_json(s, row[i].reached), "stopInDoubt",
						      doubt > 0 ? json_real(doubt) : json_null()));
	}
	return list;
}

static int print_json(const struct estimate *s, const struct rows *rows, FILE *f, struct error *e)
{
	char plan[PLAN_TEXT_MAX];
	struct forecast_range current;
	plan_describe(s->plan, plan, sizeof plan);
	forecast_current_error(s->looks, &current);
	json_t *o = json_pack("{s:i s:s s:s s:s s:s s:o s:{s:f s:f s:f s:f s:o} s:o}", "schema", 1, "type", "estimate",
			      "scene", s->scene, "plan", plan, "where", s->machine, "errorNow",
			      forecast_range_to_json(&current), "pilot", "wallSeconds", s->seconds, "cpuSeconds",
			      s->cpu_seconds, "bootstrapCpuSeconds", s->bootstrap_cpu_seconds, "bootstrapWallSeconds",
			      s->bootstrap_seconds, "looks", forecast_looks_to_json(s->looks), "targets",
			      targets_to_json(s, rows));
	if (!o)
		return error_set(e, ENOMEM, "no memory for the estimate");
	json_dumpf(o, f, JSON_COMPACT);
	fputc('\n', f);
	json_decref(o);
	return 0;
}

/* ---- the plot */

enum { BAND_POINTS = 40 };

struct drawing {
	double x[FORECAST_LOOKS_MAX], y[FORECAST_LOOKS_MAX], low[FORECAST_LOOKS_MAX], high[FORECAST_LOOKS_MAX];
	double band_x[BAND_POINTS], band_y[BAND_POINTS], band_low[BAND_POINTS], band_high[BAND_POINTS];
	double goal_x[TARGETS_MAX][3], goal_y[TARGETS_MAX][3];
	char labels[TARGETS_MAX][96];
	const char *label_refs[TARGETS_MAX][3];
};

static void draw_looks(const struct estimate *s, struct drawing *d)
{
	struct forecast_history prefix = *s->looks;
	for (uint32_t i = 0; i < s->looks->count; i++) {
		struct forecast_range r = {0};
		prefix.count = i + 1;
		forecast_current_error(&prefix, &r);
		d->x[i] = s->looks->looks[i].cpu_seconds + s->bootstrap_cpu_seconds;
		d->y[i] = 100 * r.middle;
		d->low[i] = 100 * r.low;
		d->high[i] = 100 * r.high;
	}
}

/* Computes the band of predicted errors, from the pilot's last estimate to `max_work`, the work for the last target
 * that can be reached. */
static void draw_band(const struct estimate *s, struct drawing *d, double max_work)
{
	const struct forecast_look *l = &s->looks->looks[s->looks->count - 1];
	double growth = log(fmax(max_work / l->work, 2)),
	       bootstrap = s->bootstrap_cpu_seconds * bootstrap_ratio(s, s->plan);
	for (int i = 0; i < BAND_POINTS; i++) {
		struct forecast_range r = {0};
		double work = l->work * exp(growth * i / (BAND_POINTS - 1));
		forecast_error_at(s->looks, work, &r);
		d->band_x[i] = work / l->work * l->cpu_seconds + bootstrap;
		d->band_y[i] = 100 * r.middle;
		d->band_low[i] = 100 * r.low;
		d->band_high[i] = 100 * r.high;
	}
}

static void draw_goal(const struct row *r, struct drawing *d, size_t i)
{
	char text[32];
	const struct forecast_range *c = &r->cost.cpu_seconds;
	progress_format_duration(c->middle, text, sizeof text);
	snprintf(d->labels[i], sizeof d->labels[i], "%.3g %%: %s", 100 * r->target, text);
	double x[3] = {c->low, c->middle, c->high};
	for (int k = 0; k < 3; k++) {
		d->goal_x[i][k] = x[k];
		d->goal_y[i][k] = 100 * r->target;
		d->label_refs[i][k] = k == 0 ? d->labels[i] : "";
	}
}

static int draw_estimate(const struct estimate *s, const struct rows *rows, const char *path, struct error *e)
{
	static struct drawing d;
	const struct row *row = rows->items;
	size_t series = 3;
	double max_work = 0;
	struct plot_series list[3 + TARGETS_MAX] = {
		{.name = "expected (90 %)",
		 .style = PLOT_BAND,
		 .count = BAND_POINTS,
		 .x = d.band_x,
		 .low = d.band_low,
		 .high = d.band_high},
		{.name = "", .style = PLOT_LINE, .count = BAND_POINTS, .x = d.band_x, .y = d.band_y},
		{.name = "pilot",
		 .style = PLOT_POINTS,
		 .count = s->looks->count,
		 .x = d.x,
		 .y = d.y,
		 .low = d.low,
		 .high = d.high},
	};
	for (size_t i = 0; i < rows->count; i++) {
		if (!isfinite(row[i].cost.cpu_seconds.high))
			continue;
		max_work = fmax(max_work, row[i].cost.work.high);
		draw_goal(&row[i], &d, i);
		list[series++] = (struct plot_series){.name = i == 0 ? "stops at its target (90 %)" : "",
						      .style = PLOT_LINE,
						      .count = 3,
						      .x = d.goal_x[i],
						      .y = d.goal_y[i],
						      .labels = d.label_refs[i]};
	}
	draw_looks(s, &d);
	draw_band(s, &d, max_work);
	struct plot p = {.title = s->scene,
			 .x_label = "seconds of CPU time",
			 .y_label = "relative error, %",
			 .is_log_x = true,
			 .is_log_y = true,
			 .series_count = series,
			 .series = list};
	return plot_write(&p, path, e);
}

int estimate_report(const struct estimate *s, bool json, const char *plot, struct error *e)
{
	struct rows rows;
	int rc = check_estimate_count(s, e);
	if (!rc)
		rc = make_rows(s, &rows, e);
	if (!rc && json)
		rc = print_json(s, &rows, stdout, e);
	else if (!rc)
		print_table(s, &rows, stdout);
	return !rc && plot ? draw_estimate(s, &rows, plot, e) : rc;
}
