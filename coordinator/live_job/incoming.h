/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What an event brings beyond what the core needs: an argument of jobs_step_with that is passed on to whatever carries
 * out the core's answer. Fields that do not belong to the event's kind are NULL. The caller keeps everything until
 * jobs_step_with returns.
 */
#ifndef COORDINATOR_LIVE_JOB_INCOMING_H
#define COORDINATOR_LIVE_JOB_INCOMING_H

#include "common/base/buf.h"
#include "common/base/error.h"
#include "common/film/batch.h"
#include "common/plan/plan.h"
#include "common/wire/envelope.h"

struct rollback;

/* A submitted job, and the number that it gets. */
struct submission {
	struct envelope *submit; /* taken over by the job if accepted */
	const struct plan *plan;
	const char *rule;	     /* what its epochs' length was derived from; "": it was requested */
	const char *owner, *address; /* of the submitter; owner "": no certificate */
	uint64_t job;		     /* the job's number; 0: refused by the core */
};

struct incoming {
	struct error *refusal;	       /* set by jobs_ask; NULL: nobody asks */
	struct submission *submission; /* EVENT_SUBMIT */
	struct rollback *back;	       /* EVENT_LEASE_FAILED: what can be taken back; NULL: nothing */
	/* EVENT_BATCH, EVENT_STORED */
	struct batch *batch; /* if merged, its states are taken over by the job */
	const Farm__LeaseResult *result;
	struct buf *payload;
	/* EVENT_BATCH: the result for the journal, without the payload; made by durable_reserve, mem_alloc'd */
	unsigned char *frame;
	size_t frame_size;
	/* EVENT_STORED: its place in the journal */
	bool stored;
	uint64_t stored_at;
};

#endif
