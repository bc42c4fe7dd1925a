/* SPDX-License-Identifier: Apache-2.0 */
/* Whose jobs they are: a name each, counted by its jobs, gone with the last of them. */
#ifndef COORDINATOR_CORE_OWNER_H
#define COORDINATOR_CORE_OWNER_H

#include "coordinator/core/list.h"

#include <stdbool.h>
#include <stdint.h>

enum { OWNER_NAME = 72 };

struct owner {
	struct link link; /* farm.owners */
	uint32_t uses;
	uint32_t leases_out;  /* of all its jobs */
	double wants;	      /* share.c's */
	uint32_t limits;      /* jobs of his that ended workers */
	double limited_until; /* -INFINITY: is not */
	char name[OWNER_NAME];
};

struct owner *owner_use(struct link *owners, const char *name); /* NULL: no memory */
void owner_drop(struct owner *o);				/* NULL: nothing */

/* A job of his has ended workers: for 60 s, twice as long each time up to 64 minutes, his jobs that nothing has been
 * made of get one lease at a time. Forgotten with the last of his jobs. */
void owner_limit(struct owner *o, double now);

#endif
