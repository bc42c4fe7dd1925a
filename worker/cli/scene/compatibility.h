/* SPDX-License-Identifier: Apache-2.0 */
/* docs/compatibility.md, made of the registries: what is read of Mitsuba's scenes, what stands in for the rest. */
#ifndef WORKER_CLI_SCENE_COMPATIBILITY_H
#define WORKER_CLI_SCENE_COMPATIBILITY_H

#include <stdio.h>

void compatibility_print(FILE *out);

#endif
