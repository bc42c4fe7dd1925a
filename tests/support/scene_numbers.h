/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scene files with some of their numbers made extreme: 0, denormal, 1e-300 to 1e300, other signs, beyond what a double
 * or an integer holds, infinite, no number. Numbers are found in the attributes that hold them (value, x, origin, ...)
 * and in the vertices of an obj file, one by one, also in lists.
 */
#ifndef TESTS_SUPPORT_SCENE_NUMBERS_H
#define TESTS_SUPPORT_SCENE_NUMBERS_H

#include "tests/support/dice.h"

size_t scene_numbers_count(const char *text);

/* A copy (free it) with 1 to 3 numbers replaced; `what` says which by which. NULL: there are no numbers. */
char *scene_numbers_mutate(const char *text, struct dice *d, char *what, size_t what_size);

#endif
