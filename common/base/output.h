/* SPDX-License-Identifier: Apache-2.0 */
/* Makes a program fail if its output on stdout was lost. */
#ifndef COMMON_BASE_OUTPUT_H
#define COMMON_BASE_OUTPUT_H

/* Call first in main. If the program exits with 0 (other than by _exit) and stdout could not take everything (a full
 * disk), it prints an error and the exit code becomes 1. */
void output_check_at_exit(void);

#endif
