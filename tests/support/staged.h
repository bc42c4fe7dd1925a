/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator in a process of its own, whose disk calls wait or fail on the test's demand, with one client and one
 * worker. The test and the coordinator share struct staged_disk. One coordinator at a time; a failed check ends the
 * test.
 */
#ifndef TESTS_SUPPORT_STAGED_H
#define TESTS_SUPPORT_STAGED_H

#include "tests/support/scripted.h"

#include <sqlite3.h>
#include <stdatomic.h>
#include <stddef.h>

enum { STAGED_TICKS_US = 500000 }; /* the length of two ticks of the coordinator */

struct staged_disk {
	/* hold_up: the next checkpoint waits before it is renamed to its name, until go_on. */
	_Atomic bool hold_up, held_up, go_on;
	_Atomic bool fail_folder; /* the flush of its folder then fails */
	_Atomic bool fail_ledger; /* writes to the ledger fail */
	_Atomic unsigned refused; /* number of failed writes to the ledger */
	_Atomic bool no_room;	  /* there is no room for the copy of a journal */
	/* hold_flush: the next flush of a journal waits until end_flush. */
	_Atomic bool hold_flush, held_flush, end_flush;
	_Atomic bool fail_flush; /* the flush then fails */
	/* hold_read: the next reading of a scene's file waits until end_read. */
	_Atomic bool hold_read, held_read, end_read;
	/* fail_memory: once room is made for a result, the allocation after `allocations` further ones fails. */
	_Atomic bool fail_memory;
	_Atomic unsigned allocations;
};

extern struct staged_disk *staged_disk;

/* The peers, and settings that the test makes before staged_start. */
extern struct staged {
	struct plan plan; /* made from scripted_request */
	uint64_t journal_bytes, keep_bytes, state_bytes;
	char spool[100];
	struct scripted *client, *worker;
	unsigned acknowledged; /* number of acknowledged results */
} staged;

int staged_open(void);			/* called once, before the tests; returns 0 on success */
int staged_set_up(void **state);	/* cmocka's; the tear-down is folder_tear_down */
void staged_start(void);		/* starts the coordinator; both peers say hello */
void staged_end(int signal, bool well); /* well: its exit code must be 0 */

uint64_t staged_submit(void);
void staged_order(const Farm__Envelope *m);	     /* from the client; must succeed */
const char *staged_refusal(const Farm__Envelope *m); /* must be refused; returns the reason */
void staged_cancel(uint64_t job);
void staged_cancel_unstored(uint64_t job);     /* must be refused because it cannot be stored */
void staged_fail(const struct lease_key *k);   /* the worker reports that it could not compute the lease */
bool staged_answer(const struct lease_key *k); /* false: the coordinator hung up */
/* Answers leases until *until is set. keep: if not NULL, receives the first lease of the image, which stays
 * unanswered. */
void staged_work(const _Atomic bool *until, struct lease_key *keep);
/* Answers leases until the job ends. Returns false if the coordinator hung up. */
bool staged_work_on(void);
/* Merges half of a job's leases, so that there are films, and kills the coordinator. */
uint64_t staged_begin_a_job(void);
void staged_await_state(uint64_t job, const char *state);

/* For sqlite3_auto_extension, which staged_start calls in the coordinator: implements fail_ledger. */
int staged_hook_commits(sqlite3 *db, const char **text, const struct sqlite3_api_routines *api);
/* Starts a coordinator on the same spool in this process; NULL: it did not start. */
struct server *staged_open_here(void);

#endif
