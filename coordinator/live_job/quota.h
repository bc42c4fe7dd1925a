/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Limits on what one owner may use. The owner is the name in a client's certificate; without TLS all clients together
 * are one owner. Operators are exempt. Checked when a job is submitted, before its files are sent; pure.
 */
#ifndef COORDINATOR_LIVE_JOB_QUOTA_H
#define COORDINATOR_LIVE_JOB_QUOTA_H

#include "common/base/error.h"
#include "common/plan/plan.h"

#include <stdint.h>

struct quota {		   /* 0: no limit */
	uint64_t max_jobs; /* live jobs of one owner */
	/* Scene files of the owner's live jobs, counted once per job, including those being uploaded. */
	uint64_t max_asset_bytes;
	uint64_t max_film_bytes; /* films of one job, as computed by canvas_bytes */
	uint64_t max_mutations;	 /* mutations or samples of one job; if set, every job must have such a bound */
};

/* The resources that the owner already uses. */
struct quota_usage {
	uint64_t jobs, asset_bytes;
};

/* Returns -EDQUOT with a sentence for the client if the new job would exceed a limit. */
int quota_check(const struct quota *q, const struct quota_usage *usage, const struct plan *p, uint64_t asset_bytes,
		struct error *e);

#endif
