/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The farm's jobs in an SQLite database (spool/jobs.db; the one door to SQLite): who wants what, and whether it has
 * ended. WAL, synchronous FULL: what a call has written is durable when it returns. Each row has a checksum, because
 * SQLite has none; a change of a row that is damaged fails with -EBADMSG. A job that has ended keeps its row without
 * the submission until it is dropped. One thread. The scheme's version is the database's user_version; older ones are
 * brought up to date when the database is opened, newer ones refused.
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
	const char *owner, *name, *version; /* version: of the program that took it */
	const char *held;		    /* by whom; "": it is not. ledger_add does not look at it */
	uint64_t extended;		    /* how often it went on after its end; as held */
	int priority;
	bool mixed;
	double submitted;			/* seconds since 1970 */
	const unsigned char *submission, *plan; /* frames, as common/wire packs them */
	size_t submission_size, plan_size;
	/* Not looked at by ledger_add and ledger_extend. */
	const char *state;
	double ended;	   /* s since 1970; 0: it has not ended */
	uint64_t revision; /* grows with every change of the row */
	bool damaged;	   /* as it was read: its checksum does not fit, nothing of it is to be believed */
};

/* -EPROTO: of a later version; -EBADMSG: it is damaged. */
int ledger_open(struct ledger **l, const char *path, struct error *e);
void ledger_close(struct ledger *l); /* NULL: nothing */
/* A row as it is to be, revision included, instead of one that was lost or damaged. */
int ledger_put(struct ledger *l, const struct ledger_job *j, struct error *e);
int ledger_forget(struct ledger *l, uint64_t id, struct error *e); /* whatever it is */
int ledger_add(struct ledger *l, const struct ledger_job *j, struct error *e);
/* It has ended after so many extensions; one that was extended since goes on. */
int ledger_end(struct ledger *l, uint64_t id, uint64_t extended, const char *state, struct error *e);
int ledger_drop(struct ledger *l, const uint64_t *ids, size_t count,
		struct error *e); /* the rows of these, at once; none of a living job */
int ledger_hold(struct ledger *l, uint64_t id, const char *who, struct error *e); /* "": no longer */
int ledger_priority(struct ledger *l, uint64_t id, int priority, struct error *e);
/* Another submission, plan and number of extensions; a job that has ended runs again. -ENOENT */
int ledger_extend(struct ledger *l, const struct ledger_job *j, struct error *e);
/* The living job with the smallest id above `after`, whose texts and bytes are valid until the next call. 1: it is
 * there; 0: no more. */
int ledger_next(struct ledger *l, uint64_t after, struct ledger_job *j, struct error *e);
/* As ledger_next, but those that have ended, too. */
int ledger_after(struct ledger *l, uint64_t after, struct ledger_job *j, struct error *e);
/* That one, ended or not; until the next call of this. 0: it is not there. */
int ledger_get(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e);

#endif
