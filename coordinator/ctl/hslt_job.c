/* SPDX-License-Identifier: Apache-2.0 */
/*
 * hslt-job's requests and output: list as a table or as JSON, cancel and the other orders, fetch, log.
 *
 * Each verb sends one message and waits for its answer. A refusal of the coordinator is printed in the coordinator's
 * words, and ends the program with an error.
 */
#include "common/base/progress.h"
#include "common/base/output_target.h"
#include "common/exr/output_files.h"
#include "common/net/client.h"
#include "coordinator/ctl/job_options.h"
#include "coordinator/ctl/worker_table.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { EXIT_CHAINS_DISAGREE = 5 };

static void format_error(const Farm__JobStatus *s, char *text, size_t size)
{
	snprintf(text, size, "-");
	if (s->error >= 0)
		snprintf(text, size, "%.2f %%", 100 * s->error);
	else if (s->error_about >= 0)
		snprintf(text, size, "~%.3g %%", 100 * s->error_about);
}

/* Splits a job's place, such as "3 of 8 machines; j4 comes first": writes the numbers for the column, and returns the
 * rest as a remark. */
static const char *format_machines(const Farm__JobStatus *s, char *text, size_t size)
{
	const char *end = s->ended ? NULL : strstr(s->place, " machine"), *more = end ? strstr(end, "; ") : NULL;
	snprintf(text, size, "%.*s", end ? (int)(end - s->place) : 1, end ? s->place : "-");
	return more ? more + 2 : "";
}

static const char *job_remark(const Farm__JobStatus *s, const char *place)
{
	if (*s->why && strcmp(s->why, s->state) != 0)
		return s->why;
	if (s->ended)
		return s->exit_code == EXIT_CHAINS_DISAGREE ? "its chains disagree" : "";
	return place;
}

static void print_job_row(const Farm__JobStatus *s, bool show_owners)
{
	char eta[32] = "-", machines[48], error[32], id[32];
	if (!s->ended && s->eta >= 0)
		progress_format_time(s->eta, eta, sizeof eta);
	snprintf(id, sizeof id, "j%llu", (unsigned long long)s->job);
	const char *remark = job_remark(s, format_machines(s, machines, sizeof machines));
	format_error(s, error, sizeof error);
	printf("%-6s %-10s %4d %5.1f %% %-9s %-8s %8s ", id, s->state, s->priority, 100 * s->progress, eta, machines,
	       error);
	if (show_owners)
		printf("%-12s ", *s->owner ? s->owner : "-");
	printf("%s", s->name);
	if (*remark)
		printf("  # %s", remark);
	else if (s->ended && strcmp(s->reason, "error") == 0) /* "ended by error" would read like a failure */
		printf("  # target error reached");
	else if (s->ended && s->target_error > 0 && strcmp(s->reason, s->state) != 0)
		printf("  # ended by %s", s->reason);
	printf("\n");
}

static bool matches_state(const struct job_options *o, const Farm__JobStatus *s)
{
	return !o->state_filter || strcmp(s->state, o->state_filter) == 0;
}

/* Prints a column of owners if any job has one; owners are known only with certificates. */
static void print_table(const Farm__JobListAnswer *a, const struct job_options *o)
{
	bool show_owners = false;
	for (size_t i = 0; i < a->n_jobs; i++)
		show_owners = show_owners || *a->jobs[i]->owner;
	printf("%-6s %-10s %4s %7s %-9s %-8s %8s %s%s\n", "JOB", "STATE", "PRI", "DONE", "ETA", "MACHINES", "ERROR",
	       show_owners ? "OWNER        " : "", "NAME");
	for (size_t i = 0; i < a->n_jobs; i++)
		if (matches_state(o, a->jobs[i]))
			print_job_row(a->jobs[i], show_owners);
}

static void print_json_list(const json_t *list)
{
	json_dumpf(list, stdout, JSON_INDENT(2));
	putchar('\n');
}

static void print_json(const Farm__JobListAnswer *a, const struct job_options *o)
{
	json_t *list = json_array();
	for (size_t i = 0; i < a->n_jobs; i++) {
		const Farm__JobStatus *s = a->jobs[i];
		char id[32];
		if (!matches_state(o, s))
			continue;
		snprintf(id, sizeof id, "j%llu", (unsigned long long)s->job);
		json_array_append_new(list,
				      json_pack("{s:i s:s s:s s:s s:f s:i s:s s:s s:s s:b s:i s:s s:s s:i s:f s:s}",
						"schema", 1, "id", id, "name", s->name, "state", s->state, "progress",
						s->progress, "priority", (int)s->priority, "why", s->why, "reason",
						s->reason, "output", s->output, "result", (int)s->fetchable, "exitCode",
						(int)s->exit_code, "note", s->note, "owner", s->owner, "workers",
						(int)s->workers, "share", s->share, "place", s->place));
	}
	print_json_list(list);
	json_decref(list);
}

static int list_jobs(struct client *cl, const struct job_options *o, struct error *e)
{
	struct client_message answer;
	int rc = client_call(cl, ENVELOPE(JOB_LIST, job_list), FARM__ENVELOPE__BODY_JOB_LIST_ANSWER, &answer, e);
	if (rc)
		return rc;
	(o->json ? print_json : print_table)(answer.envelope.message->job_list_answer, o);
	client_message_fini(&answer);
	return 0;
}

static json_t *worker_to_json(const Farm__WorkerStatus *w)
{
	return json_pack("{s:i s:s s:s s:I s:i s:i s:I s:s}", "schema", 1, "name", w->name, "state", w->state,
			 "restarts", (json_int_t)w->restarts, "threads", (int)w->threads, "leases", (int)w->leases,
			 "merged", (json_int_t)w->merged, "text", w->text);
}

static void print_workers(const Farm__WorkerListAnswer *a)
{
	if (a->n_workers == 0)
		printf("no workers are connected\n");
	else
		worker_table_print_head();
	for (size_t i = 0; i < a->n_workers; i++) {
		const Farm__WorkerStatus *w = a->workers[i];
		worker_table_print(&(struct worker_row){w->name, w->state, w->text, w->restarts, w->threads, w->leases,
							w->merged});
	}
}

static int list_workers(struct client *cl, const struct job_options *o, struct error *e)
{
	struct client_message answer;
	int rc = client_call(cl, ENVELOPE(WORKER_LIST, worker_list), FARM__ENVELOPE__BODY_WORKER_LIST_ANSWER, &answer,
			     e);
	if (rc)
		return rc;
	const Farm__WorkerListAnswer *a = answer.envelope.message->worker_list_answer;
	json_t *list = json_array();
	for (size_t i = 0; o->json && i < a->n_workers; i++)
		json_array_append_new(list, worker_to_json(a->workers[i]));
	if (o->json)
		print_json_list(list);
	else
		print_workers(a);
	json_decref(list);
	client_message_fini(&answer);
	return 0;
}

/* Prints what was done, if the coordinator's answer does not say it. */
static void print_default_reply(const struct job_options *o)
{
	static const char *const outcomes[] = {
		[JOB_CANCEL] = "cancelled", [JOB_HOLD] = "on hold", [JOB_RELEASE] = "no longer on hold"};
	if (o->verb == JOB_PRIORITY)
		printf("j%llu has priority %d\n", (unsigned long long)o->job, o->priority);
	else if (o->verb < sizeof outcomes / sizeof *outcomes && outcomes[o->verb])
		printf("j%llu is %s\n", (unsigned long long)o->job, outcomes[o->verb]);
}

static int call_and_print_reply(struct client *cl, const Farm__Envelope *m, const struct job_options *o,
				struct error *e)
{
	struct client_message answer;
	int rc = client_call(cl, m, FARM__ENVELOPE__BODY_DONE, &answer, e);
	if (rc)
		return rc;
	const Farm__Done *done = answer.envelope.message->done;
	if (!done->ok)
		rc = error_set(e, ENOENT, "j%llu: %s", (unsigned long long)o->job, done->text);
	else if (*done->text && o->verb == JOB_EXTEND)
		printf("j%llu %s\n", (unsigned long long)o->job, done->text);
	else if (*done->text)
		printf("%s\n", done->text);
	else
		print_default_reply(o);
	client_message_fini(&answer);
	return rc;
}

static int cancel_job(struct client *cl, const struct job_options *o, struct error *e)
{
	return call_and_print_reply(cl, ENVELOPE(CANCEL, cancel, .job = o->job), o, e);
}

static int send_control(struct client *cl, const struct job_options *o, struct error *e)
{
	static const Farm__Verb verbs[] = {[JOB_HOLD] = FARM__VERB__VERB_HOLD,
					   [JOB_RELEASE] = FARM__VERB__VERB_RELEASE,
					   [JOB_PRIORITY] = FARM__VERB__VERB_PRIORITY,
					   [JOB_EXTEND] = FARM__VERB__VERB_EXTEND};
	return call_and_print_reply(cl,
				    ENVELOPE(CONTROL, control, .job = o->job, .verb = verbs[o->verb],
					     .priority = o->priority, .more_spp = o->more_spp,
					     .more_mutations = o->more_mutations, .more_seconds = o->more_seconds,
					     .target_error = o->target_error),
				    o, e);
}

/* Fetches a preview into -o. That may be the name of the final image, which a preview never replaces; then it goes to
 * a file beside it. Both files are checked before anything is fetched, except beside a pipe or a device, which holds
 * no image. */
static int fetch_preview(struct client *cl, const struct job_options *o, struct error *e)
{
	char preview_path[OUTPUT_TARGET_PATH_MAX];
	struct output_target t;
	bool is_renamed = false;
	int rc = client_local_error(client_preview_name(o->output, preview_path, sizeof preview_path, e));
	const struct output_files outputs = {{{"-o", o->output, OUTPUT_EXR}}},
				  preview_outputs = {{{"-o", preview_path, OUTPUT_EXR}}};
	if (!rc)
		rc = client_local_error(output_files_check(&outputs, NULL, 0, e));
	if (!rc)
		rc = client_local_error(output_target_resolve(&t, o->output, e));
	if (!rc && !t.writes_directly)
		rc = client_local_error(output_files_check(&preview_outputs, NULL, 0, e));
	if (!rc)
		rc = client_fetch_preview(cl, o->job, o->output, &is_renamed, e);
	if (!rc && is_renamed)
		fprintf(stderr, "j%llu: preview, the image so far, in %s; %s is for the final image\n",
			(unsigned long long)o->job, preview_path, o->output);
	else if (!rc)
		fprintf(stderr, "j%llu: preview, the image so far, in %s\n", (unsigned long long)o->job,
			output_target_display_name(o->output));
	return rc;
}

static int fetch_image(struct client *cl, const struct job_options *o, struct error *e)
{
	Farm__What what = o->preview ? FARM__WHAT__WHAT_PREVIEW : FARM__WHAT__WHAT_RESULT;
	char name[CLIENT_NAME_BYTES];
	if (o->preview && o->output)
		return fetch_preview(cl, o, e);
	const struct output_files outputs = {{{"-o", o->output, OUTPUT_EXR}}};
	int rc = client_local_error(output_files_check(&outputs, NULL, 0, e));
	if (!rc)
		rc = o->output ? client_fetch(cl, o->job, what, o->output, e)
			       : client_fetch_to_current_folder(cl, o->job, what, name, e);
	if (!rc)
		fprintf(stderr, "j%llu: %s in %s\n", (unsigned long long)o->job,
			o->preview ? "preview, the image so far," : "image",
			o->output ? output_target_display_name(o->output) : name);
	return rc;
}

static int print_log(struct client *cl, const struct job_options *o, struct error *e)
{
	return client_fetch_log(cl, o->job, STDOUT_FILENO, e);
}

/* Returns -ENOENT if the coordinator refuses. */
static int run_verb(struct client *cl, const struct job_options *o, struct error *e)
{
	static int (*const verbs[])(struct client *, const struct job_options *, struct error *) = {
		[JOB_LIST] = list_jobs,	      [JOB_WORKERS] = list_workers,  [JOB_CANCEL] = cancel_job,
		[JOB_FETCH] = fetch_image,    [JOB_LOG] = print_log,	     [JOB_HOLD] = send_control,
		[JOB_RELEASE] = send_control, [JOB_PRIORITY] = send_control, [JOB_EXTEND] = send_control,
	};
	return verbs[o->verb](cl, o, e);
}

int main(int argc, char **argv)
{
	struct job_options o;
	struct client *cl;
	struct error e;
	job_options_parse(&o, argc, argv);
	int rc = client_open(&cl, o.coordinator, o.tls, o.insecure, "hslt-job", &e);
	if (!rc) {
		client_print_notes(cl, "hslt-job");
		rc = run_verb(cl, &o, &e);
		client_close(cl);
	}
	if (rc)
		fprintf(stderr, "hslt-job: %s\n", e.text);
	return rc ? client_exit_code(rc) : 0;
}
