/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The plan of a job that goes on beyond its bounds: the same bits as if it had been submitted with the later ones. What
 * is named is added to what was asked for (to what is done, where nothing was); a bound that is not named and is met
 * already is lifted. Pure.
 */
#ifndef COORDINATOR_JOB_EXTEND_PLAN_H
#define COORDINATOR_JOB_EXTEND_PLAN_H

#include "common/plan/plan.h"

struct extension { /* 0: not named, all but job */
	uint64_t job;
	uint64_t spp, mutations; /* more */
	double seconds;		 /* more */
	double target_error;
};

/* Where a job is. */
struct extension_from {
	uint64_t rounds; /* complete */
	double seconds;	 /* that it took */
	double error;	 /* at the last look; NAN: none */
	bool ended;
};

/* -EINVAL with a sentence: nothing is named, or what is no number of them. */
int extend_check(const struct extension *x, struct error *e);
/*
 * Pure. asked: what the plan was made of; becomes what the new one is made of. -EINVAL with a sentence: as above, the
 * job would end at once, or a bound would have to be where there is none.
 */
int extend_plan(const struct plan *p, const struct extension *x, const struct extension_from *from,
		struct plan_request *asked, struct plan *out, struct error *e);

#endif
