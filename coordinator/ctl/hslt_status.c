/* SPDX-License-Identifier: Apache-2.0 */
/*
 * hslt-status: prints what the coordinator's status socket says.
 *
 * It connects, reads the snapshot and prints jobs and workers, or one job with its leases. The snapshot does not
 * contain the details of jobs that have ended, so for such a job it asks for them; with --all it asks for the jobs
 * that ended earlier, page by page. With --watch it subscribes and prints again whenever something changes, until the
 * job has ended. With --json it prints the objects unchanged.
 *
 * If nobody answers, or not a coordinator, it says so and exits with 75. If there is no such job it exits with 1.
 */
#include "common/base/progress.h"
#include "common/base/terminal.h"
#include "common/base/error.h"
#include "common/base/program.h"
#include "common/json/estimate_json.h"
#include "common/estimate/strategy.h"
#include "coordinator/ctl/worker_table.h"

#include <jansson.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

enum { EXIT_UNREACHABLE = 75, LINE_SIZE_MAX = 1 << 26 };

struct arguments {
	const char *socket, *job;
	char job_text[32];
	bool json, watch, all;
};

static const struct option_row option_rows[] = {
	{"socket", 0, "PATH", "The coordinator's status socket", OPTION_TEXT(struct arguments, socket),
	 .environment = "HSLT_STATUS_SOCKET", .is_required = true},
	{"all", 0, NULL, "Also list jobs that ended before the last 50", OPTION_FLAG(struct arguments, all)},
	{"json", 0, NULL, "Print JSON, one object per line", OPTION_FLAG(struct arguments, json)},
	{"watch", 0, NULL, "Print again on every change, until the job has ended",
	 OPTION_FLAG(struct arguments, watch)},
	{0},
};

static int parse_word(void *target, size_t index, char *word, struct error *e)
{
	struct arguments *a = target;
	const char *digits = word + (*word == 'j');
	if (index > 0)
		return error_set(e, EINVAL, "'%s': one job at a time", word);
	if (!*digits || digits[strspn(digits, "0123456789")] || strlen(digits) > 20)
		return error_set(e, EINVAL, "'%s' is not a job: expected something like j12", word);
	snprintf(a->job_text, sizeof a->job_text, "%s%s", *word == 'j' ? "" : "j", word);
	a->job = a->job_text;
	return 0;
}

static int check_arguments(void *target, struct error *e)
{
	const struct arguments *a = target;
	return a->all && a->watch ? error_set(e, EINVAL, "--all and --watch: one or the other") : 0;
}

static const struct program program = {
	.name = "hslt-status",
	.synopsis = "[JOB]",
	.summary = "Shows what a coordinator is doing, from its status socket.",
	.examples = "hslt-status --socket ~/farm/status\n"
		    "hslt-status --watch j12\n"
		    "hslt-status --json | jq '.jobs[] | {id, state, progress}'",
	.details =
		"Lists live jobs, the last 50 jobs that have ended, and the workers. With JOB: that job with its details "
		"and leases. --json prints the socket's objects, one per line, with the details of live jobs; with JOB "
		"only that job's object.",
	.exit_codes = "0 done, 1 no such job, 2 usage, 75 coordinator not reachable",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_arguments},
	.parse_word = parse_word,
};

static FILE *connect_socket(const char *path, struct error *e)
{
	struct sockaddr_un a = {.sun_family = AF_UNIX};
	if (strlen(path) >= sizeof a.sun_path) {
		error_set(e, ENAMETOOLONG, "%s: too long for a socket's path", path);
		return NULL;
	}
	memcpy(a.sun_path, path, strlen(path));
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (fd < 0 || connect(fd, (struct sockaddr *)&a, sizeof a)) {
		error_set(e, ECONNREFUSED, "%s: no coordinator answers: %s", path, strerror(errno));
		if (fd >= 0)
			close(fd);
		return NULL;
	}
	FILE *f = fdopen(fd, "r+");
	if (!f) {
		error_file(e, errno, path);
		close(fd);
	}
	return f;
}

static const char *get_text(const json_t *o, const char *key)
{
	const char *s = json_string_value(json_object_get(o, key));
	return s ? s : "";
}

static double get_number(const json_t *o, const char *key)
{
	return json_number_value(json_object_get(o, key));
}

static bool job_is_ended(const json_t *job)
{
	const char *state = get_text(job, "state");
	return strcmp(state, "done") == 0 || strcmp(state, "failed") == 0 || strcmp(state, "cancelled") == 0;
}

static const char *state_color(const char *state, bool colors)
{
	if (!colors)
		return "";
	return strcmp(state, "done") == 0					  ? "\033[32m"
	       : strcmp(state, "failed") == 0					  ? "\033[31m"
	       : strcmp(state, "running") == 0 || strcmp(state, "bootstrap") == 0 ? "\033[36m"
										  : "\033[33m";
}

/* Says which of several bounds ended a job with a target error. */
static const char *end_reason(const json_t *job)
{
	const char *reason = get_text(job, "reason");
	if (!(get_number(job, "targetError") > 0) || strcmp(get_text(job, "state"), "done") != 0)
		return "";
	return strcmp(reason, "error") == 0	  ? "target error reached"
	       : strcmp(reason, "time") == 0	  ? "the time was up before the target error was reached"
	       : strcmp(reason, "mutations") == 0 ? "all mutations were made before the target error was reached"
						  : "";
}

/* Returns infinity if the bound is null or negative: the range is open. */
static double range_bound(const json_t *range, const char *key)
{
	const json_t *x = json_object_get(range, key);
	return json_is_number(x) && json_number_value(x) >= 0 ? json_number_value(x) : HUGE_VAL;
}

static void print_job(const json_t *job, bool colors)
{
	char rate[32] = "-", eta[32] = "-", error[32] = "-";
	const json_t *eta_value = json_object_get(job, "eta"), *error_value = json_object_get(job, "error");
	if (!job_is_ended(job) && get_number(job, "rate") > 0)
		progress_format_number(get_number(job, "rate"), rate, sizeof rate);
	if (!job_is_ended(job) && json_is_number(eta_value))
		progress_format_time(json_number_value(eta_value), eta, sizeof eta);
	if (json_is_number(error_value))
		snprintf(error, sizeof error, "%.2f %%", 100 * json_number_value(error_value));
	else if (json_is_number(json_object_get(job, "errorAbout")))
		snprintf(error, sizeof error, "~%.3g %%", 100 * get_number(job, "errorAbout"));
	const char *state = get_text(job, "state");
	printf("%-6s %s%-10s%s %5.1f %% %9s %9s %8s %7.0f %6.0f  %s", get_text(job, "id"), state_color(state, colors),
	       state, colors ? "\033[0m" : "", 100 * get_number(job, "progress"), rate, eta, error,
	       get_number(job, "rounds"), get_number(job, "leases"), get_text(job, "name"));
	const char *reason = get_text(job, "why"),
		   *why = *reason && strcmp(reason, state) != 0 ? reason : end_reason(job);
	const char *verdict = get_text(json_object_get(job, "agreement"), "verdict");
	const char *chains = strcmp(verdict, convergence_name(CHAINS_DISAGREE)) == 0 ? "its chains disagree"
			     : job_is_ended(job) && strcmp(verdict, convergence_name(CHAINS_TOO_SHORT)) == 0
				     ? "its chains are too short to be judged"
				     : "";
	if (!*why && !job_is_ended(job))
		why = get_text(job, "place");
	printf("%s%s%s%s\n", *why || *chains ? "  # " : "", why, *why && *chains ? "; " : "", chains);
}

static void print_doubt(const json_t *job)
{
	if (*get_text(job, "errorDoubt") && !job_is_ended(job)) /* once the job has ended, its note says it */
		printf("       the error is about %.3g %%, its interval is not known: %s\n",
		       100 * get_number(job, "errorAbout"), get_text(job, "errorDoubt"));
}

/* Prints "error 3.2 % (3.0 - 3.5 %), target 2 %; halving it takes 6.0 min more, 12 min of CPU time; done in 31 min
 * (25 min - 40 min)". */
static void print_forecast(const json_t *job)
{
	const json_t *error = json_object_get(job, "errorNow"), *halving = json_object_get(job, "nextHalving");
	const json_t *eta = json_object_get(job, "etaRange");
	char a[32], b[32], c[32];
	if (!json_is_object(error))
		return;
	printf("       error %.3g %% (%.3g - %.3g %%)", 100 * get_number(error, "expected"),
	       100 * get_number(error, "low"), 100 * get_number(error, "high"));
	if (get_number(job, "targetError") > 0)
		printf(", target %.3g %%", 100 * get_number(job, "targetError"));
	if (json_is_object(halving)) {
		progress_format_duration(range_bound(json_object_get(halving, "cpuSeconds"), "expected"), a, sizeof a);
		progress_format_duration(range_bound(json_object_get(halving, "wallSeconds"), "expected"), b, sizeof b);
		printf("; halving it takes %s more, %s of CPU time", b, a);
	}
	if (json_is_object(eta)) {
		progress_format_duration(range_bound(eta, "expected"), a, sizeof a);
		progress_format_duration(range_bound(eta, "low"), b, sizeof b);
		progress_format_duration(range_bound(eta, "high"), c, sizeof c);
		printf("; done in %s (%s - %s)", a, b, c);
	}
	printf("\n");
}

/* Prints what the job's priority means: "priority 5, of ann; 3 of 8 machines; j4 comes first; 2.7 due by its priority".
 */
static void print_share(const json_t *job)
{
	if (job_is_ended(job) || !json_is_number(json_object_get(job, "share")))
		return;
	printf("       priority %.0f%s%s; %s; %.3g due by its priority\n", get_number(job, "priority"),
	       *get_text(job, "owner") ? ", of " : "", get_text(job, "owner"), get_text(job, "place"),
	       get_number(job, "share"));
}

static void print_scene_notes(const json_t *job)
{
	size_t i;
	const json_t *note;
	json_array_foreach(json_object_get(job, "sceneNotes"), i, note)
		printf("       note: %s\n", json_string_value(note));
}

static void print_effects(const json_t *job)
{
	size_t i;
	const json_t *effect;
	json_array_foreach(json_object_get(job, "effects"), i, effect)
		printf("       %-3s%-9s %-13s %s; %s: %s\n", json_is_true(json_object_get(effect, "on")) ? "on" : "off",
		       json_is_true(json_object_get(effect, "forced")) ? " (forced)" : "", get_text(effect, "name"),
		       get_text(effect, "why"),
		       json_is_true(json_object_get(effect, "on")) ? "omitting it would save" : "saves",
		       get_text(effect, "saves"));
}

static void print_strategies(const json_t *job)
{
	struct canvas_counts n = {{0}, {{0}}};
	char text[STRATEGY_TABLE_MAX];
	const char *mixture = get_text(job, "mixture");
	if (plan_strategy_count(mixture) < 1)
		return;
	strategy_from_json(json_object_get(job, "strategies"), &n);
	strategy_print_table(mixture, &n, text, sizeof text);
	fputs(text, stdout);
}

static void print_convergence(const json_t *job)
{
	struct convergence a;
	struct path_class_energy classes[PATH_CLASSES];
	char text[CONVERGENCE_TABLE_MAX];
	const json_t *o = json_object_get(job, "agreement");
	if (!json_is_number(json_object_get(job, "b")))
		return;
	convergence_from_json(o, &a);
	classes_from_json(json_object_get(job, "classes"), classes);
	if (json_is_number(json_object_get(o, "rHatWorst")))
		printf("       chains: %s; R-hat %.3g in the median, %.3g in the worst of %u tiles\n",
		       get_text(o, "verdict"), a.median_r_hat, a.max_r_hat, a.tiles);
	convergence_print_table(classes, get_number(job, "b"), &a, text, sizeof text);
	fputs(text, stdout);
}

static void print_workers(const json_t *snapshot)
{
	size_t i;
	const json_t *worker;
	json_array_foreach(json_object_get(snapshot, "workers"), i, worker)
	{
		if (i == 0) {
			putchar('\n');
			worker_table_print_head();
		}
		worker_table_print(&(struct worker_row){
			get_text(worker, "name"), get_text(worker, "state"), get_text(worker, "text"),
			(uint64_t)get_number(worker, "restarts"), (uint64_t)get_number(worker, "threads"),
			(uint64_t)get_number(worker, "leases"), (uint64_t)get_number(worker, "merged")});
	}
	if (i == 0)
		printf("\nno workers are connected\n");
}

static void print_warnings(const json_t *snapshot)
{
	size_t i;
	const json_t *worker, *tls = json_object_get(snapshot, "tls");
	if (*get_text(tls, "warning"))
		printf("\nwarning: %s\n", get_text(tls, "warning"));
	json_array_foreach(json_object_get(snapshot, "workers"), i, worker) if (*get_text(worker, "warning"))
		printf("warning: %s: %s\n", get_text(worker, "name"), get_text(worker, "warning"));
}

static void print_quarantined(const json_t *snapshot)
{
	size_t i;
	const json_t *worker;
	json_array_foreach(json_object_get(snapshot, "quarantined"), i, worker) printf(
		"quarantined: %s%s%s: %s\n", get_text(worker, "name"), *get_text(worker, "certificate") ? " of " : "",
		get_text(worker, "certificate"), get_text(worker, "why"));
}

static void print_verified(const json_t *job)
{
	const json_t *counts = json_object_get(job, "counts");
	if (get_number(job, "verify") > 0)
		printf("       verified: %.3g %% of the epochs; %.0f agreed, %.0f of them not at first\n",
		       100 * get_number(job, "verify"), get_number(counts, "verified"),
		       get_number(counts, "mismatched"));
}

static void print_leases(const json_t *snapshot, const char *id)
{
	size_t i;
	const json_t *lease;
	json_array_foreach(json_object_get(snapshot, "leases"), i, lease) if (strcmp(get_text(lease, "job"), id) == 0)
		printf("       lease %-9s group %2.0f part %2.0f epoch %4.0f  %5.1f s at %s%s\n",
		       get_text(lease, "kind"), get_number(lease, "group"), get_number(lease, "part"),
		       get_number(lease, "epoch"), get_number(lease, "age"), get_text(lease, "worker"),
		       json_is_true(json_object_get(lease, "overdue")) ? " (overdue)" : "");
}

static void print_earlier_count(const json_t *snapshot)
{
	double count = get_number(snapshot, "endedOthers");
	if (count > 0)
		printf("and %.0f that ended earlier: hslt-status --all\n", count);
}

static void print_snapshot(const json_t *snapshot, const char *job_id)
{
	bool colors = terminal_shows_colors(STDOUT_FILENO);
	size_t i;
	const json_t *job;
	printf("%-6s %-10s %7s %9s %9s %8s %7s %6s  %s\n", "JOB", "STATE", "DONE", "RATE/s", "ETA", "ERROR", "ROUNDS",
	       "LEASES", "NAME");
	json_array_foreach(json_object_get(snapshot, "jobs"), i, job)
	{
		if (job_id && strcmp(job_id, get_text(job, "id")) != 0)
			continue;
		print_job(job, colors);
		if (job_id) {
			if (*get_text(job, "note"))
				printf("       note: %s\n", get_text(job, "note"));
			print_share(job);
			print_doubt(job);
			print_forecast(job);
			print_verified(job);
			print_scene_notes(job);
			print_effects(job);
			print_strategies(job);
			print_convergence(job);
			print_leases(snapshot, job_id);
		}
	}
	if (!job_id) {
		print_earlier_count(snapshot);
		print_workers(snapshot);
		print_warnings(snapshot);
		print_quarantined(snapshot);
	}
}

struct status_reader {
	FILE *stream;
	char *line;
	size_t capacity;
};

/* Reads the next line. Returns NULL after printing an error. */
static json_t *read_object(struct status_reader *r)
{
	json_error_t fault;
	ssize_t n = getline(&r->line, &r->capacity, r->stream);
	json_t *o = n > 0 && n < LINE_SIZE_MAX ? json_loadb(r->line, (size_t)n, 0, &fault) : NULL;
	if (!o)
		fprintf(stderr, "hslt-status: %s\n",
			n <= 0 ? "the coordinator is gone"
			: r->line[n - 1] != '\n'
				? "the coordinator closed the connection: it has ended, or this program reads too slowly"
				: "what answers there is not a coordinator");
	return o;
}

/* Sends a text. EPIPE is no error: the coordinator may have hung up already, but what it sent before can still be
 * read. */
static bool send_text(const struct status_reader *r, const char *text)
{
	return send(fileno(r->stream), text, strlen(text), MSG_NOSIGNAL) >= 0 || errno == EPIPE;
}

/* Sends a question and reads on to its answer, an object of this type or an error. Returns NULL after printing an
 * error. */
static json_t *request_object(struct status_reader *r, const char *type, json_t *question)
{
	char *text = json_dumps(question, JSON_COMPACT);
	json_t *o = NULL;
	json_decref(question);
	if (!text || !send_text(r, text) || !send_text(r, "\n"))
		fprintf(stderr, "hslt-status: %s\n", strerror(errno));
	else
		while ((o = read_object(r)) && strcmp(get_text(o, "type"), type) != 0 &&
		       strcmp(get_text(o, "type"), "error") != 0)
			json_decref(o);
	free(text);
	return o;
}

static size_t find_job(const json_t *jobs, const char *id)
{
	size_t i;
	const json_t *job;
	json_array_foreach(jobs, i, job) if (strcmp(get_text(job, "id"), id) == 0) break;
	return i;
}

/* Completes the snapshot by the details of the one job that was asked for, unless it is live and has them already.
 * Returns an exit code. */
static int add_job_details(const struct arguments *a, struct status_reader *r, json_t *snapshot)
{
	json_t *jobs = json_object_get(snapshot, "jobs"), *job = json_array_get(jobs, find_job(jobs, a->job));
	if (job && !job_is_ended(job))
		return 0;
	json_t *answer = request_object(r, "job", json_pack("{s:s}", "job", a->job));
	if (!answer)
		return EXIT_UNREACHABLE;
	bool found = json_is_object(json_object_get(answer, "job"));
	if (found && job)
		json_object_update(job, json_object_get(answer, "job"));
	else if (found)
		json_array_append(jobs, json_object_get(answer, "job"));
	else
		fprintf(stderr, "hslt-status: %s\n", get_text(answer, "text"));
	json_decref(answer);
	return found ? 0 : 1;
}

static int compare_ids(const void *x, const void *y)
{
	const json_t *const *a = x, *const *b = y;
	long long i = atoll(get_text(*a, "id") + 1), k = atoll(get_text(*b, "id") + 1);
	return (i > k) - (i < k);
}

static void sort_jobs(json_t *jobs)
{
	size_t count = json_array_size(jobs);
	json_t **sorted = calloc(count + 1, sizeof *sorted);
	if (!sorted)
		return;
	for (size_t i = 0; i < count; i++)
		sorted[i] = json_incref(json_array_get(jobs, i));
	qsort(sorted, count, sizeof *sorted, compare_ids);
	json_array_clear(jobs);
	for (size_t i = 0; i < count; i++)
		json_array_append_new(jobs, sorted[i]);
	free(sorted);
}

/* Adds the jobs that ended before those of the snapshot. Returns an exit code. */
static int add_earlier_jobs(struct status_reader *r, json_t *snapshot)
{
	json_t *jobs = json_object_get(snapshot, "jobs"), *initial_jobs = json_copy(jobs), *job, *before = json_null();
	size_t i;
	int code = 0;
	while (before && !code) {
		json_t *page = request_object(r, "ended", json_pack("{s:o}", "endedBefore", before));
		if (strcmp(get_text(page, "type"), "ended") != 0)
			code = EXIT_UNREACHABLE;
		if (*get_text(page, "text"))
			fprintf(stderr, "hslt-status: %s\n", get_text(page, "text"));
		json_array_foreach(json_object_get(page, "jobs"), i,
				   job) if (find_job(initial_jobs, get_text(job, "id")) ==
					    json_array_size(initial_jobs)) json_array_append(jobs, job);
		before = json_object_get(page, "before");
		before = json_is_string(before) ? json_incref(before) : NULL;
		json_decref(page);
	}
	json_decref(before);
	json_decref(initial_jobs);
	sort_jobs(jobs);
	json_object_set_new(snapshot, "endedOthers", json_integer(0));
	return code;
}

/* Prints one snapshot in the requested form. Returns false to stop watching. */
static bool print_update(const struct arguments *a, const json_t *snapshot, bool first)
{
	const json_t *jobs = json_object_get(snapshot, "jobs");
	const json_t *job = a->job ? json_array_get(jobs, find_job(jobs, a->job)) : NULL;
	if (a->json) {
		json_dumpf(job ? job : snapshot, stdout, JSON_COMPACT);
		putchar('\n');
	} else {
		if (terminal_moves_cursor(STDOUT_FILENO) && a->watch)
			fputs("\033[H\033[J", stdout);
		else if (!first)
			putchar('\n');
		print_snapshot(snapshot, a->job);
	}
	return !fflush(stdout) && !ferror(stdout) && a->watch && !(job && job_is_ended(job));
}

static int process_snapshots(const struct arguments *a, FILE *f)
{
	struct status_reader r = {.stream = f};
	int code = 0;
	bool first = true, keep_reading = true;
	if (a->watch && !send_text(&r, "{\"subscribe\":[\"snapshot\"]}\n")) {
		fprintf(stderr, "hslt-status: %s\n", strerror(errno));
		return EXIT_UNREACHABLE;
	}
	while (keep_reading) {
		json_t *o = read_object(&r);
		bool snapshot = strcmp(get_text(o, "type"), "snapshot") == 0;
		if (!o) {
			code = EXIT_UNREACHABLE;
		} else if (first && strcmp(get_text(o, "type"), "error") == 0) {
			fprintf(stderr, "hslt-status: %s\n", get_text(o, "text"));
			code = EXIT_UNREACHABLE;
		} else if (snapshot) {
			code = a->job ? add_job_details(a, &r, o) : a->all ? add_earlier_jobs(&r, o) : 0;
			keep_reading = !code && print_update(a, o, first);
			first = false;
		}
		keep_reading = keep_reading && !code;
		json_decref(o);
	}
	free(r.line);
	return code;
}

int main(int argc, char **argv)
{
	struct arguments a = {0};
	struct error e;
	program_parse_options(&program, argc, argv, &a);
	FILE *f = connect_socket(a.socket, &e);
	if (!f) {
		fprintf(stderr, "hslt-status: %s\n", e.text);
		return EXIT_UNREACHABLE;
	}
	int code = process_snapshots(&a, f);
	fclose(f);
	return code;
}
