/* SPDX-License-Identifier: Apache-2.0 */
/* The table of connected workers that hslt-status and hslt-job print. */
#ifndef COORDINATOR_CTL_WORKER_TABLE_H
#define COORDINATOR_CTL_WORKER_TABLE_H

#include <stdint.h>

struct worker_row {
	const char *name, *state, *last_fault; /* last_fault: the last fault, or "" */
	uint64_t restart_count, threads, lease_count, merged_count;
};

void worker_table_print_head(void);
void worker_table_print(const struct worker_row *row);

#endif
