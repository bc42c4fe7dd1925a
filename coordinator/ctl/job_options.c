/* SPDX-License-Identifier: Apache-2.0 */
/*
 * hslt-job's command line: a verb, a job, and options, parsed by argp.
 *
 * Happy path: the first word is looked up among the verbs, the second is a job (j12 or 12), a third is the new
 * priority; options fill in the rest of struct job_options, and check() sees that they fit the verb.
 *
 * Failures: a command that makes no sense (unknown verb, no job, a bound for a verb other than extend, no coordinator)
 * ends the program with exit code 2 and a sentence on stderr. Nothing is sent before the whole command is checked.
 */
#include "coordinator/ctl/job_options.h"

#include "common/base/text.h"
#include "common/base/version.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *argp_program_version = "hslt-job " HSLT_VERSION;

static const char doc[] =
	"Looks after jobs at a coordinator."
	"\v"
	"Examples:\n"
	"  hslt-job --coordinator 127.0.0.1:7700 list\n"
	"  hslt-job fetch j12 -o room.exr\n"
	"  hslt-job fetch j12 --preview -o so-far.exr\n"
	"  hslt-job hold j12             no more of its leases go out; those that are out count\n"
	"  hslt-job release j12\n"
	"  hslt-job priority j12 -5      -100 to 100; from the next lease on\n"
	"  hslt-job extend j12 --spp +8  goes on with it, as if that many more had been asked for; done or not\n"
	"  hslt-job extend j12 --target-error 2%\n"
	"  hslt-job cancel j12\n"
	"  hslt-job log j12\n"
	"\n"
	"HSLT_COORDINATOR stands in for --coordinator, HSLT_TLS for --tls. Exit codes: 0 done, 1 failed, 2 usage, 6 refused, 75 coordinator not "
	"reachable.";

#define VERBS "list, hold, release, priority, extend, cancel, fetch, log"

enum {
	OPTION_INSECURE = 256,
	OPTION_JSON,
	OPTION_PREVIEW,
	OPTION_TLS,
	OPTION_SPP,
	OPTION_MUTATIONS,
	OPTION_TIME,
	OPTION_TARGET,
	PRIORITY_MOST = 100
};

static const struct argp_option options[] = {
	{"coordinator", 'c', "HOST:PORT", 0, "The coordinator", 0},
	{"output", 'o', "FILE", 0,
	 "fetch: where to, over what is there (without it: into the current folder, under the last part of the name that hslt-submit was given, never over anything)",
	 0},
	{"preview", OPTION_PREVIEW, NULL, 0, "fetch: what there is while the job runs", 0},
	{"json", OPTION_JSON, NULL, 0, "list: one JSON array", 0},
	{"spp", OPTION_SPP, "+N", 0, "extend: so many more samples a pixel", 0},
	{"mutations", OPTION_MUTATIONS, "+N", 0, "extend: so many more", 0},
	{"time", OPTION_TIME, "+SECONDS", 0, "extend: so much longer", 0},
	{"target-error", OPTION_TARGET, "E", 0,
	 "extend: until the estimated relative error is 0.02 or 2%; bounds that are met and not named end it no more",
	 0},
	{"tls", OPTION_TLS, "DIR", 0, "ca.pem, cert.pem, key.pem: encrypt, and say who we are (hslt-ca makes them)", 0},
	{"insecure", OPTION_INSECURE, NULL, 0, "Connect to other than loopback addresses without encryption", 0},
	{0},
};

static const char *const verbs[JOB_VERBS] = {
	[JOB_LIST] = "list", [JOB_CANCEL] = "cancel",	[JOB_FETCH] = "fetch",	     [JOB_LOG] = "log",
	[JOB_HOLD] = "hold", [JOB_RELEASE] = "release", [JOB_PRIORITY] = "priority", [JOB_EXTEND] = "extend"};

static void take_verb(struct job_options *o, const char *arg, struct argp_state *state)
{
	for (int i = 0; i < JOB_VERBS; i++)
		if (strcmp(arg, verbs[i]) == 0)
			o->verb = (enum job_verb)i;
	if (o->verb == JOB_VERBS)
		argp_error(state, "'%s': the verbs are " VERBS, arg);
}

static void take_job(struct job_options *o, const char *arg, struct argp_state *state)
{
	char *end;
	o->job = strtoull(arg + (*arg == 'j'), &end, 10);
	if (*end || !o->job || arg[*arg == 'j'] < '0' || arg[*arg == 'j'] > '9')
		argp_error(state, "'%s' is no job: expected something like j12", arg);
}

static void take_priority(struct job_options *o, const char *arg, struct argp_state *state)
{
	char *end;
	long n = strtol(arg, &end, 10);
	if (*end || end == arg || n < -PRIORITY_MOST || n > PRIORITY_MOST)
		argp_error(state, "'%s': a priority is from -100 to 100", arg);
	o->priority = (int)n;
	o->has_priority = true;
}

/* Above 0; with a plus sign or without, for it is more in any case. */
static double take_more(const char *option, const char *arg, double most, struct argp_state *state)
{
	char *end;
	double x = strtod(arg, &end);
	if (*end || end == arg || !(x > 0 && x <= most))
		argp_error(state, "%s takes something like +8, not '%s'", option, arg);
	return x;
}

static double take_error(const char *arg, struct argp_state *state)
{
	double x;
	if (!text_ratio(arg, &x) || !(x > 0 && x < 1e3))
		argp_error(state, "--target-error takes something like 0.02 or 2%%, not '%s'", arg);
	return x;
}

static void take_word(struct job_options *o, const char *arg, struct argp_state *state)
{
	if (state->arg_num == 0)
		take_verb(o, arg, state);
	else if (state->arg_num == 1 && o->verb != JOB_LIST)
		take_job(o, arg, state);
	else if (state->arg_num == 2 && o->verb == JOB_PRIORITY)
		take_priority(o, arg, state);
	else
		argp_error(state, "'%s' is one word too many", arg);
}

static void check(const struct job_options *o, struct argp_state *state)
{
	if (o->verb == JOB_VERBS)
		argp_error(state, "what is to be done? " VERBS);
	else if (o->verb != JOB_LIST && !o->job)
		argp_error(state, "%s needs a job", verbs[o->verb]);
	if (o->verb == JOB_PRIORITY && !o->has_priority)
		argp_error(state, "which priority? From -100 to 100");
	bool more = o->more_spp || o->more_mutations || o->more_seconds > 0 || o->target_error > 0;
	if (o->verb == JOB_EXTEND && !more)
		argp_error(state, "by what? --spp, --mutations, --time or --target-error");
	if (o->verb != JOB_EXTEND && more)
		argp_error(state, "bounds are for extend");
	if (!o->coordinator)
		argp_error(state, "--coordinator HOST:PORT is needed (or $HSLT_COORDINATOR)");
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct job_options *o = state->input;
	switch (key) {
	case 'c':
		o->coordinator = arg;
		return 0;
	case 'o':
		o->output = arg;
		return 0;
	case OPTION_SPP:
		o->more_spp = (uint64_t)take_more("--spp", arg, 1e15, state);
		return 0;
	case OPTION_MUTATIONS:
		o->more_mutations = (uint64_t)take_more("--mutations", arg, 1e18, state);
		return 0;
	case OPTION_TIME:
		o->more_seconds = take_more("--time", arg, 1e9, state);
		return 0;
	case OPTION_TARGET:
		o->target_error = take_error(arg, state);
		return 0;
	case OPTION_PREVIEW:
		o->preview = true;
		return 0;
	case OPTION_JSON:
		o->json = true;
		return 0;
	case OPTION_TLS:
		o->tls = arg;
		return 0;
	case OPTION_INSECURE:
		o->insecure = true;
		return 0;
	case ARGP_KEY_ARG:
		take_word(o, arg, state);
		return 0;
	case ARGP_KEY_END:
		check(o, state);
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

void job_options_parse(struct job_options *o, int argc, char **argv)
{
	static char negative[16];
	*o = (struct job_options){
		.coordinator = getenv("HSLT_COORDINATOR"), .tls = getenv("HSLT_TLS"), .verb = JOB_VERBS};
	argp_err_exit_status = 2;
	/* A number below 0 is no option. */
	for (int i = 1; i < argc; i++)
		if (argv[i][0] == '-' && argv[i][1] >= '0' && argv[i][1] <= '9' &&
		    strlen(argv[i]) < sizeof negative - 1) {
			snprintf(negative, sizeof negative, " %s", argv[i]);
			argv[i] = negative;
		}
	argp_parse(&(struct argp){options, parse, "VERB [JOB] [PRIORITY]", doc, NULL, NULL, NULL}, argc, argv, 0, NULL,
		   o);
}
