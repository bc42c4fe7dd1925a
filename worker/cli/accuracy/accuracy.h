/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What accuracy costs in time: settings around a default, each with one change, rendered alternately and compared. The
 * parts: design (which settings), run (rendering), judge (figures), csv and html (reports).
 */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_H
#define WORKER_CLI_ACCURACY_ACCURACY_H

#include "worker/cli/accuracy/accuracy_judge.h"

/* Further contents of a report. */
struct accuracy_context {
	const char *scene, *reference; /* names; reference: NULL: none */
	const struct accuracy_design *design;
	const struct accuracy_run *run;
	const struct accuracy_judgement *judgement;
};

#endif
