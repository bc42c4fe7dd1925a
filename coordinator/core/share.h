/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a priority means in machines: how many compute a job, and how many would in the long run if nothing changed.
 * Of the machines that may compute it, jobs of higher priority take what they can use (a job has at most groups x
 * parts leases at once). The rest is divided equally among the owners of jobs of its priority, and each owner's part
 * equally among the owner's jobs; what an owner or a job cannot use goes to the others. Machines are counted by the
 * leases they ask for. Pure, except that it uses a scratch member of each owner.
 */
#ifndef COORDINATOR_CORE_SHARE_H
#define COORDINATOR_CORE_SHARE_H

#include "coordinator/core/state.h"

#include <stdbool.h>

struct job;
struct owner;

struct share {
	uint32_t workers;	/* machines that hold leases of the job */
	uint32_t machines;	/* machines that could compute it */
	double machines_due;	/* machines that it would get */
	char place[160];	/* "3 of 8 machines; j4 and j7 come first"; "" if the job has ended */
	char owners_place[160]; /* like `place`, without the ids of other owners' jobs */
};

void share_compute(const struct farm *f, const struct job *j, struct share *out);
bool share_jobs_compete(const struct job *a, const struct job *b); /* whether both could use the same workers */

/* Whether the job's owner is limited (owner.h) and nothing of the job was computed yet. */
bool share_is_limited(const struct farm *f, const struct job *j);
/* Returns how many leases of this owner's jobs that have no result yet are with workers. */
uint32_t share_count_unanswered_leases(const struct farm *f, const struct owner *o);

#endif
