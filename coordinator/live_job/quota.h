/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Limits on what one owner may use. The owner is the name in a client's certificate or, without TLS, all clients
 * together; operators are exempt. Checked when a job is submitted, before its files are sent; pure.
 */
#ifndef COORDINATOR_LIVE_JOB_QUOTA_H
#define COORDINATOR_LIVE_JOB_QUOTA_H

#include "common/base/error.h"
#include "common/plan/plan.h"

#include <stdint.h>

struct quota {		      /* 0: no limit */
	uint64_t jobs;	      /* live jobs of one owner */
	uint64_t asset_bytes; /* of their files, counted once per job, and of those in transit */
	uint64_t film_bytes;  /* of one job's films, as canvas_bytes */
	uint64_t mutations;   /* or samples of one job; if set, every job must have such a bound */
};

/* What the owner uses already. */
struct quota_use {
	uint64_t jobs, asset_bytes;
};

/* -EDQUOT with a sentence for the client. */
int quota_check(const struct quota *q, const struct quota_use *has, const struct plan *p, uint64_t asset_bytes,
		struct error *e);

#endif
