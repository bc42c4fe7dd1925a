#include "common/base/progress.h"
#include "common/base/version.h"
#include "common/net/client.h"

#include <argp.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *argp_program_version = "hslt-job " HSLT_VERSION;

static const char doc[] =
	"Looks after jobs at a coordinator."
	"\v"
	"Examples:\n"
	"  hslt-job --coordinator 127.0.0.1:7700 list\n"
	"  hslt-job fetch j12 -o room.exr\n"
	"  hslt-job fetch j12 --preview -o so-far.exr\n"
	"  hslt-job cancel j12\n"
	"  hslt-job log j12\n"
	"\n"
	"HSLT_COORDINATOR stands in for --coordinator, HSLT_TLS for --tls. Exit codes: 0 done, 1 failed, 2 usage, 6 refused, 75 coordinator not "
	"reachable.";

enum { EXIT_DISAGREE = 5, OPTION_INSECURE = 256, OPTION_JSON, OPTION_PREVIEW, OPTION_TLS };

static const struct argp_option options[] = {
	{"coordinator", 'c', "HOST:PORT", 0, "The coordinator", 0},
	{"output", 'o', "FILE", 0, "fetch: where to (the name that hslt-submit was given)", 0},
	{"preview", OPTION_PREVIEW, NULL, 0, "fetch: what there is while the job runs", 0},
	{"json", OPTION_JSON, NULL, 0, "list: one JSON array", 0},
	{"tls", OPTION_TLS, "DIR", 0, "ca.pem, cert.pem, key.pem: encrypt, and say who we are (hslt-ca makes them)", 0},
	{"insecure", OPTION_INSECURE, NULL, 0, "Connect to other than loopback addresses without encryption", 0},
	{0},
};

struct arguments {
	const char *coordinator, *tls, *output, *verb;
	uint64_t job;
	bool insecure, json, preview;
};

static bool wants_job(const char *verb)
{
	return strcmp(verb, "list") != 0;
}

static void take_word(struct arguments *a, const char *arg, struct argp_state *state)
{
	char *end;
	if (state->arg_num == 0) {
		static const char *const verbs[] = {"list", "cancel", "fetch", "log"};
		for (size_t i = 0; i < sizeof verbs / sizeof *verbs; i++)
			if (strcmp(arg, verbs[i]) == 0)
				a->verb = arg;
		if (!a->verb)
			argp_error(state, "'%s': the verbs are list, cancel, fetch, log", arg);
	} else if (state->arg_num == 1 && a->verb && wants_job(a->verb)) {
		a->job = strtoull(arg + (*arg == 'j'), &end, 10);
		if (*end || !a->job || arg[*arg == 'j'] < '0' || arg[*arg == 'j'] > '9')
			argp_error(state, "'%s' is no job: expected something like j12", arg);
	} else {
		argp_error(state, "'%s' is one word too many", arg);
	}
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct arguments *a = state->input;
	switch (key) {
	case 'c':
		a->coordinator = arg;
		return 0;
	case 'o':
		a->output = arg;
		return 0;
	case OPTION_PREVIEW:
		a->preview = true;
		return 0;
	case OPTION_JSON:
		a->json = true;
		return 0;
	case OPTION_TLS:
		a->tls = arg;
		return 0;
	case OPTION_INSECURE:
		a->insecure = true;
		return 0;
	case ARGP_KEY_ARG:
		take_word(a, arg, state);
		return 0;
	case ARGP_KEY_END:
		if (!a->verb)
			argp_error(state, "what is to be done? list, cancel, fetch or log");
		if (wants_job(a->verb) && !a->job)
			argp_error(state, "%s needs a job", a->verb);
		if (!a->coordinator)
			argp_error(state, "--coordinator HOST:PORT is needed (or $HSLT_COORDINATOR)");
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

/* ---- list ---- */

static void print_table(const Farm__JobListAnswer *a)
{
	if (a->n_jobs)
		printf("%-6s %-10s %4s %7s %-9s %s\n", "JOB", "STATE", "PRI", "DONE", "ETA", "NAME");
	for (size_t i = 0; i < a->n_jobs; i++) {
		const Farm__JobStatus *s = a->jobs[i];
		char eta[32] = "-", id[32];
		if (!s->ended && s->eta >= 0)
			progress_time(s->eta, eta, sizeof eta);
		snprintf(id, sizeof id, "j%llu", (unsigned long long)s->job);
		const char *why = *s->why ? s->why : s->ended && s->exit_code == EXIT_DISAGREE ? "its chains disagree" : "";
		printf("%-6s %-10s %4d %5.1f %% %-9s %s", id, s->state, s->priority, 100 * s->progress, eta, s->name);
		if (*why)
			printf("  # %s", why);
		else if (s->ended && s->target_error > 0)
			printf("  # ended by %s", s->reason);
		printf("\n");
	}
}

static void print_json(const Farm__JobListAnswer *a)
{
	json_t *list = json_array();
	for (size_t i = 0; i < a->n_jobs; i++) {
		const Farm__JobStatus *s = a->jobs[i];
		char id[32];
		snprintf(id, sizeof id, "j%llu", (unsigned long long)s->job);
		json_array_append_new(list, json_pack("{s:i s:s s:s s:s s:f s:i s:s s:s s:s s:b s:i s:s}", "schema", 1, "id", id,
						      "name", s->name, "state", s->state, "progress", s->progress, "priority",
						      (int)s->priority, "why", s->why, "reason", s->reason, "output",
						      s->output, "result", (int)s->fetchable, "exitCode",
						      (int)s->exit_code, "note", s->note));
	}
	json_dumpf(list, stdout, JSON_INDENT(2));
	putchar('\n');
	json_decref(list);
}

static int list(struct client *cl, const struct arguments *a, struct error *e)
{
	Farm__JobList question;
	Farm__Envelope m;
	struct client_message answer;
	farm__job_list__init(&question);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_JOB_LIST;
	m.job_list = &question;
	int rc = client_call(cl, &m, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER, &answer, e);
	if (rc)
		return rc;
	(a->json ? print_json : print_table)(answer.envelope.message->job_list_answer);
	client_message_fini(&answer);
	return 0;
}

/* ---- cancel, fetch, log ---- */

static int cancel(struct client *cl, const struct arguments *a, struct error *e)
{
	Farm__Cancel question;
	Farm__Envelope m;
	struct client_message answer;
	farm__cancel__init(&question);
	farm__envelope__init(&m);
	question.job = a->job;
	m.body_case = FARM__ENVELOPE__BODY_CANCEL;
	m.cancel = &question;
	int rc = client_call(cl, &m, FARM__ENVELOPE__BODY_DONE, &answer, e);
	if (rc)
		return rc;
	const Farm__Done *done = answer.envelope.message->done;
	if (!done->ok)
		rc = error_set(e, ENOENT, "j%llu: %s", (unsigned long long)a->job, done->text);
	client_message_fini(&answer);
	return rc;
}

static int fetch(struct client *cl, const struct arguments *a, struct error *e)
{
	char output[1024];
	int rc = client_fetch(cl, a->job, a->preview ? FARM__WHAT__WHAT_PREVIEW : FARM__WHAT__WHAT_RESULT, a->output, output,
			      sizeof output, e);
	if (!rc && isatty(STDERR_FILENO))
		fprintf(stderr, "%s\n", output);
	return rc;
}

int main(int argc, char **argv)
{
	struct arguments a = {.coordinator = getenv("HSLT_COORDINATOR"), .tls = getenv("HSLT_TLS")};
	struct client *cl;
	struct error e;
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, "list|cancel|fetch|log [JOB]", doc, NULL, NULL, NULL}, argc, argv, 0, NULL,
		   &a);
	int rc = client_open(&cl, a.coordinator, a.tls, a.insecure, "hslt-job", &e);
	if (!rc) {
		if (strcmp(a.verb, "list") == 0)
			rc = list(cl, &a, &e);
		else if (strcmp(a.verb, "cancel") == 0)
			rc = cancel(cl, &a, &e);
		else if (strcmp(a.verb, "fetch") == 0)
			rc = fetch(cl, &a, &e);
		else
			rc = client_fetch_stream(cl, a.job, FARM__WHAT__WHAT_LOG, STDOUT_FILENO, &e);
		client_close(cl);
	}
	if (rc)
		fprintf(stderr, "hslt-job: %s\n", e.text);
	return rc ? client_exit_code(rc) : 0;
}
