/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job goes on beyond its bounds, while it runs or after it is done: the same bits as if it had been submitted with
 * the later ones. What is named is added to what was asked for (to what is done, where nothing was); a bound that is
 * not named and is met already is lifted. The loop's thread.
 */
#ifndef COORDINATOR_SHELL_EXTEND_H
#define COORDINATOR_SHELL_EXTEND_H

#include "common/net/tls.h"
#include "common/plan/plan.h"

struct jobs;

struct extension { /* 0: not named, all but job */
	uint64_t job;
	uint64_t spp, mutations; /* more */
	double seconds;		 /* more */
	double target_error;
};

/* Who wants it. */
struct requester {
	uint64_t peer;
	char owner[TLS_NAME_MAX + 1]; /* by its certificate; "": none */
	bool unbounded;		      /* quotas do not hold for it */
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

/* Does it, or puts it off until the job's films are free or read; the peer gets its answer (peer_calls.h). One at a
 * time of a peer: another one meanwhile is refused. */
void extend_job(struct jobs *s, const struct requester *by, const struct extension *x);
/* Films are free or read, or a job has ended: those that were put off, in the order in which they came. */
void extend_waiting(struct jobs *s);
void extend_forget(struct jobs *s, uint64_t peer); /* it has gone */

#endif
