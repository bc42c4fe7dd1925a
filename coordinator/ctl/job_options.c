/* SPDX-License-Identifier: Apache-2.0 */
/*
 * hslt-job's command line: a verb, a job, and options.
 *
 * Happy path: the first word is looked up among the verbs, the second is a job (j12 or 12), a third is the new
 * priority; options fill in the rest of struct job_options, and check_options() checks that they fit the verb.
 *
 * Failures: an invalid command (unknown verb, no job, an option of another verb, no coordinator) exits with
 * 2 and a sentence on stderr. Nothing is sent before the whole command is checked.
 */
#include "coordinator/ctl/job_options.h"

#include "common/base/program.h"
#include "common/exr/output_files.h"

#include <stdlib.h>
#include <string.h>

enum { JOB_PRIORITY_MAX = 100 };

static const char *state_at(size_t i)
{
	static const char *const states[] = {"queued", "bootstrap", "running", "held", "done", "failed", "cancelled"};
	return i < sizeof states / sizeof *states ? states[i] : NULL;
}

static const struct option_row option_rows[] = {
	{"coordinator", 'c', "HOST:PORT", "The coordinator", OPTION_TEXT(struct job_options, coordinator),
	 .environment = "HSLT_COORDINATOR", .is_required = true},
	{"output", 'o', "FILE",
	 "fetch: the output file, replaced only if it is an image; -: stdout (without -o: a file in the current folder, "
	 "named by the last part of the name given to hslt-submit; never replaces a file)",
	 OPTION_OUTPUT(struct job_options, output)},
	{"preview", 0, NULL,
	 "fetch: the image so far, while the job runs; the preview of room.exr goes to room.preview.exr, even with -o room.exr",
	 OPTION_FLAG(struct job_options, preview)},
	{"json", 0, NULL, "list, workers: print one JSON array", OPTION_FLAG(struct job_options, json)},
	{"state", 0, "STATE", "(list: only jobs in this state)", OPTION_TEXT(struct job_options, state_filter),
	 .values = state_at},
	{"spp", 0, "+N", "extend: additional samples per pixel", OPTION_COUNT(struct job_options, more_spp, 1, 1e15)},
	{"mutations", 0, "+N", "extend: additional mutations or samples",
	 OPTION_COUNT(struct job_options, more_mutations, 1, 1e18)},
	{"time", 0, "+SECONDS", "extend: additional time (90, 5m, 2h)",
	 OPTION_SECONDS(struct job_options, more_seconds, 0, 1e9), .excludes_min = true},
	{"target-error", 0, "E",
	 "extend: until the estimated relative error is 0.02 or 2%; bounds already reached and not named here no longer apply",
	 OPTION_RATIO(struct job_options, target_error, 0, 1), .excludes_min = true},
	{"tls", 0, "DIR", "ca.pem, cert.pem, key.pem, made by hslt-ca: encryption and authentication",
	 OPTION_TEXT(struct job_options, tls), .environment = "HSLT_TLS"},
	{"insecure", 0, NULL, "Connect to addresses other than loopback without encryption",
	 OPTION_FLAG(struct job_options, insecure)},
	{0},
};

static const char *const verb_names[JOB_VERBS] = {
	[JOB_LIST] = "list",	   [JOB_WORKERS] = "workers",	[JOB_CANCEL] = "cancel",
	[JOB_FETCH] = "fetch",	   [JOB_LOG] = "log",		[JOB_HOLD] = "hold",
	[JOB_RELEASE] = "release", [JOB_PRIORITY] = "priority", [JOB_EXTEND] = "extend"};

static bool verb_takes_job(enum job_verb verb)
{
	return verb != JOB_LIST && verb != JOB_WORKERS;
}

static const char *verb_at(size_t i)
{
	return i < JOB_VERBS ? verb_names[i] : NULL;
}

static int parse_verb(struct job_options *o, const char *word)
{
	for (int i = 0; i < JOB_VERBS; i++)
		if (strcmp(word, verb_names[i]) == 0)
			o->verb = (enum job_verb)i;
	return 0;
}

static int parse_job(struct job_options *o, const char *word, struct error *e)
{
	char *end;
	errno = 0;
	o->job = strtoull(word + (*word == 'j'), &end, 10);
	if (errno || *end || !o->job || word[*word == 'j'] < '0' || word[*word == 'j'] > '9')
		return error_set(e, EINVAL, "'%s' is not a job: expected something like j12", word);
	return 0;
}

static int parse_priority(struct job_options *o, const char *word, struct error *e)
{
	char *end;
	long n = strtol(word, &end, 10);
	if (*end || end == word || n < -JOB_PRIORITY_MAX || n > JOB_PRIORITY_MAX)
		return error_set(e, EINVAL, "'%s': a priority is from -100 to 100", word);
	o->priority = (int)n;
	o->has_priority = true;
	return 0;
}

static int parse_word(void *target, size_t index, char *word, struct error *e)
{
	struct job_options *o = target;
	if (index == 0)
		return parse_verb(o, word);
	if (index == 1 && verb_takes_job(o->verb))
		return parse_job(o, word, e);
	if (index == 2 && o->verb == JOB_PRIORITY)
		return parse_priority(o, word, e);
	return error_set(e, EINVAL, "unexpected argument '%s'", word);
}

static int check_options(void *target, struct error *e)
{
	const struct job_options *o = target;
	if (verb_takes_job(o->verb) && !o->job)
		return error_set(e, EINVAL, "%s needs a job", verb_names[o->verb]);
	if (o->verb == JOB_PRIORITY && !o->has_priority)
		return error_set(e, EINVAL, "a priority is missing: -100 to 100");
	bool extends = o->more_spp || o->more_mutations || o->more_seconds > 0 || o->target_error > 0;
	if (o->verb == JOB_EXTEND && !extends)
		return error_set(e, EINVAL, "a bound is missing: --spp, --mutations, --time or --target-error");
	if (o->verb != JOB_EXTEND && extends)
		return error_set(e, EINVAL, "bounds are only for extend");
	if (o->verb != JOB_FETCH && (o->output || o->preview))
		return error_set(e, EINVAL, "%s is only for fetch%s", o->output ? "--output" : "--preview",
				 o->verb == JOB_LOG ? ": the log goes to stdout" : "");
	if (verb_takes_job(o->verb) && o->json)
		return error_set(e, EINVAL, "--json is only for list and workers");
	if (o->verb != JOB_LIST && o->state_filter)
		return error_set(e, EINVAL, "--state is only for list");
	const struct output_files outputs = {{{"-o", o->output, OUTPUT_EXR}}};
	return output_files_check_names(&outputs, e);
}

static const struct program program = {
	.name = "hslt-job",
	.synopsis = "VERB [JOB] [PRIORITY]",
	.summary = "Manages the jobs of a coordinator.",
	.examples = "hslt-job --coordinator 127.0.0.1:7700 list\n"
		    "hslt-job list --state running\n"
		    "hslt-job workers\n"
		    "hslt-job fetch j12 -o room.exr\n"
		    "hslt-job fetch j12 --preview -o so-far.exr\n"
		    "hslt-job hold j12             hands out no more of its leases; those already out still count\n"
		    "hslt-job release j12\n"
		    "hslt-job priority j12 -5      -100 to 100; from the next lease on\n"
		    "hslt-job extend j12 --spp +8  continues it, whether running or finished\n"
		    "hslt-job extend j12 --target-error 2%\n"
		    "hslt-job cancel j12\n"
		    "hslt-job log j12",
	.details =
		"list: all jobs; workers: the connected workers; cancel: end a job; fetch: download its image; log: print its log; "
		"hold: hand out no more of its work; "
		"release: end the hold; priority: -100 to 100, higher first; extend: continue it with --spp, --mutations, --time "
		"or --target-error.",
	.exit_codes = "0 done, 1 failed, 2 usage, 6 refused, 75 coordinator not reachable",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
	.verbs = verb_at,
	.parse_word = parse_word,
};

void job_options_parse(struct job_options *o, int argc, char **argv)
{
	*o = (struct job_options){.verb = JOB_VERBS};
	program_parse_options(&program, argc, argv, o);
}
