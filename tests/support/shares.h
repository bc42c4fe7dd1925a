/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A test program in several processes side by side, where most of the time somebody waits: each does its share of the
 * runs. What the others print is shown when one of them fails.
 */
#ifndef TESTS_SUPPORT_SHARES_H
#define TESTS_SUPPORT_SHARES_H

#include <stdbool.h>

enum { SHARES = 4 };

/* Makes the others; which share is this process's, from 0. */
unsigned shares_begin(void);
/* In share 0: waits for the others. false: one of them failed. */
bool shares_pass(void);

#endif
