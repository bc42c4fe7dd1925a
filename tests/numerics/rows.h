/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Rows of `make test-numerics`, separated by tabs: topic, case, measured value, bound, verdict. Without
 * HSLT_TEST_ROWS=1 only failed rows are printed.
 */
#ifndef TESTS_NUMERICS_ROWS_H
#define TESTS_NUMERICS_ROWS_H

#include "tests/support/test_length.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

struct rows {
	unsigned cases, failed;
};

static inline void rows_add(struct rows *r, const char *topic, const char *name, const char *measured,
			    const char *bound, bool ok)
{
	r->cases++;
	r->failed += !ok;
	if (getenv("HSLT_TEST_ROWS") || !ok)
		printf("%s\t%s\t%s\t%s\t%s\n", topic, name, measured, bound, ok ? "ok" : "FAILED");
	fflush(stdout);
}

#endif
