/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a priority means in machines: who computes for a job, and what it would have if all stayed as it is. Of the
 * machines that may work for it jobs of higher priority take what they can use (a job has as many leases at once as
 * groups x parts), what is left goes in equal parts to the owners of its own priority and of each owner to its jobs;
 * what somebody has no use for goes to the others. Machines are counted by the leases that they ask for. A pure
 * function but for a mark in each owner.
 */
#ifndef COORDINATOR_CORE_SHARE_H
#define COORDINATOR_CORE_SHARE_H

#include "coordinator/core/state.h"

#include <stdbool.h>

struct job;
struct owner;

struct share {
	uint32_t workers;	/* that hold its leases */
	uint32_t machines;	/* that might */
	double machines_due;	/* what it would have of them */
	char place[160];	/* "3 of 8 machines; j4 and j7 come first"; "" when it has ended */
	char owners_place[160]; /* the same without the ids of other owners' jobs */
};

void share_of(const struct farm *f, const struct job *j, struct share *out);
bool share_competes(const struct job *a, const struct job *b); /* for some worker, may be */

/* The job is of an owner who is limited (owner.h), and nothing of it was made yet. */
bool share_is_limited(const struct farm *f, const struct job *j);
uint32_t share_unproven(const struct farm *f, const struct owner *o); /* leases out of such jobs of his */

#endif
