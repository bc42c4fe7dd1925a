/* SPDX-License-Identifier: Apache-2.0 */
/* Arguments of options, for programs that read theirs by argp. */
#ifndef COMMON_BASE_OPTION_H
#define COMMON_BASE_OPTION_H

#include <argp.h>

/* The number from least to most that arg is; else argp_error, which ends the program. option: its name in the
 * sentence, "--threads". */
double option_number(struct argp_state *state, const char *option, const char *arg, double least, double most);

#endif
