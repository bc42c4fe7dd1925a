/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Plots, drawn by gnuplot as a process of its own: the data goes through its standard input, nothing through a shell.
 * One thread. Where gnuplot is not installed: -ENOENT with a sentence that says what to install; whoever asked goes on
 * without.
 */
#ifndef WORKER_CLI_PLOT_H
#define WORKER_CLI_PLOT_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>

enum plot_style { PLOT_POINTS, PLOT_LINE, PLOT_BAND /* between low and high */ };

struct plot_series {
	const char *name; /* "": not in the legend */
	enum plot_style style;
	size_t count;
	const double *x, *y, *low,
		*high;		   /* [count]; low and high may be NULL: no bars. Not finite: the point is left out */
	const char *const *labels; /* [count], beside the points; NULL: none */
};

struct plot {
	const char *title, *x_label, *y_label;
	bool log_x, log_y;
	size_t series_count;
	const struct plot_series *series;
	const char *const *x_names; /* [x_name_count], at x = 1, 2, ... in place of numbers; NULL: numbers */
	size_t x_name_count;
};

/* An SVG document, 0-terminated; mem_free is the caller's. */
int plot_svg(const struct plot *p, char **svg, size_t *size, struct error *e);
/* A file by its ending: .svg or .png. */
int plot_write(const struct plot *p, const char *path, struct error *e);

#endif
