/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/accuracy/accuracy_csv.h"

#include "worker/cli/base/text_file.h"

const struct accuracy_column accuracy_columns[] = {
	{"setting", "parameter and value"},
	{"parameter", "parameter that differs from the default"},
	{"value", "value of the parameter"},
	{"role", "default, reference or sweep"},
	{"max_depth", "longest paths, in edges"},
	{"mixture", "strategies and their weights, as --mutations takes them"},
	{"settings", "settings that differ from the renderer's defaults, as --set takes them"},
	{"mutations", "total number of mutations"},
	{"rounds", "rounds in which they were made"},
	{"cpu_seconds", "CPU time of the rounds, without the bootstrap"},
	{"us", "microseconds of CPU time per mutation: median over the rounds"},
	{"us_low", "lower end of its 95 % interval"},
	{"us_high", ""},
	{"acceptance", "share of accepted mutations"},
	{"failed_walks", "share of walks that did not converge or whose reverse walk did not return; empty: no walks"},
	{"rays", "rays per mutation"},
	{"error_mutations", "relative error after as many mutations as the default"},
	{"error_mutations_low", "lower end of its 95 % interval"},
	{"error_mutations_high", ""},
	{"error_time", "relative error after as much CPU time as the default"},
	{"error_time_low", "lower end of its 95 % interval"},
	{"error_time_high", ""},
	{"bias_mean", "the image's mean less the reference's, relative"},
	{"bias_mean_low", "lower end of its 95 % interval"},
	{"bias_mean_high", ""},
	{"bias_block", "the same for the block that differs most significantly"},
	{"bias_block_low", "lower end of its interval, 95 % for all blocks together"},
	{"bias_block_high", ""},
	{"block_x", "column of that block, counted from the left from 0"},
	{"block_y", "row of that block, counted from the top from 0"},
	{"bias_seen", "lower bound of the bias, for all settings and blocks tested together; 0: none was seen"},
	{"bias_bound", "upper bound of the bias, of the mean or of any block"},
	{"front", "1: on the Pareto front; empty: the reference, which is not ranked"},
	{"beaten_by", "the setting that beats it; empty: it is on the front"},
	{0},
};

static void put_number(struct text_file *p, double x)
{
	if (isfinite(x))
		text_file_put(p, ",%.6g", x);
	else
		text_file_put(p, ",");
}

static void put_interval(struct text_file *p, struct interval x)
{
	put_number(p, x.value);
	put_number(p, x.low);
	put_number(p, x.high);
}

static void put_row(struct text_file *p, const struct accuracy_context *x, size_t i)
{
	const struct accuracy_judgement *j = x->judgement;
	const struct accuracy_setting *s = &x->design->settings[i];
	const struct accuracy_figures *f = &j->figures[i];
	char name[96];
	bool reference = i == ACCURACY_REFERENCE, front = f->dominating_index == i;
	accuracy_setting_name(s, name, sizeof name);
	text_file_put_field(p, name);
	text_file_put(p, ",");
	text_file_put_field(p, s->parameter);
	text_file_put(p, ",");
	text_file_put_field(p, s->value);
	text_file_put(p, ",%s,%u,",
		      i == ACCURACY_DEFAULT ? "default"
		      : reference	    ? "reference"
					    : "sweep",
		      s->max_depth);
	text_file_put_field(p, s->mixture);
	text_file_put(p, ",");
	text_file_put_field(p, s->accuracy);
	text_file_put(p, ",%llu,%llu", (unsigned long long)f->mutations, (unsigned long long)f->rounds);
	put_number(p, f->cpu_seconds);
	put_interval(p, f->mutation_us);
	put_number(p, f->acceptance_rate);
	put_number(p, f->failed_walk_share);
	put_number(p, f->rays_per_mutation);
	put_interval(p, f->error_at_equal_mutations);
	put_interval(p, f->error_at_equal_time);
	put_interval(p, f->bias_mean);
	put_interval(p, f->bias_worst_block);
	text_file_put(p, ",%u,%u", f->worst_block_index % j->blocks_across, f->worst_block_index / j->blocks_across);
	put_number(p, f->bias_lower_joint);
	put_number(p, f->bias_upper);
	text_file_put(p, reference ? ",," : ",%d,", front);
	if (!front) {
		accuracy_setting_name(&x->design->settings[f->dominating_index], name, sizeof name);
		text_file_put_field(p, name);
	}
	text_file_put(p, "\n");
}

int accuracy_write_csv(const struct accuracy_context *x, const char *path, struct error *e)
{
	struct text_file p = {.has_failed = false};
	for (size_t i = 0; accuracy_columns[i].name; i++)
		text_file_put(&p, "%s%s", i ? "," : "", accuracy_columns[i].name);
	text_file_put(&p, "\n");
	for (size_t i = 0; i < x->design->count; i++)
		put_row(&p, x, i);
	int rc = text_file_write(&p, path, e);
	text_file_fini(&p);
	return rc;
}
