/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The identity of a worker across restarts, by which a coordinator recognises it: a "home" and the number of starts
 * from it. The home is a random number that is stored in the cache's folder, hashed with the machine's name, so that a
 * copy of the folder on another machine is another home. One thread.
 */
#ifndef WORKER_DAEMON_WORKER_IDENTITY_H
#define WORKER_DAEMON_WORKER_IDENTITY_H

#include "common/base/error.h"

#include <stdint.h>

enum { WORKER_IDENTITY_HOME_SIZE = 33 };

struct worker_identity {
	char home[WORKER_IDENTITY_HOME_SIZE]; /* hexadecimal; "": starts are not counted */
	uint64_t restarts;
};

/* Increments the number of starts in folder/name, durably; the caller holds a lock for that name. If the file is
 * missing or invalid, a new home begins. Returns 0, or -errno if the file cannot be written; the home is then "". */
int worker_identity_count_start(struct worker_identity *l, const char *folder, const char *name, struct error *e);

#endif
