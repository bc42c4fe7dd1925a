/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Messages about a scene begin with a file and a line, "room.xml:12: ...", with names relative to the scene's folder,
 * as images and farms keep them. On a terminal they are shown such that the file can be opened from here.
 */
#ifndef WORKER_CLI_BASE_PLACE_H
#define WORKER_CLI_BASE_PLACE_H

#include <stdio.h>

/* Prints `label`, the text and a newline. If the text begins with a file of the scene's folder and a line, the folder
 * comes before them, as in `scene`, the argument of the command line. Any thread. */
void place_print(FILE *to, const char *label, const char *scene, const char *text);

#endif
