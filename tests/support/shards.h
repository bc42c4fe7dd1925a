/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Runs a test program as several processes side by side, for tests that spend most of their time waiting; each runs its
 * share of the cases. The output of the others is shown if one of them fails.
 */
#ifndef TESTS_SUPPORT_SHARDS_H
#define TESTS_SUPPORT_SHARDS_H

#include <stdbool.h>

enum { SHARDS = 4 };

/* Starts the other processes. Returns the number of this process's share, from 0. */
unsigned shards_begin(void);
/* In share 0, waits for the others. Returns false if one of them failed. */
bool shards_wait(void);

#endif
