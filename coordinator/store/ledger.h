/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The farm's jobs in an SQLite database (spool/jobs.db; the only user of SQLite): the submission of each, and whether
 * it has ended. WAL, synchronous FULL: everything written is durable when a call returns. Each row has a checksum,
 * because SQLite has none; changing a damaged row fails with -EBADMSG. A job that has ended keeps its row, without the
 * submission, until it is dropped. One thread. The scheme's version is the database's user_version; older ones are
 * upgraded when the database is opened, newer ones refused.
 */
#ifndef COORDINATOR_STORE_LEDGER_H
#define COORDINATOR_STORE_LEDGER_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct ledger;

struct ledger_job {
	uint64_t id;
	const char *owner, *name, *version; /* version of the program that accepted it */
	const char *held;		    /* by whom; "": it is not held. Ignored by ledger_add */
	uint64_t extended;		    /* number of extensions after its end; as `held` */
	int priority;
	bool mixed;
	double submitted;			/* seconds since 1970 */
	const unsigned char *submission, *plan; /* frames, as common/wire packs them */
	size_t submission_size, plan_size;
	/* Ignored by ledger_add and ledger_extend. */
	const char *state;
	double ended;	   /* s since 1970; 0: it has not ended */
	uint64_t revision; /* incremented with every change of the row */
	bool damaged;	   /* when read: the checksum does not match, and nothing of it can be trusted */
};

/* -EPROTO: a later version; -EBADMSG: damaged. */
int ledger_open(struct ledger **l, const char *path, struct error *e);
void ledger_close(struct ledger *l); /* l may be NULL */
/* Writes a row, including its revision, to replace one that was lost or damaged. */
int ledger_put(struct ledger *l, const struct ledger_job *j, struct error *e);
int ledger_forget(struct ledger *l, uint64_t id, struct error *e); /* deletes it, whatever it is */
int ledger_add(struct ledger *l, const struct ledger_job *j, struct error *e);
/* The job has ended, after this many extensions; ignored for one that was extended since. */
int ledger_end(struct ledger *l, uint64_t id, uint64_t extended, const char *state, struct error *e);
int ledger_drop(struct ledger *l, const uint64_t *ids, size_t count,
		struct error *e); /* deletes these rows at once; none may be of a live job */
int ledger_hold(struct ledger *l, uint64_t id, const char *who, struct error *e); /* "": release */
int ledger_priority(struct ledger *l, uint64_t id, int priority, struct error *e);
/* Sets another submission, plan and number of extensions; a job that has ended runs again. -ENOENT */
int ledger_extend(struct ledger *l, const struct ledger_job *j, struct error *e);
/* The live job with the smallest id above `after`; its texts and bytes are valid until the next call. 1: found; 0:
 * no more. */
int ledger_next(struct ledger *l, uint64_t after, struct ledger_job *j, struct error *e);
/* As ledger_next, including jobs that have ended. */
int ledger_after(struct ledger *l, uint64_t after, struct ledger_job *j, struct error *e);
/* That job, ended or not; valid until the next call of this. 0: not found. */
int ledger_get(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e);

#endif
