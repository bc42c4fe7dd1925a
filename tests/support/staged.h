/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator in a process of its own, whose disk calls wait or fail when the test says so, with one client and one
 * worker. The test and the coordinator share struct staged_disk. One coordinator at a time; a check that fails ends
 * the test.
 */
#ifndef TESTS_SUPPORT_STAGED_H
#define TESTS_SUPPORT_STAGED_H

#include "tests/support/scripted.h"

#include <sqlite3.h>
#include <stdatomic.h>
#include <stddef.h>

enum { STAGED_TICKS_US = 500000 }; /* two ticks of the coordinator */

struct staged_disk {
	/* hold_up: the next checkpoint waits before it is renamed to its name, until go_on. */
	_Atomic bool hold_up, held_up, go_on;
	_Atomic bool fail_folder; /* then the flush of its folder fails */
	_Atomic bool fail_ledger; /* nothing can be written to it */
	_Atomic unsigned refused; /* so often was it tried */
	_Atomic bool no_room;	  /* for the copy of a journal */
	/* hold_flush: the next flush of a journal waits until end_flush. */
	_Atomic bool hold_flush, held_flush, end_flush;
	_Atomic bool fail_flush; /* then it fails */
	/* hold_read: the next reading of a scene's file waits until end_read. */
	_Atomic bool hold_read, held_read, end_read;
	/* fail_memory: once room is made for a result, the allocation after so many others fails. */
	_Atomic bool fail_memory;
	_Atomic unsigned allocations;
};

extern struct staged_disk *staged_disk;

/* What the test sets before staged_start, and the peers. */
extern struct staged {
	struct plan plan; /* of scripted_request */
	uint64_t journal_bytes, keep_bytes, state_bytes;
	char spool[100];
	struct scripted *client, *worker;
	unsigned acknowledged; /* results */
} staged;

int staged_open(void);			/* once, before the tests; 0: done */
int staged_set_up(void **state);	/* cmocka's; the tear-down is folder_tear_down */
void staged_start(void);		/* the coordinator; both peers say hello */
void staged_end(int signal, bool well); /* well: its exit code has to be 0 */

uint64_t staged_submit(void);
void staged_order(const Farm__Envelope *m);	     /* to the client; the answer has to be yes */
const char *staged_refusal(const Farm__Envelope *m); /* the answer has to be no: why */
void staged_cancel(uint64_t job);
void staged_cancel_unstored(uint64_t job);     /* the answer has to be that it cannot be stored */
void staged_fail(const struct lease_key *k);   /* the worker could not compute it */
bool staged_answer(const struct lease_key *k); /* false: the coordinator hung up */
/* Answers leases until *until. keep: if not NULL, gets the first lease of the image, which stays unanswered. */
void staged_work(const _Atomic bool *until, struct lease_key *keep);
/* Answers leases until the job ends. false: the coordinator hung up. */
bool staged_work_on(void);
/* Merges half of a job's leases, so that there are films, and kills the coordinator. */
uint64_t staged_begin_a_job(void);
void staged_await_state(uint64_t job, const char *state);

/* For sqlite3_auto_extension, which staged_start calls in the coordinator: fail_ledger counts. */
int staged_hook_commits(sqlite3 *db, const char **text, const struct sqlite3_api_routines *api);
/* A coordinator on the same spool in this process; NULL: it did not start. */
struct server *staged_open_here(void);

#endif
