/* SPDX-License-Identifier: Apache-2.0 */
/* Writes the figures of all settings as comma-separated values. One thread. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_CSV_H
#define WORKER_CLI_ACCURACY_ACCURACY_CSV_H

#include "worker/cli/accuracy/accuracy.h"

/* The columns, in order, which are also explained in the HTML report. */
struct accuracy_column {
	const char *name, *meaning; /* meaning "": the upper end of the interval that begins in the column before */
};
extern const struct accuracy_column accuracy_columns[]; /* ends with a row whose name is NULL */

int accuracy_write_csv(const struct accuracy_context *x, const char *path, struct error *e);

#endif
