/* SPDX-License-Identifier: Apache-2.0 */
/* The table of connected workers that hslt-status and hslt-job print. */
#ifndef COORDINATOR_CTL_WORKER_TABLE_H
#define COORDINATOR_CTL_WORKER_TABLE_H

#include <stdint.h>

struct worker_row {
	const char *name, *state, *text; /* text: the last fault, or "" */
	uint64_t restarts, threads, leases, merged;
};

void worker_table_head(void);
void worker_table_print(const struct worker_row *row);

#endif
