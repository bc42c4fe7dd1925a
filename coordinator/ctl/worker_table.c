/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/ctl/worker_table.h"

#include <inttypes.h>
#include <stdio.h>

void worker_table_print_head(void)
{
	printf("%-24s %-11s %6s %7s %6s %8s %s\n", "WORKER", "STATE", "STARTS", "THREADS", "LEASES", "MERGED",
	       "LAST FAULT");
}

void worker_table_print(const struct worker_row *row)
{
	printf("%-24s %-11s %6" PRIu64 " %7" PRIu64 " %6" PRIu64 " %8" PRIu64 " %s\n", row->name, row->state,
	       row->restart_count, row->threads, row->lease_count, row->merged_count, row->last_fault);
}
