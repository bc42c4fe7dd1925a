/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Plots, drawn by gnuplot in a process of its own: the data goes through its standard input, nothing through a shell.
 * One thread. If gnuplot is not installed: -ENOENT with a sentence that says what to install; callers continue without
 * a plot.
 */
#ifndef WORKER_CLI_PLOT_H
#define WORKER_CLI_PLOT_H

#include "common/base/error.h"
#include "worker/cli/plot/plot_data.h"

/* An SVG document, 0-terminated; the caller frees it with mem_free. */
int plot_svg(const struct plot *p, char **svg, size_t *size, struct error *e);
/* A file, by its ending: .svg or .png. */
int plot_write(const struct plot *p, const char *path, struct error *e);

#endif
