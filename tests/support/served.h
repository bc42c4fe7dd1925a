/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator's shell in a process of its own, and peers that send whatever a test wants, valid or not. Blocking, one
 * thread, one server at a time; a missing answer fails the test after a minute. Peers receive and hang up as in
 * scripted.h.
 */
#ifndef TESTS_SUPPORT_SERVED_H
#define TESTS_SUPPORT_SERVED_H

#include "common/plan/plan.h"
#include "tests/support/scripted.h"

/* ---- the server ---- */

/* Starts a server for at most eight connections, two of them with a fetch under way, and scene files of up to 1 MiB.
 * Returns 0 once it listens. Timeouts that a test does not wait for should exceed the pauses of a busy machine. */
int served_start(double hello_seconds, double heartbeat_seconds, double stall_seconds);
int served_stop(void **state);			      /* a teardown: fails if the server did not end well */
void served_prepare(void (*spool)(const char *path)); /* makes the spool of the next start; NULL: nothing */
/* Contains the spool and the status socket, `status`. If the test creates a file `nomem` there, the next connection
 * gets no memory. */
const char *served_folder(void);
void served_set_busy(bool busy);	      /* forbids access to the films of its jobs */
long served_kilobytes(void);		      /* memory used */
unsigned served_turn(void);		      /* number of the current turn of its loop; also an input of tests */
unsigned served_at_once(void);		      /* most waiting results taken in one turn since the last call */
unsigned served_open_files(const char *name); /* number of open files whose path contains this */
void served_still_works(void);
void served_works_again(void); /* once it has noticed that the others hung up */

/* ---- a peer ---- */

struct scripted *peer_call(void);
void peer_say_bytes(const struct scripted *p, const void *bytes, size_t size);
void peer_say(const struct scripted *p, const Farm__Envelope *m, const void *payload, size_t payload_size);
const Farm__HelloAck *peer_hello(struct scripted *p, uint32_t version, Farm__Role role);
void peer_say_empty(struct scripted *p, Farm__Envelope__BodyCase what); /* JOB_LIST or LEASE_REQUEST */
void peer_say_job_get(const struct scripted *p, uint64_t job);

/* ---- jobs ---- */

/* mixture: NULL, or the mutations of the plan. */
struct plan_request peer_plan_request(const char *mixture);
void peer_submit(struct scripted *p, const char *mixture, const char *scene_text, const char *file_name,
		 const char *scene_name);
const Farm__SubmitAnswer *peer_submit_answer(struct scripted *p);
void peer_send_blob(struct scripted *p, const char *true_text, const char *sent_text);

/* Leases that arrived and have not been answered yet. */
struct lease_queue {
	struct lease_key keys[64];
	size_t count;
	bool job_ended;
};

/* Handles one message. Returns its verdict, or VERDICT_NONE if it was not one. */
Farm__Verdict peer_attend(struct scripted *p, struct lease_queue *d);
Farm__Verdict peer_verdict(struct scripted *p, struct lease_queue *d); /* waits for the next one */
void peer_send_batch(struct scripted *p, const struct batch *b, const struct plan *plan);

#endif
