/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The program hslt-render. It reads the options and the scene, chooses the integrator (choice.h), makes the plan,
 * renders it (local_run.h) and writes the image. Until the integrator is chosen, a signal ends the program at once;
 * after that, the image of the complete rounds is written, and the exit code says that the render was interrupted.
 *
 * A failure ends with one line on stderr and the exit code of its kind (docs/design.md). The image is replaced
 * atomically or not at all.
 */
#include "common/base/clock.h"
#include "common/base/crash.h"
#include "common/base/mem.h"
#include "common/base/program.h"
#include "common/base/output_target.h"
#include "common/base/progress.h"
#include "common/blob/blob.h"
#include "common/exr/image_file.h"
#include "common/estimate/merge.h"
#include "common/estimate/stated_error.h"
#include "common/estimate/strategy.h"
#include "common/plan/plan_text.h"
#include "worker/cli/render/choice.h"
#include "worker/cli/render/estimate.h"
#include "worker/cli/render/eta.h"
#include "worker/cli/render/explain.h"
#include "worker/cli/render/kept_bootstrap.h"
#include "worker/cli/render/local_pilot.h"
#include "worker/cli/base/guarded_source.h"
#include "worker/cli/base/interrupt.h"
#include "worker/cli/base/options.h"
#include "worker/cli/base/source_place.h"
#include "worker/cli/render/pilot_request.h"
#include "worker/cli/render/stats.h"
#include "worker/render/fingerprint.h"

#include <math.h>
#include <stdio.h>

struct arguments {
	struct render_arguments render;
	const char *stats, *plot;
	unsigned threads;
	double pilot; /* s; 0: not given */
	bool quiet, estimate, explain, json;
};

static const struct option_row option_rows[] = {
	{"output", 'o', "FILE", "The image (OpenEXR); -: stdout", OPTION_CUSTOM(option_image)},
	{"threads", 0, "N", "Threads (one per processor); does not change the bits",
	 OPTION_COUNT(struct arguments, threads, 1, 1024)},
	{"stats", 0, "FILE",
	 "Write plan, times, counters, strategies and effects as JSON, and print tables of strategies and "
	 "path classes",
	 OPTION_OUTPUT(struct arguments, stats)},
	{"quiet", 0, NULL, "Print errors only", OPTION_FLAG(struct arguments, quiet)},
	ESTIMATE_ROWS(struct arguments),
	{"explain", 0, NULL, "Only print which effects the scene needs and why, and what omitting the others saves",
	 OPTION_FLAG(struct arguments, explain)},
	{"json", 0, NULL, "Print the output of --estimate or --explain as one JSON object",
	 OPTION_FLAG(struct arguments, json)},
	{0},
};

static struct output_files list_outputs(const struct arguments *a)
{
	return (struct output_files){{
		{"-o", a->render.output, OUTPUT_EXR},
		{"--stats", a->stats, OUTPUT_JSON},
		{"--plot", a->plot, output_plot_format(a->plot ? a->plot : "")},
	}};
}

static int check_options(void *target, struct error *e)
{
	const struct arguments *a = target;
	if (!a->render.scene || (!a->render.output && !a->estimate && !a->explain))
		return error_set(e, EINVAL, "a scene and -o FILE are needed");
	if (a->estimate && (a->render.output || a->stats))
		return error_set(e, EINVAL, "--estimate makes no image and cannot be combined with -o or --stats");
	if (a->explain && (a->render.output || a->stats || a->estimate))
		return error_set(e, EINVAL,
				 "--explain renders nothing and cannot be combined with -o, --stats or --estimate");
	if (!a->estimate && (a->pilot > 0 || a->plot))
		return error_set(e, EINVAL, "--pilot and --plot require --estimate");
	if (a->json && !a->estimate && !a->explain)
		return error_set(e, EINVAL, "--json requires --estimate or --explain");
	struct output_files outputs = list_outputs(a);
	return output_files_check_names(&outputs, e);
}

static const struct program program = {
	.name = "hslt-render",
	.synopsis = "SCENE.xml",
	.summary = "Renders a scene on this machine, without a farm: the same plan gives the same bits as the farm's.",
	.examples =
		"hslt-render room.xml -o room.exr --spp 64\n"
		"hslt-render room.xml -o room.exr --integrator path --size 320x180 --threads 8 --stats room.json\n"
		"hslt-render room.xml -o room.exr --target-error 2% --time 3600\n"
		"hslt-render --estimate room.xml --plot room.svg\n"
		"hslt-render --explain room.xml\n"
		"hslt-render room.xml -o room.exr --integrator hslt --mutations hslt=0.9,bidirectional=0.1 --mutations 10000000",
	.details =
		"--estimate makes no image: a pilot of a minute predicts what errors of 10, 5, 2 and 1 % (and "
		"--target-error) will cost.\nThe image contains linear Rec. 709 (R G B), one standard error of each "
		"(error.R error.G error.B), and for chains the potential scale reduction of each pixel's tile (rhat.Y).",
	.exit_codes =
		"0 done, 1 failed, 2 usage, 4 another bound was reached before the target error, 5 chains disagree "
		"(the image is there, and its "
		"note says where)",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
	.shared_options = &render_option_table,
	.parse_word = option_scene,
};

struct session {
	struct arguments *args;
	char *folder, *name;
	char scene_hash[BLOB_HEX_SIZE];
	char scene_notes[HEADER_SCENE_NOTES_MAX];
	struct plan_scene inputs;
	struct world *world;
	struct render_summary summary;
	struct plan plan;
	struct local_run run;
	struct canvas_image image;
	struct forecast_history looks;
	struct convergence convergence;
	double forecast_seconds; /* expected from the first bootstrap sample to the target error; 0: unknown */
	char forecast[192];	 /* part of the progress line */
	double build_seconds;	 /* of the world */
	struct choice choice;
	struct progress progress;
	struct kept_bootstrap kept_bootstrap;
	struct output_files outputs;
	struct guarded_source guarded;
	bool uses_scene_spp; /* no bound was given, so the scene's number of samples is rendered */
	bool is_usage_error; /* the command line is wrong */
};

static int hash_scene(struct session *s, const struct asset_source *files, struct error *e)
{
	struct asset a;
	struct blob_hash h;
	int rc = files->open(files->user, s->name, &a, e);
	if (rc)
		return rc;
	rc = blob_hash_bytes(a.bytes, a.size, &h, e);
	files->close(files->user, &a);
	blob_hash_to_hex(&h, s->scene_hash);
	return rc;
}

static int load_scene(struct session *s, struct error *e)
{
	struct scene scene;
	double begin = clock_seconds();
	int rc = scene_path_split(s->args->render.scene, &s->args->render, &s->folder, &s->name, e);
	if (rc)
		return rc;
	struct asset_folders folders = option_folders(&s->args->render, s->folder);
	struct asset_source files = guarded_source(&s->guarded, asset_source_for_folders(&folders), &s->outputs),
			    assets = kept_bootstrap_source(&s->kept_bootstrap, &files);
	rc = hash_scene(s, &files, e);
	if (!rc)
		rc = option_scene_read(&scene, &assets, s->name, &s->args->render, e);
	if (rc)
		return rc;
	option_plan_scene(&s->args->render, &s->inputs);
	for (uint32_t i = 0; !s->args->quiet && i < scene.note_count; i++)
		source_place_print(stderr, "note: ", s->args->render.scene, scene.notes[i]);
	text_join_lines(s->scene_notes, sizeof s->scene_notes, scene.notes, scene.note_count);
	rc = scene_append_missing_count(&scene, &assets,
					world_new(&s->world, &scene, &assets, &s->args->render.render, e), e);
	scene_fini(&scene);
	if (rc)
		return rc;
	world_summary(s->world, &s->summary);
	s->build_seconds = clock_seconds() - begin;
	return 0;
}

/* Chooses the integrator. From then on a signal ends the render after complete rounds, which are kept; before, there is
 * nothing to keep, and a signal ends the program. */
static int choose_integrator(struct session *s, struct error *e)
{
	int rc = choice_in_world(s->world, &s->args->render, &s->choice, e);
	interrupt_watch();
	if (!rc && !s->args->quiet)
		choice_print(&s->choice, s->args->render.plan.integrator);
	return rc;
}

static int make_plan(struct session *s, struct error *e)
{
	struct plan_request *p = &s->args->render.plan;
	char text[PLAN_TEXT_MAX];
	s->uses_scene_spp = !plan_request_is_bounded(p);
	int rc = render_plan_from_scene(&s->args->render, &s->summary, e);
	if (!rc)
		rc = choose_integrator(s, e);
	if (!rc)
		rc = plan_make(p, &s->plan, e);
	s->is_usage_error = rc == -EINVAL;
	if (!rc)
		rc = canvas_probe(&s->plan, e);
	if (rc || s->args->quiet)
		return rc;
	plan_describe(&s->plan, text, sizeof text);
	fprintf(stderr, "%s\n", text);
	plan_describe_changes(p, &s->plan, text, sizeof text);
	if (*text)
		fprintf(stderr, "%s\n", text);
	stated_error_print_rule(s->plan.target_error, s->plan.kind == PLAN_CHAINS, text, sizeof text);
	if (*text)
		fprintf(stderr, "%s\n", text);
	option_depth_note(s->plan.integrator, s->plan.max_depth, text, sizeof text);
	if (*text)
		fprintf(stderr, "hslt-render: note: %s\n", text);
	for (size_t i = 0; render_scene_note(&s->summary, i, text, sizeof text); i++)
		source_place_print(stderr, "hslt-render: note: ", s->args->render.scene, text);
	fprintf(stderr, "scene built in %.2f s: %llu triangles, %zu MB for Embree\n", s->build_seconds,
		(unsigned long long)s->summary.triangles, world_embree_bytes(s->world) >> 20);
	return 0;
}

/* Returns the elapsed share of the time until the render ends, which is at the end of the round in which the plan's
 * time is over. */
static double time_fraction(const struct plan *plan, const struct local_progress *p)
{
	double speed = p->round_seconds > 0 ? p->rounds / p->round_seconds : 0;
	double remaining = merge_seconds_remaining(plan, p->seconds, p->rounds, speed);
	return isnan(remaining) ? 0.99 : p->seconds / (p->seconds + remaining);
}

static void show_progress(void *user, const struct local_progress *p)
{
	struct session *s = user;
	char detail[256], eta[32];
	double fraction = 0;
	if (p->leases_total != UINT64_MAX)
		fraction = (double)p->leases_done / (double)p->leases_total;
	if (s->forecast_seconds > 0)
		fraction = fmax(fraction, fmin(p->seconds / s->forecast_seconds, 0.99));
	if (s->plan.seconds > 0)
		fraction = fmax(fraction, time_fraction(&s->plan, p));
	double remaining = eta_seconds(&s->plan, p, s->forecast_seconds);
	progress_format_time(isnan(remaining) ? 0 : remaining, eta, sizeof eta);
	snprintf(detail, sizeof detail, "%s%s%s", isnan(remaining) ? "" : eta, isnan(remaining) ? "" : " left",
		 s->forecast);
	progress_show(&s->progress, progress_max_fraction(&s->progress, fraction, p->state), p->state, detail);
}

/* Called with a new estimate of the error: updates the part of the progress line that says when the target will be
 * reached, and what halving the error costs. */
static void update_forecast(struct session *s, const struct local_round *r)
{
	struct forecast_cost stop, halving;
	struct forecast_range error;
	char low[32], high[32], more[32];
	forecast_add_image(&s->looks, &s->plan, r->image, r->cpu_seconds, r->seconds);
	if (!forecast_current_error(&s->looks, &error) || !forecast_cost_of_halving(&s->looks, &s->plan, &halving) ||
	    !forecast_cost_of_target(&s->looks, &s->plan, s->plan.target_error, FORECAST_SAME, &stop))
		return;
	s->forecast_seconds = stop.seconds.middle + r->bootstrap_seconds;
	progress_format_duration(stop.seconds.low - r->seconds, low, sizeof low);
	progress_format_duration(stop.seconds.high - r->seconds, high, sizeof high);
	progress_format_duration(halving.seconds.middle, more, sizeof more);
	double doubt = forecast_stopping_error(&s->looks, &s->plan, s->plan.target_error);
	int n = snprintf(s->forecast, sizeof s->forecast, " (%s - %s to the target), error %.3g %%, halved in %s", low,
			 high, 100 * error.middle, more);
	if (doubt > 0 && n > 0 && (size_t)n < sizeof s->forecast)
		snprintf(s->forecast + n, sizeof s->forecast - (size_t)n, "; the error is in doubt: stops at %.3g %%",
			 100 * doubt);
}

static void on_round(void *user, const struct local_round *r)
{
	struct session *s = user;
	if (r->image)
		update_forecast(s, r);
}

static int resume_bootstrap(void *user, struct bootstrap *b, struct error *e)
{
	struct session *s = user;
	char text[512], fingerprint[FINGERPRINT_MAX];
	(void)e;
	fingerprint_make(fingerprint);
	kept_bootstrap_begin(&s->kept_bootstrap, s->args->render.output, fingerprint, &s->plan, &s->args->render);
	kept_bootstrap_resume(&s->kept_bootstrap, b, text, sizeof text);
	if (*text && !s->args->quiet)
		fprintf(stderr, "hslt-render: note: %s\n", text);
	return 0;
}

static void keep_bootstrap(void *user, const struct bootstrap *b)
{
	struct session *s = user;
	kept_bootstrap_write(&s->kept_bootstrap, b);
}

static int render_image(struct session *s, struct error *e)
{
	s->run = (struct local_run){.world = s->world,
				    .plan = &s->plan,
				    .threads = s->args->threads,
				    .stop = &interrupted,
				    .on_progress = s->args->quiet ? NULL : show_progress,
				    .on_round = on_round,
				    .load_bootstrap = resume_bootstrap,
				    .save_bootstrap = keep_bootstrap,
				    .user = s};
	if (!s->args->quiet)
		progress_begin(&s->progress);
	int rc = local_run(&s->run, e);
	if (!s->args->quiet)
		progress_end(&s->progress);
	if (rc)
		return rc;
	if (!s->run.canvas || (canvas_complete_rounds(s->run.canvas) == 0 && !s->run.bootstrap_result.is_black))
		return error_set(e, EINTR, "interrupted before the first round was complete: there is no image%s",
				 s->kept_bootstrap.message);
	rc = canvas_image_init(s->run.canvas, false, &s->image, e);
	if (!rc)
		convergence_judge(&s->plan, &s->image, &s->convergence);
	return rc;
}

static int write_image(const struct session *s, struct error *e)
{
	struct header_effect effects[RENDER_EFFECTS_MAX];
	for (size_t i = 0; i < s->summary.effect_line_count; i++)
		effects[i] =
			(struct header_effect){s->summary.effect_lines[i].name, s->summary.effect_lines[i].is_on,
					       s->summary.effect_lines[i].is_forced, s->summary.effect_lines[i].reason,
					       s->summary.effect_lines[i].savings};
	char camera[RENDER_CAMERA_TEXT_MAX];
	render_camera_text(&s->summary, camera, sizeof camera);
	struct header_extra x = {.scene = s->name,
				 .scene_hash = s->scene_hash,
				 .inputs = &s->inputs,
				 .camera = camera,
				 .scene_notes = s->scene_notes,
				 .effect_count = s->summary.effect_line_count,
				 .effects = effects,
				 .wall_seconds = s->run.seconds,
				 .cpu_seconds = s->run.cpu_seconds,
				 .worker_count = s->args->threads,
				 .end_name = merge_end_name(s->run.end, s->run.bootstrap_result.is_black)};
	unsigned char *bytes;
	size_t size;
	int rc = image_file_encode(&s->image, &s->plan, &x, &bytes, &size, e);
	if (rc)
		return rc;
	rc = image_file_write(s->args->render.output, bytes, size, e);
	mem_free(bytes);
	return rc;
}

/* Returns what ended the render, in the words of the command line. */
static const char *end_text(const struct session *s)
{
	const struct plan_request *r = &s->args->render.plan;
	if (s->run.end != MERGE_ROUNDS || s->run.bootstrap_result.is_black)
		return merge_end_name(s->run.end, s->run.bootstrap_result.is_black);
	return s->uses_scene_spp ? "the scene's samples per pixel" : r->mutations ? "--mutations" : "--spp";
}

static void print_summary(const struct session *s)
{
	const struct canvas_image *i = &s->image;
	const struct plan *p = &s->plan;
	char text[STRATEGY_TABLE_MAX];
	fprintf(stderr, "%llu round%s in %.1f s (%.1f s of CPU time); stopped by: %s\n", (unsigned long long)i->rounds,
		i->rounds == 1 ? "" : "s", s->run.seconds, s->run.cpu_seconds, end_text(s));
	stated_error_print(i, text, sizeof text);
	if (*text && !i->rel_mse_doubt)
		fprintf(stderr, "%s\n", text);
	strategy_print_table(p->mutations, &i->counts, text, sizeof text);
	if (s->args->stats)
		fputs(text, stderr);
	convergence_print_table(i->classes, i->b, &s->convergence, text, sizeof text);
	if (s->args->stats)
		fputs(text, stderr);
	if (s->args->stats && i->counts.counters[COUNT_REDISTRIBUTED])
		fprintf(stderr,
			"chains that spread what is too bright for a sample: %.3g %% of the light, %.3g %% of the variance "
			"of the mean, %.3g %% of the rays\n",
			100 * i->chains_energy_share, 100 * i->chains_variance_share, 100 * stats_chains_rays(i));
	strategy_print_note(p, &i->counts, i->is_black, text, sizeof text);
	strategy_append_overlong(i->overlong_share, text, sizeof text);
	convergence_append_note(&s->convergence, text, sizeof text);
	if (*text)
		fprintf(stderr, "hslt-render: note: %s\n", text);
}

/* Prints a warning that the error of the image is not known. It is the last line, printed even with --quiet. */
static void warn_unknown_error(const struct session *s)
{
	char text[STATED_ERROR_TEXT_MAX];
	stated_error_print(&s->image, text, sizeof text);
	fprintf(stderr, "hslt-render: warning: %s\n", text);
}

static int report_estimate(const struct session *s, const struct local_pilot *p, struct error *e)
{
	char where[64];
	snprintf(where, sizeof where, "this machine, %u thread%s", s->args->threads, s->args->threads == 1 ? "" : "s");
	struct estimate m = {.scene = s->name,
			     .machine = where,
			     .request = p->request,
			     .plan = &p->render,
			     .pilot = &p->plan,
			     .looks = &p->looks,
			     .cpu_seconds = p->cpu_seconds,
			     .seconds = p->wall_seconds,
			     .bootstrap_cpu_seconds = p->bootstrap_cpu_seconds,
			     .bootstrap_seconds = p->bootstrap_seconds,
			     .target = s->args->render.plan.target_error};
	return estimate_report(&m, s->args->json, s->args->plot, e);
}

static int run_estimate(struct session *s, struct error *e)
{
	struct plan plan;
	int rc = load_scene(s, e);
	if (!rc) {
		rc = pilot_plan_from_scene(&s->args->render, &s->summary, e);
		if (!rc)
			rc = choose_integrator(s, e);
		if (!rc)
			rc = pilot_render_plan(&s->args->render.plan, &plan, e);
		s->is_usage_error = rc == -EINVAL;
	}
	if (rc)
		return rc;
	struct local_pilot p = {.world = s->world,
				.request = &s->args->render.plan,
				.seconds = s->args->pilot > 0 ? s->args->pilot : PILOT_SECONDS,
				.threads = s->args->threads,
				.stop = &interrupted,
				.on_progress = s->args->quiet ? NULL : show_progress,
				.user = s};
	s->plan.seconds = p.seconds;
	if (!s->args->quiet)
		progress_begin(&s->progress);
	rc = local_pilot(&p, e);
	if (!s->args->quiet)
		progress_end(&s->progress);
	return rc ? rc : report_estimate(s, &p, e);
}

static int check_outputs(struct session *s, struct error *e)
{
	s->outputs = list_outputs(s->args);
	return output_files_check(&s->outputs, &s->args->render.scene, 1, e);
}

static int run_session(struct session *s, struct error *e)
{
	if (s->args->explain)
		return explain_scene(s->args->render.scene, &s->args->render, s->args->json, &s->is_usage_error, e);
	int rc = check_outputs(s, e);
	if (rc || s->args->estimate)
		return rc ? rc : run_estimate(s, e);
	rc = load_scene(s, e);
	if (!rc)
		rc = make_plan(s, e);
	if (!rc)
		rc = render_image(s, e);
	if (!rc)
		rc = write_image(s, e);
	if (!rc)
		kept_bootstrap_end(&s->kept_bootstrap);
	if (!rc && s->args->stats)
		rc = stats_write(s->args->stats,
				 &(struct stats){s->name, &s->inputs, &s->summary, &s->run, &s->image, &s->convergence,
						 s->build_seconds, &s->looks, &s->choice},
				 e);
	if (!rc && !s->args->quiet)
		print_summary(s);
	if (!rc && s->image.rel_mse_doubt)
		warn_unknown_error(s);
	if (!rc && s->run.end == MERGE_CONTINUES)
		rc = error_set(e, EINTR, "interrupted: %s holds %llu complete round%s",
			       output_target_display_name(s->args->render.output), (unsigned long long)s->image.rounds,
			       s->image.rounds == 1 ? "" : "s");
	return rc;
}

int main(int argc, char **argv)
{
	static struct arguments a;
	static struct session s;
	struct error e = {""};
	mem_retain_freed(1 << 20);
	a.threads = option_threads_default();
	crash_install_exit_handler("hslt-render");
	program_parse_options(&program, argc, argv, &a);
	interrupt_set_message("hslt-render: interrupted before rendering began: nothing is kept\n");
	s.args = &a;
	int rc = run_session(&s, &e);
	canvas_image_fini(&s.image);
	canvas_free(s.run.canvas);
	world_free(s.world);
	mem_free(s.folder);
	mem_free(s.name);
	if (rc) {
		source_place_print(stderr, "hslt-render: ", a.render.scene, e.text);
		return s.is_usage_error ? 2 : 1;
	}
	if (s.convergence.verdict == CHAINS_DISAGREE)
		return 5;
	bool missed = s.plan.target_error > 0 && s.run.end != MERGE_ERROR && s.run.end != MERGE_BLACK &&
		      !s.run.bootstrap_result.is_black;
	return missed ? 4 : 0;
}
