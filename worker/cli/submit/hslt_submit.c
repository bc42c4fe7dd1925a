/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The program hslt-submit. It reads the scene and hashes its files, checks that the coordinator accepts it, chooses
 * integrator and plan as hslt-render does, and submits the job. With --wait it shows progress until the job ends and
 * fetches the image; a lost connection is made again (reconnect.h), and the job continues in the meantime. With
 * --estimate it runs a pilot on the farm instead (farm_pilot.h).
 *
 * The exit code is that of the job if it ended (docs/design.md, rules 6), otherwise that of the failure
 * (client_exit_code). After a signal the program prints how to continue with the job.
 */
#include "common/base/crash.h"
#include "common/base/program.h"
#include "common/base/output_target.h"
#include "common/base/text.h"
#include "common/estimate/stated_error.h"
#include "worker/cli/base/interrupt.h"
#include "worker/cli/render/choice.h"
#include "worker/cli/render/estimate.h"
#include "worker/cli/submit/farm_pilot.h"
#include "worker/cli/base/options.h"
#include "worker/cli/base/source_place.h"
#include "worker/cli/submit/reconnect.h"
#include "worker/cli/render/pilot_request.h"
#include "worker/cli/render/speed.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { JOB_NAME_MAX = 127 }; /* bytes of a job's displayed name */

struct arguments {
	struct render_arguments render;
	const char *coordinator, *tls, *name;
	struct submit_request request;
	const char *plot;
	double pilot;		 /* s; 0: not given */
	double patience_seconds; /* s */
	bool wait, json, insecure, estimate;
};

static bool writes_to_stdout(const struct arguments *a)
{
	return a->render.output && strcmp(a->render.output, TARGET_STDOUT) == 0;
}

static int parse_priority(void *target, char *arg, struct error *e)
{
	struct arguments *a = target;
	char *end;
	long n = strtol(arg, &end, 10);
	if (end == arg || *end || n < -100 || n > 100)
		return error_set(e, EINVAL, "--priority takes -100 to 100, not '%s'", arg);
	a->request.priority = (int)n;
	return 0;
}

static const struct option_row option_rows[] = {
	{"coordinator", 'c', "HOST:PORT", "The coordinator", OPTION_TEXT(struct arguments, coordinator),
	 .environment = "HSLT_COORDINATOR", .is_required = true},
	{"output", 'o', "FILE", "The image; -: stdout, and the job's id goes to stderr", OPTION_CUSTOM(option_image)},
	{"priority", 0, "P", "-100 to 100, higher first", OPTION_CUSTOM(parse_priority), .default_value = "0"},
	{"name", 0, "NAME", "Displayed name of the job (the scene's file name)",
	 OPTION_NAME(struct arguments, name, JOB_NAME_MAX)},
	{"wait", 0, NULL, "Show progress and fetch the image", OPTION_FLAG(struct arguments, wait)},
	{"patience", 0, "SECONDS", "With --wait: how long to try to reconnect to the coordinator",
	 OPTION_SECONDS(struct arguments, patience_seconds, 0, 1e9), .excludes_min = true, .excludes_max = true,
	 .default_value = "600"},
	{"json", 0, NULL, "Print one JSON object instead of the id, or of the estimate's table",
	 OPTION_FLAG(struct arguments, json)},
	ESTIMATE_ROWS(struct arguments),
	{"mixed", 0, NULL, "Accept workers of any numeric fingerprint, without equal bits",
	 OPTION_FLAG(struct arguments, request.is_mixed)},
	{"verify", 0, "P", "Share or percentage of the epochs on which two workers must agree before they count",
	 OPTION_RATIO(struct arguments, request.verify_fraction, 0, 1), .default_value = "0"},
	{"tls", 0, "DIR", "ca.pem, cert.pem, key.pem, made by hslt-ca: encryption and authentication",
	 OPTION_TEXT(struct arguments, tls), .environment = "HSLT_TLS"},
	{"insecure", 0, NULL, "Connect to addresses other than loopback without encryption",
	 OPTION_FLAG(struct arguments, insecure)},
	{0},
};

static struct output_files list_outputs(const struct arguments *a)
{
	return (struct output_files){{{"-o", a->wait ? a->render.output : NULL, OUTPUT_EXR},
				      {"--plot", a->plot, output_plot_format(a->plot ? a->plot : "")}}};
}

static int check_options(void *target, struct error *e)
{
	const struct arguments *a = target;
	if (!a->render.scene || (!a->render.output && !a->estimate))
		return error_set(e, EINVAL, "a scene and -o FILE are needed");
	if (a->request.verify_fraction > 0 && a->request.is_mixed)
		return error_set(e, EINVAL, "results of --mixed workers cannot be compared: no --verify");
	if (a->estimate && (a->render.output || a->wait))
		return error_set(e, EINVAL, "--estimate makes no image and cannot be combined with -o or --wait");
	if (!a->estimate && (a->pilot > 0 || a->plot))
		return error_set(e, EINVAL, "--pilot and --plot require --estimate");
	if (writes_to_stdout(a) && (!a->wait || a->json))
		return error_set(e, EINVAL, "-o - writes the image to stdout: it requires --wait and excludes --json");
	struct output_files outputs = list_outputs(a);
	return output_files_check_names(&outputs, e);
}

static const struct program program = {
	.name = "hslt-submit",
	.synopsis = "SCENE.xml",
	.summary = "Checks a scene, sends it to a coordinator as a job, and optionally waits for the image.",
	.examples =
		"hslt-submit --coordinator 127.0.0.1:7700 room.xml -o room.exr --spp 64 --wait\n"
		"hslt-submit room.xml -o room.exr --target-error 2% --time 3600\n"
		"hslt-submit room.xml -o room.exr --integrator hslt --mutations hslt=0.9,bidirectional=0.1 --spp 256\n"
		"hslt-submit --estimate room.xml --plot room.svg\n"
		"hslt-submit room.xml -o left.exr --crop 0,0,960,1080 --priority 10 -D light=sun",
	.details =
		"The job's id goes to stdout, everything else to stderr. Without --wait, the last part of -o is the default "
		"name for hslt-job fetch. --estimate makes no image: a pilot of a minute on the farm predicts what errors of "
		"10, 5, 2 and 1 % (and --target-error) will cost there. For long jobs without --epoch, a pilot of a second on "
		"this machine measures how many mutations a thread makes in the 20 s that a lease should take. --wait "
		"reconnects when the coordinator restarts.",
	.exit_codes =
		"0 done, 1 failed, 2 usage, 3 job failed, 4 another bound was reached before the target error, 5 "
		"chains disagree (the image is "
		"there, and its note says where), 6 refused, 75 coordinator not reachable, 130 interrupted while it waited "
		"(the job continues)",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
	.shared_options = &render_option_table,
	.parse_word = option_scene,
};

/* Returns the default name for a later fetch: without the folder, which the farm does not need. */
static const char *file_name_part(const char *path)
{
	const char *slash = strrchr(path, '/');
	return slash ? slash + 1 : path;
}

static void print_id(const struct arguments *a, uint64_t job, const char *plan, const char *state)
{
	char id[32];
	snprintf(id, sizeof id, "j%llu", (unsigned long long)job);
	if (a->json) {
		json_t *o = json_pack("{s:i s:s s:s s:s s:s s:s}", "schema", 1, "id", id, "name", a->request.name,
				      "output", output_target_to_arg(a->render.output), "plan", plan, "state", state);
		json_dumpf(o, stdout, JSON_COMPACT);
		putchar('\n');
		json_decref(o);
	} else if (writes_to_stdout(a)) {
		fprintf(stderr, "%s\n", id);
	} else {
		puts(id);
	}
	if (fflush(stdout) || ferror(stdout)) /* the job exists, so its id must not be lost */
		fprintf(stderr, "hslt-submit: the job's id is %s\n", id);
}

/* Prepares the text for a signal: ending this program does not end the job. */
static void set_end_message(const struct arguments *a, uint64_t job)
{
	static char text[512];
	unsigned long long id = job;
	char fetch[256], cancel[64];
	int width = snprintf(fetch, sizeof fetch, "hslt-job fetch j%llu -o %.200s", id,
			     output_target_to_arg(a->render.output));
	snprintf(cancel, sizeof cancel, "hslt-job cancel j%llu", id);
	snprintf(
		text, sizeof text,
		"\nhslt-submit: the job continues without this program.\n  %s  fetches its image when it is done, with --preview "
		"the image so far\n  %-*s  shows its progress\n  %-*s  ends it\n",
		fetch, width, "hslt-job list", width, cancel);
	interrupt_set_message(text);
}

static int submit_scene(struct arguments *a, struct client **cl, const struct scene_files *files, int *code,
			struct error *e)
{
	struct submitted_job job;
	struct submit_outcome outcome = {0};
	char plan[PLAN_TEXT_MAX] = "", rule[STATED_ERROR_TEXT_MAX];
	struct reconnect o = {a->coordinator, a->tls, a->insecure, a->patience_seconds};
	int rc = submit_send(*cl, &a->request, files, &job, plan, sizeof plan, e);
	if (rc)
		return rc;
	fprintf(stderr, "%s\n", plan);
	stated_error_print_rule(a->render.plan.target_error, a->render.plan.kind == PLAN_CHAINS, rule, sizeof rule);
	if (*rule)
		fprintf(stderr, "%s\n", rule);
	if (a->wait)
		set_end_message(a, job.job);
	if (!a->wait || !a->json)
		print_id(a, job.job, plan, "queued");
	if (!a->wait)
		return 0;
	rc = reconnect_job(cl, &o, &job, a->render.output, &outcome, e);
	if (!rc && !outcome.has_result)
		fprintf(stderr, "hslt-submit: job j%llu ended without an image: %s\n", (unsigned long long)job.job,
			outcome.reason);
	if (!rc && *outcome.note)
		fprintf(stderr, "hslt-submit: note: %s\n", outcome.note);
	if (!rc && a->json)
		print_id(a, job.job, plan, outcome.state);
	*code = (int)outcome.exit_code;
	return rc;
}

static int run_estimate(const struct arguments *a, struct client *cl, const struct scene_files *files, struct error *e)
{
	struct farm_pilot p = {.client = cl,
			       .request = &a->request,
			       .files = files,
			       .seconds = a->pilot > 0 ? a->pilot : PILOT_SECONDS};
	int rc = farm_pilot(&p, e);
	if (rc)
		return rc;
	const struct forecast_history *looks = &p.outcome.looks;
	const struct forecast_look *last = looks->count ? &looks->looks[looks->count - 1] : NULL;
	struct estimate m = {.scene = a->request.name,
			     .machine = "the farm in its current state",
			     .request = &a->render.plan,
			     .plan = &p.render,
			     .pilot = &p.plan,
			     .looks = looks,
			     .cpu_seconds = p.outcome.cpu_seconds,
			     .seconds = p.outcome.bootstrap_seconds + (last ? last->seconds : 0),
			     .bootstrap_cpu_seconds = p.outcome.bootstrap_cpu_seconds,
			     .bootstrap_seconds = p.outcome.bootstrap_seconds,
			     .target = a->render.plan.target_error,
			     .speed = last && last->cpu_seconds > 0 ? last->work / last->cpu_seconds : 0};
	return client_local_error(estimate_report(&m, a->json, a->plot, e));
}

/* Checks that the coordinator will be able to make a plan of the request. */
static int check_plan(const struct arguments *a, struct error *e)
{
	struct plan plan;
	return a->estimate ? pilot_render_plan(&a->render.plan, &plan, e) : plan_make(&a->render.plan, &plan, e);
}

/* Measures the speed of a thread, which determines the length of epochs, unless it does not matter for this plan. */
static void measure_speed(struct arguments *a, const struct scene_files *files)
{
	struct plan plan;
	struct error e;
	double speed;
	if (a->estimate || plan_make(&a->render.plan, &plan, &e) || !plan_needs_speed(&a->render.plan, &plan))
		return;
	if (speed_measure(&a->render, files->folder, files->scene, &speed, &e)) {
		fprintf(stderr, "hslt-submit: note: no pilot for the length of epochs: %s\n", e.text);
		return;
	}
	a->render.plan.speed = speed;
	fprintf(stderr, "pilot: %.3g %s per second on one thread here\n", speed,
		plan.kind == PLAN_CHAINS ? "mutations" : "samples");
}

/* Checks, before a pilot is rendered, that the coordinator accepts this client. The connection is closed again, since
 * nothing would keep it alive during the pilot. */
static int check_access(const struct arguments *a, struct error *e)
{
	struct client *cl;
	int rc = client_open(&cl, a->coordinator, a->tls, a->insecure, "hslt-submit", e);
	if (rc)
		return rc;
	client_print_notes(cl, "hslt-submit");
	client_close(cl);
	return 0;
}

/* Returns the name of a job without --name: that of the scene file, cut to fit and made valid UTF-8. */
static const char *default_job_name(const char *file, char name[JOB_NAME_MAX + 1])
{
	text_copy(name, JOB_NAME_MAX + 1, file);
	text_clean(name);
	return name;
}

static void print_notes(const struct arguments *a, const struct scene_files *files)
{
	char note[512];
	for (size_t i = 0; render_scene_note(&files->summary, i, note, sizeof note); i++)
		source_place_print(stderr, "hslt-submit: note: ", a->render.scene, note);
}

int main(int argc, char **argv)
{
	static struct arguments a; /* too large for the stack */
	struct scene_files files;
	struct client *cl;
	struct error e;
	int code = 0;
	a.request.args = &a.render;
	crash_install_exit_handler("hslt-submit");
	program_parse_options(&program, argc, argv, &a);
	struct output_files outputs = list_outputs(&a);
	int rc = output_files_check(&outputs, &a.render.scene, 1, &e);
	if (!rc)
		rc = scene_files_read(&files, a.render.scene, &a.render, &outputs, &e);
	if (rc) {
		source_place_print(stderr, "hslt-submit: ", a.render.scene, e.text);
		return 1;
	}
	for (size_t i = 0; i < files.note_count; i++)
		source_place_print(stderr, "note: ", a.render.scene, files.notes[i]);
	rc = a.estimate ? pilot_plan_from_scene(&a.render, &files.summary, &e)
			: render_plan_from_scene(&a.render, &files.summary, &e);
	if (rc) {
		fprintf(stderr, "hslt-submit: %s\n", e.text);
		scene_files_fini(&files);
		return rc == -EINVAL ? 2 : 1;
	}
	char note[512], name[JOB_NAME_MAX + 1];
	print_notes(&a, &files);
	a.request.output = a.estimate || writes_to_stdout(&a) ? "" : file_name_part(a.render.output);
	a.request.name = a.name ? a.name : default_job_name(files.scene, name);
	if ((rc = check_access(&a, &e))) {
		fprintf(stderr, "hslt-submit: %s\n", e.text);
		scene_files_fini(&files);
		return client_exit_code(rc);
	}
	struct choice choice;
	rc = choice_make(&a.render, files.folder, files.scene, &choice, &e);
	if (!rc)
		rc = check_plan(&a, &e);
	if (rc) {
		fprintf(stderr, "hslt-submit: %s\n", e.text);
		scene_files_fini(&files);
		return rc == -EINVAL ? 2 : 1;
	}
	choice_print(&choice, a.render.plan.integrator);
	option_depth_note(a.render.plan.integrator, a.render.plan.max_depth, note, sizeof note);
	if (*note)
		fprintf(stderr, "hslt-submit: note: %s\n", note);
	measure_speed(&a, &files);
	rc = client_open(&cl, a.coordinator, a.tls, a.insecure, "hslt-submit", &e);
	if (!rc) {
		rc = a.estimate ? run_estimate(&a, cl, &files, &e) : submit_scene(&a, &cl, &files, &code, &e);
		client_close(cl);
	}
	scene_files_fini(&files);
	if (rc)
		fprintf(stderr, "hslt-submit: %s\n", e.text);
	return rc ? client_exit_code(rc) : code;
}
