/* SPDX-License-Identifier: Apache-2.0 */
/* The start of main. One thread. */
#ifndef COMMON_BASE_PROGRAM_H
#define COMMON_BASE_PROGRAM_H

#include "common/base/option.h"

/* options_parse for main: an error exits with 2, --help and the like with 0. Before that, standard descriptors that are
 * closed are opened, so that no file gets their numbers, and SIGXFSZ is ignored: a write beyond the limit of a file's
 * size is an error of that write. If the program exits with 0 (other than by _exit) and stdout could not take
 * everything (a full disk), it prints an error and the exit code becomes 1. */
void program_options(const struct program *p, int argc, char **argv, void *target);

/* For the row of --verbose. */
int program_take_verbose(void *target, char *arg, struct error *e);

#endif
