/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Runs a test program as several processes side by side, for tests that spend most of their time waiting; each runs its
 * share of the cases. The output of the others is shown if one of them fails.
 */
#ifndef TESTS_SUPPORT_SHARES_H
#define TESTS_SUPPORT_SHARES_H

#include <stdbool.h>

enum { SHARES = 4 };

/* Starts the other processes. Returns the number of this process's share, from 0. */
unsigned shares_begin(void);
/* In share 0, waits for the others. Returns false if one of them failed. */
bool shares_pass(void);

#endif
