/* SPDX-License-Identifier: Apache-2.0 */
/* Writes the report of hslt-accuracy. One thread. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_HTML_H
#define WORKER_CLI_ACCURACY_ACCURACY_HTML_H

#include "worker/cli/accuracy/accuracy.h"

/* Writes the report as one XHTML file. If gnuplot is not installed, the report says so in place of the plots. */
int accuracy_write_html(const struct accuracy_context *x, const char *path, struct error *e);

#endif
