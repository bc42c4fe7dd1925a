/* SPDX-License-Identifier: Apache-2.0 */
/* The figures as comma-separated values. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_CSV_H
#define WORKER_CLI_ACCURACY_ACCURACY_CSV_H

#include "worker/cli/accuracy/accuracy.h"

/* In order; the report explains them as well. */
struct accuracy_column {
	const char *name, *meaning; /* meaning "": the other end of the interval */
};
extern const struct accuracy_column accuracy_columns[]; /* ends with a NULL name */

int accuracy_csv(const struct accuracy_context *x, const char *path, struct error *e);

#endif
