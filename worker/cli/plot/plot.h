/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Draws plots with gnuplot, in a process of its own, without a shell. If gnuplot is not installed, the functions return
 * -ENOENT with a sentence that says what to install; callers continue without a plot. One thread.
 */
#ifndef WORKER_CLI_PLOT_PLOT_H
#define WORKER_CLI_PLOT_PLOT_H

#include "common/base/error.h"
#include "worker/cli/plot/plot_data.h"

/* Draws a plot as an SVG document, 0-terminated, which is freed with mem_free. */
int plot_svg(const struct plot *p, char **svg, size_t *size, struct error *e);
/* Draws a plot into a file, in the format of its extension, .svg or .png. */
int plot_write(const struct plot *p, const char *path, struct error *e);

#endif
