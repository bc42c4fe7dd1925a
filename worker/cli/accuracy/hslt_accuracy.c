/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The program hslt-accuracy. It chooses the settings to compare (accuracy_design.c) and prints how many there are
 * and what was left out, renders them alternately (accuracy_run.c), computes the figures (accuracy_judge.c), and writes
 * them as HTML and, if requested, CSV. A summary is printed on stderr. A signal ends the rendering, and what has been
 * rendered is reported if every setting has a complete round.
 *
 * Invalid settings end the program with 2 before anything is rendered, any other failure or an interruption with 1.
 */
#include "common/base/mem.h"
#include "common/base/program.h"
#include "common/base/output_target.h"
#include "common/base/progress.h"
#include "common/exr/output_files.h"
#include "worker/cli/accuracy/accuracy_csv.h"
#include "worker/cli/accuracy/accuracy_html.h"
#include "worker/cli/base/guarded_source.h"
#include "worker/cli/base/interrupt.h"
#include "worker/cli/base/options.h"
#include "worker/cli/base/source_place.h"

#include <stdio.h>

struct arguments {
	struct render_arguments render;
	const char *csv, *parameters, *reference;
	unsigned threads;
	double budget_seconds, setting_seconds;
	uint64_t setting_rounds;
	bool quiet;
};

static const struct option_row option_rows[] = {
	{"output", 'o', "FILE", "The report (HTML); -: stdout", OPTION_OUTPUT(struct arguments, render.output)},
	{"csv", 0, "FILE", "Also write the figures as comma-separated values", OPTION_OUTPUT(struct arguments, csv)},
	{"budget", 0, "MINUTES", "Total time (10, 90s, 2h), divided equally; more makes the intervals narrower",
	 OPTION_TIME(struct arguments, budget_seconds, 0, 1e6, 60), .excludes_min = true, .excludes_max = true,
	 .default_value = "10"},
	{"seconds", 0, "S", "CPU seconds for each setting, instead of a budget",
	 OPTION_SECONDS(struct arguments, setting_seconds, 0, 1e9), .excludes_min = true, .excludes_max = true},
	{"rounds", 0, "N",
	 "Rounds of each setting, instead of a budget: with --epoch, --chains and --bootstrap, everything "
	 "but times is reproducible",
	 OPTION_COUNT(struct arguments, setting_rounds, 2, ACCURACY_COSTS_MAX)},
	{"threads", 0, "N", "Threads (one per processor)", OPTION_COUNT(struct arguments, threads, 1, 1024)},
	{"parameters", 0, "LIST",
	 "Parameters to vary, separated by commas: settings of --set (see --set help), max-depth, independent, "
	 "mixture, preset",
	 OPTION_TEXT(struct arguments, parameters)},
	{"reference", 0, "FILE", "An image (OpenEXR) to measure the bias against, instead of a careful render",
	 OPTION_TEXT(struct arguments, reference)},
	{"quiet", 0, NULL, "Print errors only", OPTION_FLAG(struct arguments, quiet)},
	{0},
};

static struct output_files list_outputs(const struct arguments *a)
{
	return (struct output_files){{{"-o", a->render.output, OUTPUT_HTML}, {"--csv", a->csv, OUTPUT_CSV}}};
}

static int check_options(void *target, struct error *e)
{
	const struct arguments *a = target;
	if (!a->render.scene || !a->render.output)
		return error_set(e, EINVAL, "a scene and -o FILE are needed");
	if (plan_request_is_bounded(&a->render.plan))
		return error_set(e, EINVAL,
				 "use --budget or --seconds instead of --spp, --mutations N, --time or --target-error");
	struct output_files outputs = list_outputs(a);
	return output_files_check_names(&outputs, e);
}

static const struct program program = {
	.name = "hslt-accuracy",
	.synopsis = "SCENE.xml",
	.summary = "Shows what accuracy costs in time: renders a scene with one setting changed at a time, and reports "
		   "the error and time of each.",
	.examples = "hslt-accuracy room.xml -o room.html --size 160x90\n"
		    "hslt-accuracy room.xml -o room.html --csv room.csv --size 160x90 --budget 60 --threads 8\n"
		    "hslt-accuracy room.xml -o depth.html --parameters max-depth,tolerance --seconds 30",
	.details =
		"The report is one HTML file: error at equal time and at equal mutations, time per mutation, failed "
		"walks and bias of every setting, and which settings lie on the Pareto front. A small film tells as "
		"much as a large one and takes less memory.\n"
		"If it is interrupted after every setting has had a round, it reports what was rendered and exits with 1.",
	.exit_codes = "0 done, 1 failed, 2 usage",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
	.shared_options = &render_option_table,
	.parse_word = option_scene,
};

struct session {
	struct arguments *args;
	char *folder, *name;
	struct scene scene;
	bool is_scene_read, is_usage_error; /* `scene` must be freed; the command line is wrong */
	struct asset_folders folders;
	struct output_files outputs;
	struct guarded_source guarded;
	struct asset_source assets;
	struct render_summary summary;
	struct accuracy_design design;
	struct accuracy_run run;
	struct accuracy_judgement judgement;
	struct picture reference;
	struct progress progress;
};

static void show_progress(void *user, double fraction, const char *state)
{
	struct session *s = user;
	char detail[64];
	snprintf(detail, sizeof detail, "%zu settings", s->design.count);
	progress_show(&s->progress, fraction, state, detail);
}

static int load_scene(struct session *s, struct error *e)
{
	struct render_arguments *r = &s->args->render;
	int rc = scene_path_split(s->args->render.scene, &s->args->render, &s->folder, &s->name, e);
	if (rc)
		return rc;
	s->folders = option_folders(r, s->folder);
	s->assets = guarded_source(&s->guarded, asset_source_for_folders(&s->folders), &s->outputs);
	rc = option_scene_read(&s->scene, &s->assets, s->name, r, e);
	if (rc)
		return rc;
	s->is_scene_read = true;
	for (uint32_t i = 0; !s->args->quiet && i < s->scene.note_count; i++)
		source_place_print(stderr, "note: ", s->args->render.scene, s->scene.notes[i]);
	return world_check(&s->scene, &s->assets, &r->render, &s->summary, e);
}

/* Checks that the reference has the size of the renders, before any time is spent on them. */
static int check_reference(const struct session *s, struct error *e)
{
	const struct plan_request *p = &s->args->render.plan;
	uint32_t width = p->crop_width ? p->crop_width : p->width, height = p->crop_width ? p->crop_height : p->height;
	if (!s->args->reference || (s->reference.image.width == width && s->reference.image.height == height))
		return 0;
	return error_set(e, EINVAL, "%s has %ux%u pixels, but the settings are rendered with %ux%u", s->args->reference,
			 s->reference.image.width, s->reference.image.height, width, height);
}

static int make_design(struct session *s, struct error *e)
{
	struct render_arguments *r = &s->args->render;
	if (integrator_is_undecided(&r->plan)) /* one with chains, which most settings concern */
		snprintf(r->plan.integrator, sizeof r->plan.integrator, "%s",
			 render_effect_is_on(&s->summary, "scattering") ||
					 render_effect_is_on(&s->summary, "medium-light")
				 ? "pssmlt"
				 : RENDER_INTEGRATOR_CHAINS);
	int rc = render_plan_from_scene(r, &s->summary, e);
	if (!rc)
		rc = accuracy_make_design(&s->design, &r->plan, &s->summary, s->args->parameters, e);
	if (!rc)
		rc = check_reference(s, e);
	s->is_usage_error = rc == -EINVAL;
	if (rc || s->args->quiet)
		return rc;
	fprintf(stderr, "%zu settings: the default, a reference and %zu parameter%s\n", s->design.count,
		s->design.sweep_count, s->design.sweep_count == 1 ? "" : "s");
	for (size_t i = 0; i < s->design.skipped_count; i++)
		fprintf(stderr, "left out: %s (%s)\n", s->design.skipped[i].parameter, s->design.skipped[i].reason);
	return 0;
}

static int render_all(struct session *s, struct error *e)
{
	const struct arguments *a = s->args;
	s->run = (struct accuracy_run){.design = &s->design,
				       .request = a->render.plan,
				       .scene = &s->scene,
				       .assets = &s->assets,
				       .options = &a->render.render,
				       .threads = a->threads,
				       .seconds = a->budget_seconds,
				       .setting_seconds = a->setting_seconds,
				       .setting_rounds = a->setting_rounds,
				       .stop = &interrupted,
				       .on_progress = a->quiet ? NULL : show_progress,
				       .user = s};
	if (!a->quiet)
		progress_begin(&s->progress);
	int rc = accuracy_render(&s->run, e);
	if (!a->quiet)
		progress_end(&s->progress);
	return rc;
}

static int write_reports(struct session *s, struct error *e)
{
	struct accuracy_context x = {.scene = s->name,
				     .reference = s->args->reference,
				     .design = &s->design,
				     .run = &s->run,
				     .judgement = &s->judgement};
	int rc = accuracy_judge(&s->run, s->args->reference ? &s->reference : NULL, &s->judgement, e);
	if (!rc && s->args->csv)
		rc = accuracy_write_csv(&x, s->args->csv, e);
	if (!rc)
		rc = accuracy_write_html(&x, s->args->render.output, e);
	return rc;
}

static void print_summary(const struct session *s)
{
	const struct accuracy_figures *f = s->judgement.figures, *d = &f[ACCURACY_DEFAULT];
	char name[96];
	if (s->judgement.is_unreliable)
		fprintf(stderr,
			"too little was rendered: the figures may be chance (more --budget, smaller --size or fewer --parameters)\n");
	fprintf(stderr, "default: relative error %.2f %% in %.3g s of CPU, bias at most %.2g %%",
		100 * d->error_at_equal_time.value, s->judgement.default_cpu_seconds, 100 * d->bias_upper);
	if (d->dominating_index == ACCURACY_DEFAULT) {
		fprintf(stderr, "; on the front\n");
		return;
	}
	accuracy_setting_name(&s->design.settings[d->dominating_index], name, sizeof name);
	fprintf(stderr, "; beaten by %s: %.2f %%\n", name, 100 * f[d->dominating_index].error_at_equal_time.value);
}

static int run_session(struct session *s, struct error *e)
{
	const char *inputs[] = {s->args->render.scene, s->args->reference};
	s->outputs = list_outputs(s->args);
	int rc = output_files_check(&s->outputs, inputs, 2, e);
	if (!rc && s->args->reference)
		rc = picture_read(&s->reference, s->args->reference, e);
	if (!rc)
		rc = load_scene(s, e);
	if (!rc)
		rc = make_design(s, e);
	if (!rc)
		rc = render_all(s, e);
	if (!rc)
		rc = write_reports(s, e);
	if (!rc && !s->args->quiet)
		print_summary(s);
	if (!rc && s->run.was_interrupted)
		rc = error_set(e, EINTR, "interrupted: %s holds the figures so far",
			       output_target_display_name(s->args->render.output));
	return rc;
}

int main(int argc, char **argv)
{
	static struct arguments a;
	static struct session s;
	struct error e = {""};
	mem_retain_freed(1 << 20);
	a.threads = option_threads_default();
	program_parse_options(&program, argc, argv, &a);
	interrupt_watch();
	s.args = &a;
	int rc = run_session(&s, &e);
	accuracy_run_fini(&s.run);
	accuracy_judgement_fini(&s.judgement);
	picture_fini(&s.reference);
	if (s.is_scene_read)
		scene_fini(&s.scene);
	mem_free(s.folder);
	mem_free(s.name);
	if (rc)
		source_place_print(stderr, "hslt-accuracy: ", a.render.scene, e.text);
	return rc ? s.is_usage_error ? 2 : 1 : 0;
}
