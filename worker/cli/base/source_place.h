/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Messages about a scene begin with a file and a line, "room.xml:12: ...". Names are relative to the scene's folder, as
 * they are stored in images and on farms; printed messages get the folder in front, so that the file can be opened from
 * the current folder.
 */
#ifndef WORKER_CLI_BASE_SOURCE_PLACE_H
#define WORKER_CLI_BASE_SOURCE_PLACE_H

#include <stdio.h>

/* Prints `label`, the text and a newline. If the text begins with a line of a file in the scene's folder, or with the
 * name of the scene file, the folder is printed before it, as it is written in `scene`, the argument of the command
 * line. Any thread. */
void source_place_print(FILE *to, const char *label, const char *scene, const char *text);

#endif
