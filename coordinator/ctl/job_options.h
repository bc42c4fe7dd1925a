/* SPDX-License-Identifier: Apache-2.0 */
/* hslt-job's command line. Texts are borrowed from argv; an invalid command exits with 2. */
#ifndef COORDINATOR_CTL_JOB_OPTIONS_H
#define COORDINATOR_CTL_JOB_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

enum job_verb {
	JOB_LIST,
	JOB_WORKERS,
	JOB_CANCEL,
	JOB_FETCH,
	JOB_LOG,
	JOB_HOLD,
	JOB_RELEASE,
	JOB_PRIORITY,
	JOB_EXTEND,
	JOB_VERBS
};

struct job_options {
	const char *coordinator, *tls, *output;
	const char *state_filter; /* list: only jobs in this state; NULL: all */
	enum job_verb verb;	  /* JOB_VERBS: none given */
	uint64_t job;
	int priority;
	uint64_t more_spp, more_mutations; /* for extend only */
	double more_seconds, target_error;
	bool has_priority, insecure, json, preview;
};

void job_options_parse(struct job_options *o, int argc, char **argv);

#endif
