/* SPDX-License-Identifier: Apache-2.0 */
/* Prints docs/compatibility.md, generated from the registries: which parts of Mitsuba's scenes are supported, and what
 * --lenient puts in place of the others. */
#ifndef WORKER_CLI_SCENE_COMPATIBILITY_H
#define WORKER_CLI_SCENE_COMPATIBILITY_H

#include <stdio.h>

void compatibility_print(FILE *out);

#endif
