/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What an event brought besides what the core needs to know of it: an argument of jobs_step_with, from there on of
 * whatever carries out the core's answer. Of an event each field is set that its kind names, and all else is NULL. The
 * caller keeps all of it until jobs_step_with returns.
 */
#ifndef COORDINATOR_JOB_INCOMING_H
#define COORDINATOR_JOB_INCOMING_H

#include "common/base/buf.h"
#include "common/film/batch.h"
#include "common/plan/plan.h"
#include "common/wire/envelope.h"

struct back;

/* A job that is submitted, and what became of it. */
struct submission {
	struct envelope *submit; /* accepted: it goes over to the job */
	const struct plan *plan;
	const char *rule;	     /* by which its epochs are so long; "": they were asked for */
	const char *owner, *address; /* of whoever submits it; owner "": no certificate */
	uint64_t job;		     /* its number, or 0: the core refused it */
	char refusal[256];	     /* it has a number, but cannot be stored; "": it is */
};

struct incoming {
	struct submission *submission; /* EVENT_SUBMIT */
	struct back *back;	       /* EVENT_LEASE_FAILED: what may be taken back; NULL: nothing */
	/* EVENT_BATCH, EVENT_STORED */
	struct batch *batch; /* merged: its states go over to the job */
	const Farm__LeaseResult *result;
	struct buf *payload;
	/* EVENT_BATCH: the result as the journal takes it, but for the payload; made by durable_reserve, mem_alloc'd */
	unsigned char *frame;
	size_t frame_size;
	/* EVENT_STORED: the journal has it already, there */
	bool stored;
	uint64_t stored_at;
};

#endif
