/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The plan of an extended job: the same bits as if it had been submitted with the new bounds and the same groups,
 * chains, bootstrap and epoch. A named bound is added to the requested one (or to what is done, if there was none); a
 * bound that is not named and already met is lifted. Pure.
 */
#ifndef COORDINATOR_RETENTION_EXTEND_PLAN_H
#define COORDINATOR_RETENTION_EXTEND_PLAN_H

#include "common/plan/plan.h"

struct extension { /* 0: not named, except for job */
	uint64_t job;
	uint64_t spp, mutations; /* additional */
	double seconds;		 /* additional */
	double target_error;
};

/* The state of a job. */
struct extension_from {
	uint64_t rounds; /* complete */
	double seconds;	 /* time used */
	double error;	 /* as last estimated; NAN: none */
	bool ended, cut; /* cut: an extension was cancelled, and its bounds no longer apply */
};

/* -EINVAL with a sentence: nothing is named, or an invalid number. */
int extend_check(const struct extension *x, struct error *e);
/*
 * Pure. asked: the request behind the plan; becomes the request behind the new one. -EINVAL with a sentence: as above,
 * or the job would end at once, or have no bound where one is required.
 */
int extend_plan(const struct plan *p, const struct extension *x, const struct extension_from *from,
		struct plan_request *asked, struct plan *out, struct error *e);

#endif
