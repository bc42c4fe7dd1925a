/* SPDX-License-Identifier: Apache-2.0 */
/* Owners of jobs: a name each, reference-counted by its jobs. */
#ifndef COORDINATOR_CORE_OWNER_H
#define COORDINATOR_CORE_OWNER_H

#include "coordinator/core/list.h"

#include <stdint.h>

enum { OWNER_NAME = 72 };

struct owner {
	struct link link; /* farm.owners */
	uint32_t uses;
	uint32_t leases_out;  /* of all its jobs */
	double wants;	      /* used by share.c */
	uint32_t limits;      /* jobs of this owner that ended workers */
	double limited_until; /* -INFINITY: not limited */
	char name[OWNER_NAME];
};

struct owner *owner_use(struct link *owners, const char *name); /* NULL: out of memory */
void owner_drop(struct owner *o);				/* o may be NULL */

/* A job of this owner has ended workers: for 60 s, twice as long each time up to 64 minutes, those of the owner's
 * jobs of which nothing was computed yet get one lease at a time. Forgotten with the last job. */
void owner_limit(struct owner *o, double now);

#endif
