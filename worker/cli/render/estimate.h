/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Prints a prediction: a table of errors and their costs, the same as JSON, and a plot of error against time. One
 * thread.
 */
#ifndef WORKER_CLI_RENDER_ESTIMATE_H
#define WORKER_CLI_RENDER_ESTIMATE_H

#include "common/base/option.h"
#include "common/estimate/forecast.h"

/* The options of a program that predicts: rows for a struct with these fields. */
/* clang-format off */
#define ESTIMATE_ROWS(type) \
	{"estimate", 0, NULL, "Render a pilot only and print what smaller errors will cost", OPTION_FLAG(type, estimate)}, \
	{"pilot", 0, "SECONDS", "Length of the pilot (60)", OPTION_SECONDS(type, pilot, 0, 1e9), .above = true, \
	 .below = true}, \
	{"plot", 0, "FILE", "Plot the estimate into an .svg or .png", OPTION_TEXT(type, plot)}
/* clang-format on */

struct estimate {
	const char *scene, *where; /* "this machine, 2 threads" */
	const struct plan *plan;   /* of the render being predicted */
	const struct plan *pilot;
	const struct forecast_history *looks; /* of the pilot */
	double cpu_seconds, seconds;	      /* of the pilot, including its bootstrap */
	double bootstrap_cpu,
		bootstrap_seconds; /* of the pilot's bootstrap; the render's is longer by the ratio of samples */
	double target;		   /* requested in addition to the usual ones; 0: none */
};

/* Prints the table or JSON to stdout, and draws a plot if a path is given. -EAGAIN: the pilot has not seen enough
 * for a prediction. */
int estimate_report(const struct estimate *s, bool json, const char *plot, struct error *e);

#endif
