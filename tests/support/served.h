/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator's shell in a process of its own, and peers of it that say what a test wants them to say, well or badly.
 * Blocking, one thread, one server at a time; what does not answer within a minute fails the test. They hear and hang
 * up as scripted.h has it.
 */
#ifndef TESTS_SUPPORT_SERVED_H
#define TESTS_SUPPORT_SERVED_H

#include "common/plan/plan.h"
#include "tests/support/scripted.h"

/* ---- the server ---- */

/* Eight connections at most, two of them with a fetch under way, and scene files of 1 MiB; 0: it listens. What a test
 * does not wait for is to last longer than a busy machine stands still. */
int served_start(double hello_seconds, double heartbeat_seconds, double stall_seconds);
int served_stop(void **state);			      /* a teardown: fails when it did not end well */
void served_prepare(void (*spool)(const char *path)); /* what makes the spool of the next start; NULL: nothing */
/* Holds its spool and its status socket, `status`; a file `nomem` there: its next connection gets no memory. */
const char *served_folder(void);
void served_set_busy(bool busy);	      /* nobody may look at the films of its jobs */
long served_kilobytes(void);		      /* of memory */
unsigned served_turn(void);		      /* of its loop: a number, also for what a test has put into it */
unsigned served_at_once(void);		      /* most waiting results taken in one, since the last call */
unsigned served_open_files(const char *name); /* descriptors of files that have this in their path */
void served_still_works(void);
void served_works_again(void); /* when it has noticed that others hung up */

/* ---- a peer ---- */

struct scripted *peer_call(void);
void peer_say_bytes(const struct scripted *p, const void *bytes, size_t size);
void peer_say(const struct scripted *p, const Farm__Envelope *m, const void *payload, size_t payload_size);
const Farm__HelloAck *peer_hello(struct scripted *p, uint32_t version, Farm__Role role);
void peer_say_empty(struct scripted *p, Farm__Envelope__BodyCase what); /* JOB_LIST or LEASE_REQUEST */
void peer_say_job_get(const struct scripted *p, uint64_t job);

/* ---- jobs ---- */

/* mixture: NULL, or of the mutations. */
struct plan_request peer_plan_request(const char *mixture);
void peer_submit(struct scripted *p, const char *mixture, const char *scene_text, const char *file_name,
		 const char *scene_name);
const Farm__SubmitAnswer *peer_submit_answer(struct scripted *p);
void peer_send_blob(struct scripted *p, const char *true_text, const char *sent_text);

/* Leases that came and were not answered yet. */
struct lease_queue {
	struct lease_key keys[64];
	size_t count;
	bool job_ended;
};

/* Hears one message. Its verdict, or VERDICT_NONE when it was none. */
Farm__Verdict peer_attend(struct scripted *p, struct lease_queue *d);
Farm__Verdict peer_verdict(struct scripted *p, struct lease_queue *d); /* the next one */
void peer_send_batch(struct scripted *p, const struct batch *b, const struct plan *plan);

#endif
