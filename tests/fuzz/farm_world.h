/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator in this process whose loop runs when a test calls it. It begins with a spool that is made once: job 1
 * is done; job 2 lacks the chains of one lease in each of its rounds; job 3 is in its bootstrap; job 4 waits for its
 * first samples, each of which two workers must compute; job 5 is done and can be extended. One thread. Errors end the
 * program.
 */
#ifndef TESTS_FUZZ_FARM_WORLD_H
#define TESTS_FUZZ_FARM_WORLD_H

#include "common/film/batch.h"
#include "common/wire/frame.h"
#include "coordinator/server/server.h"
#include "tests/fuzz/messages.h"

enum { FARM_JOB_DONE = 1, FARM_JOB_CHAINS = 2, FARM_JOB_BOOTSTRAP = 3, FARM_JOB_SAMPLES = 4, FARM_JOB_EXTENDABLE = 5 };
enum { FARM_WORLD_PEERS = 7 };

struct farm_world_peer {
	int fd; /* negative: not connected */
	struct frame_reader reader;
	struct envelope received;
	bool has_frame;
	bool has_spoken; /* its messages carry checksums from now on */
};

struct farm_world {
	struct server *server;
	char spool[128]; /* folder of this world's spool, which starts as a copy */
	struct farm_world_peer peers[FARM_WORLD_PEERS];
	unsigned settle_count; /* number of calls of farm_world_settle; part of workers' names, so that none is
				* quarantined for an earlier input */
};

struct farm_world *farm_world_new(void);    /* starts on a copy of the prepared spool */
void farm_world_free(struct farm_world *w); /* removes its folder as well */
void farm_world_copy_spool(const char *to); /* copies the prepared spool only, for callers that damage it first */
/* server_open on w->spool as it is; returns once its jobs are read. */
int farm_world_open(struct farm_world *w, struct error *e);
void farm_world_close(struct farm_world *w);

void farm_world_run_once(struct farm_world *w); /* does all that can be done at once */
void farm_world_settle(struct farm_world *w);	/* all peers hang up; returns when no work is under way */

void farm_world_connect(struct farm_world *w, unsigned peer, bool status_socket);
void farm_world_send_hello(struct farm_world *w, unsigned peer, Farm__Role role);
void farm_world_send_bytes(struct farm_world *w, unsigned peer, const void *bytes, size_t size);
/* Sends a frame of a header and a payload with correct checksums, so that the code behind the check is reached. */
void farm_world_send_step(struct farm_world *w, unsigned peer, const struct step *step);
void farm_world_send_message(struct farm_world *w, unsigned peer, const Farm__Envelope *m, const void *payload,
			     size_t size);
void farm_world_drain(struct farm_world *w, unsigned peer); /* discards what the peer has received */
void farm_world_disconnect(struct farm_world *w, unsigned peer);

/* Returns an honest worker's result for a lease of one of these jobs, in uniform light; batch_fini frees it. */
struct batch farm_world_make_batch(const struct lease_key *k, const struct plan *plan);
/* Returns the submission of a job, with a scene of one file; text and message are static. */
const Farm__Envelope *farm_world_make_submission(uint64_t job);
extern const char farm_world_scene[];
struct plan farm_world_make_plan(uint64_t job);

#endif
