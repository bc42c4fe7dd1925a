/* SPDX-License-Identifier: Apache-2.0 */
/* The start of main. One thread. */
#ifndef COMMON_BASE_PROGRAM_H
#define COMMON_BASE_PROGRAM_H

#include "common/base/option.h"

/* Calls options_parse for main. A usage error exits with 2; --help and the like print and exit with 0. Before that:
 * - standard descriptors that are closed are opened, so that no file of the program gets their numbers;
 * - SIGXFSZ is ignored, so that a write beyond the limit of a file's size fails with EFBIG.
 * When the program exits (other than by _exit) and part of its output on stdout was lost, such as on a full disk, an
 * error is printed and exit code 0 becomes 1. */
void program_parse_options(const struct program *p, int argc, char **argv, void *target);

/* option_row.parse of --verbose: shows debug events in the log. */
int program_parse_verbose(void *target, char *arg, struct error *e);

#endif
