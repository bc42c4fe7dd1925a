/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a priority means in machines: how many work for a job, and how many would if nothing changed. Of the machines
 * that may work for it, jobs of higher priority take what they can use (a job has at most groups x parts leases at
 * once). The rest is divided equally among the owners of its priority, and each owner's part among its jobs; what
 * somebody cannot use goes to the others. Machines are counted by the leases they ask for. A pure function except for a
 * mark in each owner.
 */
#ifndef COORDINATOR_CORE_SHARE_H
#define COORDINATOR_CORE_SHARE_H

#include "coordinator/core/state.h"

#include <stdbool.h>

struct job;
struct owner;

struct share {
	uint32_t workers;	/* machines that hold its leases */
	uint32_t machines;	/* machines that could */
	double machines_due;	/* machines it would get */
	char place[160];	/* "3 of 8 machines; j4 and j7 come first"; "" when it has ended */
	char owners_place[160]; /* the same without ids of other owners' jobs */
};

void share_of(const struct farm *f, const struct job *j, struct share *out);
bool share_competes(const struct job *a, const struct job *b); /* for at least one worker */

/* The job's owner is limited (owner.h), and nothing of the job was computed yet. */
bool share_is_limited(const struct farm *f, const struct job *j);
uint32_t share_unproven(const struct farm *f, const struct owner *o); /* leases out of such jobs of the owner */

#endif
