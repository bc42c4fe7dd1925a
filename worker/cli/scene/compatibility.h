/* SPDX-License-Identifier: Apache-2.0 */
/* Prints docs/compatibility.md, generated from the registries: what is supported of Mitsuba's scenes, and what
 * replaces the rest. */
#ifndef WORKER_CLI_SCENE_COMPATIBILITY_H
#define WORKER_CLI_SCENE_COMPATIBILITY_H

#include <stdio.h>

void compatibility_print(FILE *out);

#endif
