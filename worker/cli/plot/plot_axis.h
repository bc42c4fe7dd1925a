/* SPDX-License-Identifier: Apache-2.0 */
/* Ranges of a plot's axes and, if they are logarithmic, marks at round numbers. Pure. */
#ifndef WORKER_CLI_PLOT_AXIS_H
#define WORKER_CLI_PLOT_AXIS_H

#include "worker/cli/plot/plot_data.h"

enum { PLOT_TICS = 32 };

struct plot_axis {
	double low, high; /* low < high */
	bool log;
	size_t tic_count; /* of a logarithmic axis */
	double tic[PLOT_TICS];
};

/* Finite and, if the axis is logarithmic, above 0. */
bool plot_point_shown(const struct plot *p, const struct plot_series *s, size_t i);
/* false: there is no point to show. */
bool plot_axes(const struct plot *p, struct plot_axis *x, struct plot_axis *y);

#endif
