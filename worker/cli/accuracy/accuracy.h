/* SPDX-License-Identifier: Apache-2.0 */
/*
 * hslt-accuracy measures what accuracy costs in time: it renders settings that differ from a default in one value each,
 * alternately, and compares them. Its parts: accuracy_design chooses the settings, accuracy_run renders them,
 * accuracy_judge computes the figures, accuracy_write_csv and accuracy_write_html write the reports.
 */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_H
#define WORKER_CLI_ACCURACY_ACCURACY_H

#include "worker/cli/accuracy/accuracy_judge.h"

/* What a report is made from. */
struct accuracy_context {
	const char *scene, *reference; /* names of files; reference: NULL: the bias is measured against a render */
	const struct accuracy_design *design;
	const struct accuracy_run *run;
	const struct accuracy_judgement *judgement;
};

#endif
