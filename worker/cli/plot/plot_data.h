/* SPDX-License-Identifier: Apache-2.0 */
/* The contents of a plot. */
#ifndef WORKER_CLI_PLOT_PLOT_DATA_H
#define WORKER_CLI_PLOT_PLOT_DATA_H

#include <stdbool.h>
#include <stddef.h>

enum plot_style { PLOT_POINTS, PLOT_LINE, PLOT_BAND /* between low and high */ };

struct plot_series {
	const char *name; /* in the legend; "": not there */
	enum plot_style style;
	size_t count;
	const double *x, *y;	   /* [count]; points that are not finite are left out */
	const double *low, *high;  /* [count], the ends of error bars, or of the band; NULL: no bars */
	const char *const *labels; /* [count], printed beside the points; NULL: none */
};

struct plot {
	const char *title, *x_label, *y_label;
	bool is_log_x, is_log_y;
	size_t series_count;
	const struct plot_series *series;
	const char *const *x_names; /* [x_name_count], printed at x = 1, 2, ... instead of numbers; NULL: numbers */
	size_t x_name_count;
};

#endif
