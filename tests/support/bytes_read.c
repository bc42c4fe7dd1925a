/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/bytes_read.h"

#include <inttypes.h>
#include <stdio.h>

bool bytes_read_count(uint64_t *bytes)
{
	FILE *f = fopen("/proc/self/io", "r");
	bool is_counted = f && fscanf(f, "rchar: %" SCNu64, bytes) == 1;
	if (f)
		fclose(f);
	return is_counted;
}
