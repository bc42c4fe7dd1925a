/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Prints a prediction: a table of errors and their costs, the same as JSON, and a plot of error against time. One
 * thread.
 */
#ifndef WORKER_CLI_RENDER_ESTIMATE_H
#define WORKER_CLI_RENDER_ESTIMATE_H

#include "common/base/option.h"
#include "common/estimate/forecast.h"

/* The options of programs that predict: rows for a struct `type` with the members estimate, pilot and plot. */
/* clang-format off */
#define ESTIMATE_ROWS(type) \
	{"estimate", 0, NULL, "Render a pilot only and print what smaller errors will cost", OPTION_FLAG(type, estimate)}, \
	{"pilot", 0, "SECONDS", "Length of the pilot (60)", OPTION_SECONDS(type, pilot, 0, 1e9), .excludes_min = true, \
	 .excludes_max = true}, \
	{"plot", 0, "FILE", "Plot the estimate into an .svg or .png", OPTION_TEXT(type, plot)}
/* clang-format on */

struct estimate {
	const char *scene, *machine;	    /* name of the file; where it is rendered, as "this machine, 2 threads" */
	const struct plan_request *request; /* of the render being predicted; each row sets its own target error */
	const struct plan *plan; /* its plan for its own target error, or the one that pilot_request.h chose */
	const struct plan *pilot;
	const struct forecast_history *looks; /* the pilot's estimates of its error */
	double cpu_seconds, seconds;	      /* CPU and wall-clock time of the pilot, its bootstrap included */
	/* The same for its bootstrap; scaled to the samples of the render's. */
	double bootstrap_cpu_seconds, bootstrap_seconds;
	double target; /* an error that is predicted in addition to the usual ones; 0: none */
	double speed;  /* mutations or samples a second of one thread, for plans that depend on it; 0: none does */
};

/* Prints the table or JSON to stdout, and draws a plot if a path is given. Returns -EAGAIN if the pilot has too few
 * estimates for a prediction. */
int estimate_report(const struct estimate *s, bool json, const char *plot, struct error *e);

#endif
