/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The plan of an extended job: it gives the same bits as if the job had been submitted with the new bounds and the
 * same groups, chains, bootstrap and epoch. A bound named in the extension is added to the requested bound (or to
 * what is done, if there was none). A bound that is not named and already met is lifted. Pure.
 */
#ifndef COORDINATOR_RETENTION_EXTEND_PLAN_H
#define COORDINATOR_RETENTION_EXTEND_PLAN_H

#include "common/plan/plan.h"

struct extension { /* a member that is 0 is not named */
	uint64_t job;
	uint64_t spp, mutations; /* additional */
	double seconds;		 /* additional */
	double target_error;
};

/* The state of the job to be extended. */
struct extension_basis {
	uint64_t rounds;			 /* complete rounds */
	double seconds;				 /* s of the job's time used so far */
	double error;				 /* relative error as last estimated; NAN: none */
	bool has_ended, was_extension_cancelled; /* was_extension_cancelled: so its bounds no longer apply */
};

/* Returns -EINVAL with a sentence if no bound is named or a number is invalid. */
int extend_check(const struct extension *x, struct error *e);
/*
 * Makes the new plan from p. request: the one that p was made from; on return the request that *out was made from.
 * Returns -EINVAL with a sentence if extend_check fails, if the job would end at once, or if it would have no bound
 * where one is required. Pure.
 */
int extend_plan(const struct plan *p, const struct extension *x, const struct extension_basis *basis,
		struct plan_request *request, struct plan *out, struct error *e);

#endif
