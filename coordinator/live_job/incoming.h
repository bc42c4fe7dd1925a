/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Data that accompanies an event for the core but that the core does not need: an argument of jobs_step_with_data that
 * is passed on to the functions that carry out the core's actions. Fields that do not belong to the event's kind are
 * NULL. The caller keeps everything until jobs_step_with_data returns.
 */
#ifndef COORDINATOR_LIVE_JOB_INCOMING_H
#define COORDINATOR_LIVE_JOB_INCOMING_H

#include "common/base/buf.h"
#include "common/base/error.h"
#include "common/film/batch.h"
#include "common/plan/plan.h"
#include "common/wire/envelope.h"

struct rollback;

/* A job being submitted. */
struct submission {
	struct envelope *envelope; /* taken over by the job if accepted */
	const struct plan *plan;
	const char *epoch_rule;	     /* what the length of its epochs was derived from; "": it was requested */
	const char *owner, *address; /* of the submitter; owner "": no certificate */
	uint64_t job_id;	     /* the new job's id; 0: refused by the core */
};

struct incoming {
	struct error *refusal;	       /* set by jobs_try_step: where the reason of a refusal goes; NULL: not needed */
	struct submission *submission; /* EVENT_SUBMIT */
	struct rollback *rollback;     /* EVENT_LEASE_FAILED: the batch that can be taken back; NULL: none */
	/* EVENT_BATCH, EVENT_STORED_BATCH: */
	struct batch *batch; /* the job takes over its states if it is merged */
	const Farm__LeaseResult *result;
	struct buf *payload;
	/* EVENT_BATCH: the result without its payload, as a frame for the journal; made by durable_reserve_result,
	 * mem_alloc'd */
	unsigned char *frame;
	size_t frame_size;
	/* EVENT_STORED_BATCH: the offset of the result in the journal */
	bool is_stored;
	uint64_t stored_offset;
};

#endif
