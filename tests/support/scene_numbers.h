/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Replaces some numbers of scene files by extreme ones: 0, denormal, 1e-300 to 1e300, other signs, beyond the range of
 * a double or an integer, infinite, not a number. Numbers are found in the attributes that hold them (value, x, origin,
 * ...) and in the vertices of an OBJ file, individually even within lists.
 */
#ifndef TESTS_SUPPORT_SCENE_NUMBERS_H
#define TESTS_SUPPORT_SCENE_NUMBERS_H

#include "tests/support/dice.h"

size_t scene_numbers_count(const char *text);

/* Returns a copy (to be freed) with 1 to 3 numbers replaced, and describes the replacements in `what`. NULL: there
 * are no numbers. */
char *scene_numbers_mutate(const char *text, struct dice *d, char *what, size_t what_size);

#endif
