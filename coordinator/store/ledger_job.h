/* SPDX-License-Identifier: Apache-2.0 */
/* A job's row in the ledger (ledger.h). */
#ifndef COORDINATOR_STORE_LEDGER_JOB_H
#define COORDINATOR_STORE_LEDGER_JOB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct ledger_job {
	uint64_t id;
	const char *owner, *name, *version; /* version of the program that accepted it */
	const char *held;		    /* by whom; "": it is not held. Ignored by ledger_add */
	const char *record;		    /* JSON (record.h); "": none */
	uint64_t extended;		    /* number of extensions after its end; as `held` */
	int priority;
	bool mixed;
	double submitted;			/* seconds since 1970 */
	const unsigned char *submission, *plan; /* frames, as common/wire packs them; of an ended job perhaps none */
	size_t submission_size, plan_size;
	/* Ignored by ledger_add and ledger_extend. */
	const char *state;
	double ended;	   /* s since 1970, later than all earlier ends; 0: it has not ended */
	uint64_t revision; /* incremented with every change of the row */
	bool damaged;	   /* when read: the checksum does not match, and nothing of it can be trusted */
};

#endif
