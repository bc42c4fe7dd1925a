/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a program prints about itself, generated from its tables: --help, --usage, --version, the manual page (macros of
 * man(7)) and a bash completion script. One thread.
 */
#ifndef COMMON_BASE_OPTION_PRINT_H
#define COMMON_BASE_OPTION_PRINT_H

#include "common/base/option.h"

#include <stdio.h>

void option_print(const struct program *p, enum option_kind request, FILE *out);

#endif
