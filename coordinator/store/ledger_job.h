/* SPDX-License-Identifier: Apache-2.0 */
/* A job's row in the ledger (ledger.h). */
#ifndef COORDINATOR_STORE_LEDGER_JOB_H
#define COORDINATOR_STORE_LEDGER_JOB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct ledger_job {
	uint64_t id;
	const char *owner, *name, *version; /* version: that of the program that accepted the job */
	const char *holder;		    /* the user who holds it; "": not held. Ignored by ledger_add */
	const char *record;		    /* JSON (record.h); "": none */
	uint64_t extended;		    /* number of extensions after its end. Ignored by ledger_add */
	int priority;
	bool is_mixed;
	double submitted;			/* seconds since 1970 */
	const unsigned char *submission, *plan; /* frames, as common/wire packs them; an ended job may have none */
	size_t submission_size, plan_size;
	/* The following are ignored by ledger_add and ledger_extend_job. */
	const char *state;
	double end_time;   /* s since 1970, later than all earlier ends; 0: not ended */
	uint64_t revision; /* incremented with every change of the row */
	bool is_damaged;   /* set by reading: the checksum does not match, so only id can be relied on */
};

#endif
