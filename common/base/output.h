/* SPDX-License-Identifier: Apache-2.0 */
/* What a program says on stdout has been said, or its exit code is not 0. */
#ifndef COMMON_BASE_OUTPUT_H
#define COMMON_BASE_OUTPUT_H

/* First in main: when the program ends, by whatever way but _exit, with 0, and stdout did not take all that was written
 * (a full disk), it says so on stderr and ends with 1. */
void output_check_at_exit(void);

#endif
