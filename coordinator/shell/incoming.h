/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What an event brought besides what the core needs to know of it: an argument of server_step_with, from there on of
 * whatever carries out the core's answer. Of an event each field is set that its kind names, and all else is NULL. The
 * caller keeps all of it until server_step_with returns.
 */
#ifndef COORDINATOR_SHELL_INCOMING_H
#define COORDINATOR_SHELL_INCOMING_H

#include "common/base/buf.h"
#include "common/film/batch.h"
#include "common/wire/envelope.h"

struct session;
struct back;

struct incoming {
	struct session *submitter; /* EVENT_SUBMIT */
	struct back *back;	   /* EVENT_LEASE_FAILED: what may be taken back; NULL: nothing */
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
