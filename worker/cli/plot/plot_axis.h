/* SPDX-License-Identifier: Apache-2.0 */
/* The ranges of a plot's axes and, for logarithmic axes, tics at round numbers. Pure. */
#ifndef WORKER_CLI_PLOT_PLOT_AXIS_H
#define WORKER_CLI_PLOT_PLOT_AXIS_H

#include "worker/cli/plot/plot_data.h"

enum { PLOT_TICS_MAX = 32 };

struct plot_axis {
	double min, max; /* min < max */
	bool is_log;
	size_t tic_count; /* 0 for a linear axis, for which gnuplot chooses the tics */
	double tics[PLOT_TICS_MAX];
};

/* Returns whether a point can be shown: it is finite and, on logarithmic axes, above 0. */
bool plot_point_is_shown(const struct plot *p, const struct plot_series *s, size_t i);
/* Computes the axes. Returns false if there is no point to show. */
bool plot_axes(const struct plot *p, struct plot_axis *x, struct plot_axis *y);

#endif
