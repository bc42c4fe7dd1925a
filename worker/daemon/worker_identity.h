/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which life of which worker this is, so that a coordinator knows the next one from a stranger: a home, a random number
 * made with the folder (hashed with the machine's name, so that a copy of the folder elsewhere is another home), and
 * how often a worker has started from it. One thread.
 */
#ifndef WORKER_DAEMON_WORKER_IDENTITY_H
#define WORKER_DAEMON_WORKER_IDENTITY_H

#include "common/base/error.h"

#include <stdint.h>

enum { WORKER_IDENTITY_HOME = 33 };

struct worker_identity {
	char home[WORKER_IDENTITY_HOME]; /* hexadecimal; "": nobody counts */
	uint64_t restarts;
};

/* Counts one more in folder/name, for good, before it returns; the caller holds a lock for that name. A file that says
 * nothing begins a new home. Where it cannot be written home is "". */
int worker_identity_begin(struct worker_identity *l, const char *folder, const char *name, struct error *e);

#endif
