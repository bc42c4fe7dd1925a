/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A temporary file that SIGINT, SIGTERM and SIGHUP remove before they end the process as they would without: at most
 * one at a time. Programs with one thread that do not handle these signals themselves; an ignored one stays ignored.
 */
#ifndef COMMON_BASE_UNFINISHED_H
#define COMMON_BASE_UNFINISHED_H

#include "common/base/error.h"

/* As mkstemp. The path, once it is made, must stay as it is until unfinished_end. Returns the descriptor or -errno. */
int unfinished_begin(char *path, struct error *e);
/* It has another name, or has been removed. */
void unfinished_end(void);

#endif
