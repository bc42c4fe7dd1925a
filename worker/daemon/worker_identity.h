/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The identity of a worker across restarts, so that a coordinator recognises it: a home, which is a random number made
 * with the folder (hashed with the machine's name, so that a copy of the folder elsewhere is another home), and the
 * number of starts from it. One thread.
 */
#ifndef WORKER_DAEMON_WORKER_IDENTITY_H
#define WORKER_DAEMON_WORKER_IDENTITY_H

#include "common/base/error.h"

#include <stdint.h>

enum { WORKER_IDENTITY_HOME = 33 };

struct worker_identity {
	char home[WORKER_IDENTITY_HOME]; /* hexadecimal; "": starts are not counted */
	uint64_t restarts;
};

/* Increments the count in folder/name, durably; the caller holds a lock for that name. An invalid file starts a new
 * home. If it cannot be written, home is "". */
int worker_identity_begin(struct worker_identity *l, const char *folder, const char *name, struct error *e);

#endif
