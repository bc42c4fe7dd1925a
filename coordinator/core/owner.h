/* SPDX-License-Identifier: Apache-2.0 */
/* Owners of jobs, one per name; reference-counted by their jobs. */
#ifndef COORDINATOR_CORE_OWNER_H
#define COORDINATOR_CORE_OWNER_H

#include "coordinator/core/list.h"

#include <stdint.h>

enum { OWNER_NAME_SIZE = 72 };

struct owner {
	struct link link; /* in farm.owners */
	uint32_t reference_count;
	uint32_t outstanding_lease_count; /* by all jobs of this owner */
	double wanted_machines;		  /* machines that its jobs could use; scratch of share.c */
	uint32_t limitation_count;	  /* number of times that a job of this owner ended workers */
	double limited_until;		  /* -INFINITY: not limited */
	char name[OWNER_NAME_SIZE];
};

/* The owner of this name, made if necessary; NULL: out of memory. */
struct owner *owner_acquire(struct link *owners, const char *name);
void owner_release(struct owner *o); /* ends a reference; o may be NULL */

/* Limits an owner whose job has ended workers: for 60 s, doubled each time up to 64 minutes, those jobs of the owner
 * of which nothing was computed yet get one lease at a time. The count is forgotten with the owner's last job. */
void owner_limit(struct owner *o, double now);

#endif
