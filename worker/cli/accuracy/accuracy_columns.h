/* SPDX-License-Identifier: Apache-2.0 */
/* The columns of hslt-accuracy's CSV, in order, with what they mean; the report explains them. */
#ifndef WORKER_CLI_ACCURACY_COLUMNS_H
#define WORKER_CLI_ACCURACY_COLUMNS_H

#include "worker/cli/accuracy/accuracy.h"
#include "worker/cli/base/text_file.h"

struct accuracy_column {
	const char *name, *meaning; /* meaning "": the other end of the interval */
};
extern const struct accuracy_column accuracy_columns[]; /* ends with a NULL name */

#endif
