/* SPDX-License-Identifier: Apache-2.0 */
/* The report. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_HTML_H
#define WORKER_CLI_ACCURACY_ACCURACY_HTML_H

#include "worker/cli/accuracy/accuracy.h"

/* One XHTML file. Without gnuplot it says so and has no plots. */
int accuracy_html(const struct accuracy_context *x, const char *path, struct error *e);

#endif
