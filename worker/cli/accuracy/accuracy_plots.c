/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/accuracy/accuracy_plots.h"

#include "common/base/mem.h"
#include "worker/cli/plot/plot.h"

#include <string.h>

static void put_plot(struct text_file *p, const struct plot *plot)
{
	char *svg;
	size_t size;
	struct error e;
	if (plot_svg(plot, &svg, &size, &e)) {
		text_file_put(p, "<p class=\"note\">");
		text_file_put_escaped(p, e.text);
		text_file_put(p, "</p>\n");
		return;
	}
	/* Skips the XML declaration, which is not allowed inside a page. */
	const char *begin = strstr(svg, "<svg");
	if (begin)
		text_file_put_bytes(p, begin, size - (size_t)(begin - svg));
	mem_free(svg);
}

struct points {
	size_t count;
	double x[ACCURACY_SETTINGS_MAX], y[ACCURACY_SETTINGS_MAX], low[ACCURACY_SETTINGS_MAX],
		high[ACCURACY_SETTINGS_MAX];
	char names[ACCURACY_SETTINGS_MAX][96];
	const char *labels[ACCURACY_SETTINGS_MAX];
};

static void add_point(struct points *to, double x, struct interval y)
{
	size_t k = to->count++;
	to->x[k] = x;
	to->y[k] = 100 * y.value;
	to->low[k] = 100 * y.low;
	to->high[k] = 100 * y.high;
}

static struct plot_series make_series(const struct points *p, const char *name)
{
	return (struct plot_series){.name = name,
				    .style = PLOT_POINTS,
				    .count = p->count,
				    .x = p->x,
				    .y = p->y,
				    .low = p->low,
				    .high = p->high};
}

void accuracy_plot_sweep(struct text_file *p, const struct accuracy_context *x, const struct accuracy_sweep *s)
{
	static struct points error, standard, mean, block;
	const char *names[ACCURACY_VALUES_MAX];
	const struct accuracy_judgement *j = x->judgement;
	error.count = standard.count = mean.count = block.count = 0;
	for (size_t k = 0; k < s->count; k++) {
		size_t i = s->setting_indices[k];
		const struct accuracy_figures *f = &j->figures[i];
		double position = (double)k + 1;
		names[k] = s->values[k];
		add_point(i == ACCURACY_DEFAULT ? &standard : &error, position, f->error_at_equal_time);
		add_point(&mean, position - 0.06, f->bias_mean);
		if (j->blocks_across * j->blocks_down > 1)
			add_point(&block, position + 0.06, f->bias_worst_block);
	}
	const struct plot_series errors[2] = {make_series(&error, "sweep"), make_series(&standard, "default")};
	const struct plot_series biases[2] = {make_series(&mean, "mean"), make_series(&block, "worst block")};
	text_file_put(p, "<div class=\"plots\">\n");
	put_plot(p, &(struct plot){.title = "Error at equal time",
				   .x_label = s->parameter,
				   .y_label = "relative error, %",
				   .series_count = 2,
				   .series = errors,
				   .x_names = names,
				   .x_name_count = s->count});
	put_plot(p, &(struct plot){.title = "Bias against the reference",
				   .x_label = s->parameter,
				   .y_label = "bias, %",
				   .series_count = 2,
				   .series = biases,
				   .x_names = names,
				   .x_name_count = s->count});
	text_file_put(p, "</div>\n");
}

void accuracy_plot_front(struct text_file *p, const struct accuracy_context *x)
{
	static struct points kinds[3];
	static const char *const names[3] = {"beaten", "on the front", "default"};
	const struct accuracy_judgement *j = x->judgement;
	struct plot_series s[3];
	for (int k = 0; k < 3; k++)
		kinds[k].count = 0;
	for (size_t i = 0; i < x->design->count; i++) {
		const struct accuracy_figures *f = &j->figures[i];
		if (i == ACCURACY_REFERENCE)
			continue;
		struct points *to = &kinds[i == ACCURACY_DEFAULT ? 2 : f->dominating_index == i ? 1 : 0];
		size_t k = to->count;
		add_point(to, 100 * f->error_at_equal_time.value, f->bias_mean);
		accuracy_setting_name(&x->design->settings[i], to->names[k], sizeof to->names[k]);
		to->labels[k] = i != ACCURACY_DEFAULT && f->bias_lower_joint > 0 ? to->names[k] : "";
	}
	for (int k = 0; k < 3; k++) {
		s[k] = make_series(&kinds[k], names[k]);
		s[k].labels = kinds[k].labels;
	}
	text_file_put(p, "<div class=\"wide\">\n");
	put_plot(p, &(struct plot){.title = "Every setting (named where a bias was seen)",
				   .x_label = "relative error at equal time, %",
				   .y_label = "bias of the mean, %",
				   .is_log_x = true,
				   .series_count = 3,
				   .series = s});
	text_file_put(p, "</div>\n");
}
