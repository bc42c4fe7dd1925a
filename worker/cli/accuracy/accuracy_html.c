/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Writes the report as one HTML page without scripts: a summary, the image, facts about machine and scene, tables with
 * intervals, and plots as SVG (accuracy_plots.h). All text from scenes is escaped. An unknown number is printed as a
 * dash, never as 0.
 *
 * Fails, and writes no page, if memory is out or the file cannot be written.
 */
#include "worker/cli/accuracy/accuracy_html.h"

#include "common/base/mem.h"
#include "common/base/version.h"
#include "common/plan/plan_text.h"
#include "worker/cli/accuracy/accuracy_csv.h"
#include "worker/cli/accuracy/accuracy_plots.h"
#include "worker/cli/image/tonemap.h"
#include "worker/render/fingerprint.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

static const char style[] =
	"body{font:16px/1.5 system-ui,'DejaVu Sans',Helvetica,Arial,sans-serif;color:#222;background:#fff;"
	"max-width:62em;margin:2em auto;padding:0 1em}"
	"h1,h2,h3{line-height:1.2;font-weight:600}"
	"h2{margin-top:2.2em;border-bottom:1px solid #ccc}"
	"table{border-collapse:collapse;margin:1em 0;font-size:14px}"
	"th,td{padding:.25em .7em;text-align:right;border-bottom:1px solid #e4e4e4}"
	"th{background:#f4f4f4;vertical-align:bottom}"
	"td.t,th.t{text-align:left}tr.front{background:#e8f3fa}"
	"tr.default td.t{font-weight:600}td.seen{color:#b04a00}"
	".note{color:#555}.plots svg{max-width:49%;height:auto}"
	".wide svg{max-width:100%;height:auto}"
	"img{image-rendering:auto;max-width:100%;border:1px solid #ccc}"
	".answer{background:#f4f4f4;padding:.6em 1em;border-left:4px solid #0072b2}"
	"code{font-size:13px;overflow-wrap:anywhere}";

static void put_paragraph(struct text_file *p, const char *text)
{
	text_file_put(p, "<p>");
	text_file_put_escaped(p, text);
	text_file_put(p, "</p>\n");
}

/* Appends a cell such as "12.3 (11.9 to 12.8)", in percent. sign: print + or -; is_significant: mark it so. */
static void put_interval_cell(struct text_file *p, struct interval x, bool sign, bool is_significant)
{
	if (!isfinite(x.value))
		text_file_put(p, "<td>&#8211;</td>");
	else
		text_file_put(p,
			      sign ? "<td%s>%+.3g <span class=\"note\">(%+.3g to %+.3g)</span></td>"
				   : "<td%s>%.3g <span class=\"note\">(%.3g to %.3g)</span></td>",
			      is_significant ? " class=\"seen\"" : "", 100 * x.value, 100 * x.low, 100 * x.high);
}

static void put_failed_walks_cell(struct text_file *p, const struct accuracy_figures *f)
{
	if (isfinite(f->failed_walk_share))
		text_file_put(p, "<td>%.3g</td>", 100 * f->failed_walk_share);
	else
		text_file_put(p, "<td>&#8211;</td>");
}

static void put_name_cell(struct text_file *p, const struct accuracy_context *x, size_t i)
{
	char name[96];
	accuracy_setting_name(&x->design->settings[i], name, sizeof name);
	text_file_put(p, "<td class=\"t\">");
	text_file_put_escaped(p, name);
	text_file_put(p, "</td>");
}

static void begin_row(struct text_file *p, const struct accuracy_context *x, size_t i)
{
	bool front = x->judgement->figures[i].dominating_index == i && i != ACCURACY_REFERENCE;
	text_file_put(p, "<tr class=\"%s%s\">", front ? "front " : "", i == ACCURACY_DEFAULT ? "default" : "");
}

/* Appends the summary: how the default compares with the others. */
static void put_verdict(struct text_file *p, const struct accuracy_context *x)
{
	const struct accuracy_figures *f = x->judgement->figures, *d = &f[ACCURACY_DEFAULT];
	char name[96];
	text_file_put(p, "<div class=\"answer\">");
	if (x->judgement->is_unreliable)
		text_file_put(
			p,
			"<p><b>Too little was rendered for this scene and size</b>: errors above 50 %%, or fewer than "
			"four rounds of a setting. Groups of chains that missed the rare light then look exact, and "
			"what follows may be chance. Give it more minutes (--budget), a smaller film (--size) or fewer "
			"parameters (--parameters).</p>");
	text_file_put(p, "<p>");
	if (d->dominating_index == ACCURACY_DEFAULT) {
		text_file_put(
			p, "<b>The default lies on the front</b>: no other setting has surely less error at equal time "
			   "without a sign of more bias, or surely less bias without surely more error.");
	} else {
		const struct accuracy_figures *b = &f[d->dominating_index];
		accuracy_setting_name(&x->design->settings[d->dominating_index], name, sizeof name);
		text_file_put(p, "<b>The default does not lie on the front</b>: <b>");
		text_file_put_escaped(p, name);
		text_file_put(
			p,
			"</b> has a relative error of %.3g %% (%.3g to %.3g) in the time in which the default has "
			"%.3g %% (%.3g to %.3g), that is %.2f times the speed; its bias is at most %.2g %%%s.",
			100 * b->error_at_equal_time.value, 100 * b->error_at_equal_time.low,
			100 * b->error_at_equal_time.high, 100 * d->error_at_equal_time.value,
			100 * d->error_at_equal_time.low, 100 * d->error_at_equal_time.high,
			d->error_at_equal_time.value * d->error_at_equal_time.value /
				(b->error_at_equal_time.value * b->error_at_equal_time.value),
			100 * b->bias_upper, b->bias_lower_joint > 0 ? "" : ", none was seen");
	}
	text_file_put(p, "</p>");
	size_t biased = 0;
	for (size_t i = 0; i < x->design->count; i++) {
		if (!(f[i].bias_lower_joint > 0) || i == ACCURACY_REFERENCE)
			continue;
		accuracy_setting_name(&x->design->settings[i], name, sizeof name);
		text_file_put(p, biased++ ? ", " : "<p>Settings whose bias was seen: ");
		text_file_put_escaped(p, name);
		text_file_put(p, " (at least %.2g %%)", 100 * f[i].bias_lower_joint);
	}
	text_file_put(p, biased ? ".</p>" : "<p>No bias was seen in any setting.</p>");
	if (isfinite(d->bias_mean.value))
		text_file_put(
			p,
			"<p>Against the reference the default's mean differs by %+.2g %% (%+.2g to %+.2g); its bias, of "
			"the mean or of any block, is at most %.2g %%.</p>",
			100 * d->bias_mean.value, 100 * d->bias_mean.low, 100 * d->bias_mean.high, 100 * d->bias_upper);
	text_file_put(p, "</div>\n");
}

static int put_picture(struct text_file *p, const struct accuracy_context *x, struct error *e)
{
	const struct accuracy_judgement *j = x->judgement;
	size_t pixels = (size_t)j->width * j->height, size;
	const float *const planes[3] = {j->rgb, j->rgb + pixels, j->rgb + 2 * pixels};
	unsigned char *bytes = mem_alloc(pixels, 3), *png = NULL;
	if (!bytes)
		return error_set(e, ENOMEM, "no memory for the picture");
	tonemap_image(planes, pixels, 0, bytes);
	int rc = picture_encode_png(bytes, j->width, j->height, &png, &size, e);
	mem_free(bytes);
	if (rc)
		return rc;
	text_file_put(p,
		      "<p><img alt=\"the scene, from the reference image\" width=\"%u\" src=\"data:image/png;base64,",
		      j->width < 480 ? j->width * (480 / j->width) : j->width);
	text_file_put_base64(p, png, size);
	text_file_put(p, "\"/><br/><span class=\"note\">The scene, from the reference image.</span></p>\n");
	mem_free(png);
	return 0;
}

static void put_fact(struct text_file *p, const char *name, const char *text)
{
	text_file_put(p, "<tr><td class=\"t\">%s</td><td class=\"t\">", name);
	text_file_put_escaped(p, text);
	text_file_put(p, "</td></tr>\n");
}

static void describe_machine(char *text, size_t size, unsigned threads)
{
	char line[256], model[160] = "unknown processor";
	FILE *f = fopen("/proc/cpuinfo", "re");
	while (f && fgets(line, sizeof line, f))
		if (sscanf(line, "model name : %159[^\n]", model) == 1)
			break;
	if (f)
		fclose(f);
	snprintf(text, size, "%s, %u thread%s; %s", model, threads, threads == 1 ? "" : "s", fingerprint_embree());
}

static void put_facts(struct text_file *p, const struct accuracy_context *x)
{
	const struct accuracy_run *r = x->run;
	const struct plan *plan = &r->jobs[ACCURACY_DEFAULT].plan;
	char text[PLAN_TEXT_MAX];
	time_t now = time(NULL);
	struct tm utc;
	text_file_put(p, "<table>\n");
	put_fact(p, "Scene", x->scene);
	snprintf(text, sizeof text, "%s, %u x %u pixels, paths of at most %u edges", plan->integrator, plan->crop_width,
		 plan->crop_height, plan->max_depth);
	put_fact(p, "Rendered by", text);
	put_fact(p, "Mixture", *plan->mutations ? plan->mutations : "none");
	put_fact(p, "Settings changed", *plan->accuracy ? plan->accuracy : "none: the renderer's defaults");
	plan_describe(plan, text, sizeof text);
	put_fact(p, "Plan of the default", text);
	snprintf(text, sizeof text,
		 "%zu settings in turns, %.0f s in all%s; each %.3g s of CPU, the reference %g times that",
		 x->design->count, r->wall_seconds, r->was_interrupted ? " (interrupted: the figures so far)" : "",
		 x->judgement->figures[ACCURACY_DEFAULT].cpu_seconds, ACCURACY_REFERENCE_SHARE);
	put_fact(p, "Run", text);
	snprintf(text, sizeof text, "rendered carefully: %s",
		 *x->design->settings[ACCURACY_REFERENCE].accuracy ? x->design->settings[ACCURACY_REFERENCE].accuracy
								   : "as the default, but longer");
	put_fact(p, "Reference for the bias", x->reference ? x->reference : text);
	describe_machine(text, sizeof text, r->threads);
	put_fact(p, "Machine", text);
	if (gmtime_r(&now, &utc) &&
	    strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC, hslt-accuracy " HSLT_VERSION, &utc))
		put_fact(p, "Made", text);
	text_file_put(p, "</table>\n");
}

static void put_guide(struct text_file *p, const struct accuracy_context *x)
{
	text_file_put(p, "<h2>How to read this</h2>\n");
	put_paragraph(
		p,
		"Each setting differs from the default in one parameter (presets: in several). All were rendered in "
		"turns, a round of each after the other, so that whatever else the machine did affects all of them alike.");
	text_file_put(
		p,
		"<p><b>Error at equal time</b> is the relative error that the setting reaches in the CPU time that the "
		"default had (%.3g s), and <b>error at equal mutations</b> that after as many mutations (%llu). Both "
		"are noise: the square root of the mean, over pixels and colours, of the squared standard error over "
		"the squared brightness, from the spread between independent groups of chains; the %g %% of the pixels "
		"with the greatest errors are left out, because a single pixel can dominate the error and say nothing "
		"about the setting. Half the error takes four times the time.</p>\n",
		x->judgement->default_cpu_seconds, (unsigned long long)x->judgement->default_mutations,
		100 * ACCURACY_TRIM);
	text_file_put(
		p,
		"<p><b>Bias</b> is what no amount of time removes: the mean of the image against that of the reference, "
		"and the block of the image (of %u x %u) that differs most surely. Figures in parentheses are 95 %% "
		"intervals. A bias counts as seen when chance cannot explain it, although all blocks of all settings were tested.</p>\n",
		x->judgement->blocks_across, x->judgement->blocks_down);
	put_paragraph(
		p,
		"A setting lies on the front (shaded) when no other one beats it: none has surely less error at equal "
		"time without a sign of more bias, and none is free of a bias that was seen in it without surely more "
		"error. \"Surely\" means beyond the intervals, which are widened for the number of settings; a setting whose bias is known "
		"much less well, or whose own interval of the bias excludes 0, beats nothing by speed. max-depth, "
		"roughness and tessellation change the image by design: they beat nothing, but may lie on the front as trade-offs.");
	if (!x->judgement->has_reference_file)
		put_paragraph(
			p, "The reference is the careful preset, rendered longer, so a bias that it shares cannot be "
			   "seen here; --reference FILE takes an image of another integrator instead.");
}

static void put_summary(struct text_file *p, const struct accuracy_context *x)
{
	const struct accuracy_judgement *j = x->judgement;
	char name[96];
	text_file_put(
		p,
		"<table>\n<tr><th class=\"t\">setting</th><th>error at equal time, %%</th><th>time for equal error</th>"
		"<th>bias of the mean, %%</th>"
		"<th>bias of the worst block, %%</th><th class=\"t\">verdict</th></tr>\n");
	for (size_t i = 0; i < x->design->count; i++) {
		const struct accuracy_figures *f = &j->figures[i];
		double times = f->error_at_equal_time.value / j->figures[ACCURACY_DEFAULT].error_at_equal_time.value;
		if (i == ACCURACY_REFERENCE)
			continue;
		begin_row(p, x, i);
		put_name_cell(p, x, i);
		put_interval_cell(p, f->error_at_equal_time, false, false);
		text_file_put(p, "<td>x %.2f</td>", times * times);
		struct interval not_shown = {NAN, NAN, NAN};
		put_interval_cell(p, f->bias_mean, true, f->bias_lower_joint > 0);
		put_interval_cell(p, j->blocks_across * j->blocks_down == 1 ? not_shown : f->bias_worst_block, true,
				  f->bias_lower_joint > 0);
		if (f->dominating_index == i) {
			text_file_put(p, "<td class=\"t\">on the front%s</td></tr>\n",
				      f->bias_lower_joint > 0 ? ", biased" : "");
			continue;
		}
		accuracy_setting_name(&x->design->settings[f->dominating_index], name, sizeof name);
		text_file_put(p, "<td class=\"t\">beaten by ");
		text_file_put_escaped(p, name);
		text_file_put(p, "</td></tr>\n");
	}
	text_file_put(p, "</table>\n");
}

static void put_mutations(struct text_file *p, const struct accuracy_context *x)
{
	text_file_put(
		p,
		"<h2>At equal mutations, and what a mutation costs</h2>\n<table>\n<tr><th class=\"t\">setting</th><th>mutations</th>"
		"<th>&#181;s CPU per mutation</th><th>accepted, %%</th><th>failed walks, %%</th><th>rays per mutation</th>"
		"<th>error at equal mutations, %%</th></tr>\n");
	for (size_t i = 0; i < x->design->count; i++) {
		const struct accuracy_figures *f = &x->judgement->figures[i];
		begin_row(p, x, i);
		put_name_cell(p, x, i);
		text_file_put(p, "<td>%llu</td><td>%.3g <span class=\"note\">(%.3g to %.3g)</span></td><td>%.3g</td>",
			      (unsigned long long)f->mutations, f->mutation_us.value, f->mutation_us.low,
			      f->mutation_us.high, 100 * f->acceptance_rate);
		put_failed_walks_cell(p, f);
		text_file_put(p, "<td>%.3g</td>", f->rays_per_mutation);
		struct interval not_shown = {NAN, NAN, NAN};
		put_interval_cell(p, i == ACCURACY_REFERENCE ? not_shown : f->error_at_equal_mutations, false, false);
		text_file_put(p, "</tr>\n");
	}
	text_file_put(p,
		      "</table>\n<p class=\"note\">Failed walks: the share of all walks on the manifold that did not "
		      "converge or whose reverse walk did not return to their start.</p>\n");
}

static void put_sweep(struct text_file *p, const struct accuracy_context *x, const struct accuracy_sweep *s)
{
	text_file_put(p, "<h3>");
	text_file_put_escaped(p, s->parameter);
	text_file_put(p, "</h3>\n");
	char text[300];
	snprintf(text, sizeof text, "%s.", s->summary);
	put_paragraph(p, text);
	accuracy_plot_sweep(p, x, s);
	text_file_put(
		p,
		"<table>\n<tr><th class=\"t\">value</th><th>&#181;s per mutation</th><th>accepted, %%</th><th>failed walks, %%</th>"
		"<th>error at equal time, %%</th><th>bias of the mean, %%</th><th>of the worst block, %%</th></tr>\n");
	for (size_t k = 0; k < s->count; k++) {
		size_t i = s->setting_indices[k];
		const struct accuracy_figures *f = &x->judgement->figures[i];
		struct interval not_shown = {NAN, NAN, NAN};
		begin_row(p, x, i);
		text_file_put(p, "<td class=\"t\">");
		text_file_put_escaped(p, s->values[k]);
		text_file_put(p, "%s</td><td>%.3g</td><td>%.3g</td>",
			      i == ACCURACY_DEFAULT && strcmp(s->values[k], "default") != 0 ? " (default)" : "",
			      f->mutation_us.value, 100 * f->acceptance_rate);
		put_failed_walks_cell(p, f);
		put_interval_cell(p, f->error_at_equal_time, false, false);
		put_interval_cell(p, f->bias_mean, true, f->bias_lower_joint > 0);
		put_interval_cell(p, x->judgement->blocks_across == 1 ? not_shown : f->bias_worst_block, true,
				  f->bias_lower_joint > 0);
		text_file_put(p, "</tr>\n");
	}
	text_file_put(p, "</table>\n");
}

static void put_appendix(struct text_file *p, const struct accuracy_context *x)
{
	const struct accuracy_design *d = x->design;
	if (d->skipped_count)
		text_file_put(p, "<h2>Left out</h2>\n<table>\n<tr><th class=\"t\">parameter</th>"
				 "<th class=\"t\">why it does nothing here</th></tr>\n");
	for (size_t i = 0; i < d->skipped_count; i++)
		put_fact(p, d->skipped[i].parameter, d->skipped[i].reason);
	text_file_put(p, "%s<h2>The CSV's columns</h2>\n<table>\n", d->skipped_count ? "</table>\n" : "");
	for (size_t i = 0; accuracy_columns[i].name; i++)
		put_fact(p, accuracy_columns[i].name,
			 *accuracy_columns[i].meaning ? accuracy_columns[i].meaning : "upper end of the same interval");
	text_file_put(p, "</table>\n");
}

static int put_page(struct text_file *p, const struct accuracy_context *x, struct error *e)
{
	text_file_put(p, "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\"><head>"
			 "<meta charset=\"utf-8\"/><title>What accuracy costs: ");
	text_file_put_escaped(p, x->scene);
	text_file_put(p, "</title><style>%s</style></head>\n<body>\n<h1>What accuracy costs in time: ", style);
	text_file_put_escaped(p, x->scene);
	text_file_put(p, "</h1>\n");
	put_verdict(p, x);
	int rc = put_picture(p, x, e);
	if (rc)
		return rc;
	put_facts(p, x);
	put_guide(p, x);
	text_file_put(p, "<h2>All settings</h2>\n");
	accuracy_plot_front(p, x);
	put_summary(p, x);
	text_file_put(p, "<h2>Parameter by parameter</h2>\n");
	for (size_t i = 0; i < x->design->sweep_count; i++)
		put_sweep(p, x, &x->design->sweeps[i]);
	put_mutations(p, x);
	put_appendix(p, x);
	text_file_put(p, "</body></html>\n");
	return 0;
}

int accuracy_write_html(const struct accuracy_context *x, const char *path, struct error *e)
{
	struct text_file p = {.has_failed = false};
	int rc = put_page(&p, x, e);
	if (!rc)
		rc = text_file_write(&p, path, e);
	text_file_fini(&p);
	return rc;
}
