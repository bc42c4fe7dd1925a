/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator in a process of its own, whose disk calls wait or fail on the test's demand, with one client and one
 * worker. The test and the coordinator share struct staged_disk. One coordinator at a time; a failed check ends the
 * test.
 */
#ifndef TESTS_SUPPORT_STAGED_SERVER_H
#define TESTS_SUPPORT_STAGED_SERVER_H

#include "tests/support/scripted_peer.h"

#include <sqlite3.h>
#include <stdatomic.h>
#include <stddef.h>

enum { STAGED_TWO_TICKS_US = 500000 }; /* the length of two ticks of the coordinator */

struct staged_disk {
	/* hold_checkpoint: the next checkpoint waits before it is renamed to its name, until release_checkpoint. */
	_Atomic bool hold_checkpoint, checkpoint_held, release_checkpoint;
	_Atomic bool fail_folder_flush; /* the flush of its folder then fails */
	_Atomic bool fail_ledger_writes;
	_Atomic unsigned refused_commits; /* number of failed writes to the ledger */
	_Atomic bool no_journal_room;	  /* there is no room for the copy of a journal */
	/* hold_flush: the next flush of a journal waits until release_flush. */
	_Atomic bool hold_flush, flush_held, release_flush;
	_Atomic bool fail_flush; /* the flush then fails */
	/* hold_read: the next reading of a scene's file waits until release_read. */
	_Atomic bool hold_read, read_held, release_read;
	/* fail_allocation: once room is made for a result, the allocation after `allocations_before_failure` further
	 * ones fails. */
	_Atomic bool fail_allocation;
	_Atomic unsigned allocations_before_failure;
};

extern struct staged_disk *staged_disk;

/* The peers, and settings that the test makes before staged_server_start. */
extern struct staged_server {
	struct plan plan; /* made from scripted_peer_plan_request */
	uint64_t journal_bytes, keep_bytes, state_bytes;
	char spool[100];
	struct scripted_peer *client, *worker;
	unsigned acknowledged; /* number of acknowledged results */
} staged_server;

int staged_server_map_disk(void);		       /* called once, before the tests; returns 0 on success */
int staged_server_set_up(void **state);		       /* cmocka's; the tear-down is temporary_folder_tear_down */
void staged_server_start(void);			       /* starts the coordinator; both peers say hello */
void staged_server_end(int signal, bool must_succeed); /* must_succeed: its exit code must be 0 */

uint64_t staged_server_submit(void);
void staged_server_request(const Farm__Envelope *m);		    /* from the client; must succeed */
const char *staged_server_request_refused(const Farm__Envelope *m); /* must be refused; returns the reason */
void staged_server_cancel(uint64_t job);
void staged_server_cancel_unstored(uint64_t job);	    /* must be refused because it cannot be stored */
void staged_server_fail_lease(const struct lease_key *k);   /* the worker reports that it could not compute the lease */
bool staged_server_answer_lease(const struct lease_key *k); /* false: the coordinator hung up */
/* Answers leases until *until is set. keep: if not NULL, receives the first lease of the image, which stays
 * unanswered. */
void staged_server_work_until(const _Atomic bool *until, struct lease_key *keep);
/* Answers leases until the job ends. Returns false if the coordinator hung up. */
bool staged_server_work_to_end(void);
/* Merges half of a job's leases, so that there are films, and kills the coordinator. */
uint64_t staged_server_begin_job(void);
void staged_server_await_state(uint64_t job, const char *state);

/* For sqlite3_auto_extension, which staged_server_start calls in the coordinator: implements fail_ledger_writes. */
int staged_server_hook_commits(sqlite3 *db, const char **text, const struct sqlite3_api_routines *api);
/* Starts a coordinator on the same spool in this process; NULL: it did not start. */
struct server *staged_server_open_in_process(void);

#endif
