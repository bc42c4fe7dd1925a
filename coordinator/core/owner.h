/* Whose jobs they are: a name each, counted by its jobs, gone with the last of them. */
#ifndef COORDINATOR_CORE_OWNER_H
#define COORDINATOR_CORE_OWNER_H

#include "coordinator/core/list.h"

#include <stdint.h>

enum { OWNER_NAME = 72 };

struct owner {
	struct link link; /* farm.owners */
	uint32_t uses;
	uint32_t leases_out; /* of all its jobs */
	double wants; /* share.c's */
	char name[OWNER_NAME];
};

struct owner *owner_use(struct link *owners, const char *name); /* NULL: no memory */
void owner_drop(struct owner *o);                               /* NULL: nothing */

#endif
