/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator's shell in a process of its own, and peers that send whatever a test wants, valid or not. Blocking, one
 * thread, one server at a time; a missing answer fails the test after a minute. Peers receive and hang up as in
 * scripted_peer.h.
 */
#ifndef TESTS_SUPPORT_CHILD_SERVER_H
#define TESTS_SUPPORT_CHILD_SERVER_H

#include "common/plan/plan.h"
#include "tests/support/scripted_peer.h"

/* ---- the server ---- */

/* Starts a server for at most eight connections, two of them with a fetch under way, and scene files of up to 1 MiB.
 * Returns 0 once it listens. Timeouts that a test does not wait for should exceed the pauses of a busy machine. */
int child_server_start(double hello_seconds, double heartbeat_seconds, double stall_seconds);
int child_server_stop(void **state); /* a teardown: fails if the server did not end well */
/* Makes the spool of the next start; NULL: nothing. */
void child_server_set_spool_maker(void (*spool)(const char *path));
/* Contains the spool and the status socket, `status`. If the test creates a file `nomem` there, the next connection
 * gets no memory. */
const char *child_server_folder(void);
void child_server_set_busy(bool busy);		  /* forbids access to the films of its jobs */
long child_server_resident_kilobytes(void);	  /* memory used */
unsigned child_server_turn_count(void);		  /* number of the current turn of its loop; also an input of tests */
unsigned child_server_max_batches_per_turn(void); /* most waiting results taken in one turn since the last call */
unsigned child_server_open_file_count(const char *name); /* number of open files whose path contains this */
void child_server_check_answers(void);
void child_server_await_answers(void); /* once it has noticed that the others hung up */

/* ---- a peer ---- */

struct scripted_peer *child_server_connect(void);
void child_server_send_bytes(const struct scripted_peer *p, const void *bytes, size_t size);
void child_server_send(const struct scripted_peer *p, const Farm__Envelope *m, const void *payload,
		       size_t payload_size);
const Farm__HelloAck *child_server_exchange_hello(struct scripted_peer *p, uint32_t version, Farm__Role role);
void child_server_send_empty(struct scripted_peer *p, Farm__Envelope__BodyCase kind); /* JOB_LIST or LEASE_REQUEST */
void child_server_send_job_get(const struct scripted_peer *p, uint64_t job);

/* ---- jobs ---- */

/* mixture: NULL, or the mutations of the plan. */
struct plan_request child_server_plan_request(const char *mixture);
void child_server_submit(struct scripted_peer *p, const char *mixture, const char *scene_text, const char *file_name,
			 const char *scene_name);
const Farm__SubmitAnswer *child_server_receive_submit_answer(struct scripted_peer *p);
void child_server_send_blob(struct scripted_peer *p, const char *true_text, const char *sent_text);

/* Leases that arrived and have not been answered yet. */
struct pending_leases {
	struct lease_key keys[64];
	size_t count;
	bool job_ended;
};

/* Handles one message. Returns its verdict, or VERDICT_NONE if it was not one. */
Farm__Verdict child_server_handle_message(struct scripted_peer *p, struct pending_leases *pending);
/* Waits for the next one. */
Farm__Verdict child_server_await_verdict(struct scripted_peer *p, struct pending_leases *pending);
void child_server_send_batch(struct scripted_peer *p, const struct batch *b, const struct plan *plan);

#endif
