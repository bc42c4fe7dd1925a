/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator in this process: its loop runs when a test calls it. It begins with the state of a spool
 * that is made once: job 1 is done, 2 lacks the chains of one lease in each of its rounds, 3 is in its bootstrap, 4
 * waits for its first samples and wants each from two workers, 5 is done and can be extended. One thread. What goes
 * wrong ends the program.
 */
#ifndef TESTS_FUZZ_FARM_H
#define TESTS_FUZZ_FARM_H

#include "common/film/batch.h"
#include "common/wire/frame.h"
#include "coordinator/server/server.h"
#include "tests/fuzz/messages.h"

enum { FARM_DONE = 1, FARM_CHAINS = 2, FARM_BOOTSTRAP = 3, FARM_SAMPLES = 4, FARM_ENDED = 5 };
enum { FARM_PEERS = 7 };

struct farm_peer {
	int fd; /* negative: not there */
	struct frame_reader reader;
	struct envelope received;
	bool has_frame;
	bool has_spoken; /* what it says from now on is checked */
};

struct farm_world {
	struct server *server;
	char spool[128]; /* of this one; as it was in the beginning */
	struct farm_peer peers[FARM_PEERS];
	unsigned settled; /* times; in the names of workers, so that nobody is quarantined for what another input did */
};

struct farm_world *farm_world_new(void);    /* on a copy of that spool */
void farm_world_free(struct farm_world *w); /* its folder goes */
void farm_spool_copy(const char *to);	    /* the spool alone, for those who damage it first */
int farm_world_open(struct farm_world *w,
		    struct error *e); /* server_open on w->spool as it is, until its jobs are read */
void farm_world_close(struct farm_world *w);

void farm_turn(struct farm_world *w);	/* what can be done at once */
void farm_settle(struct farm_world *w); /* all hang up; until nothing is under way */

void farm_call(struct farm_world *w, unsigned peer, bool status_socket);
void farm_hello(struct farm_world *w, unsigned peer, Farm__Role role);
void farm_say(struct farm_world *w, unsigned peer, const void *bytes, size_t size);
/* A frame of a header and a payload, with the checksums that belong to them: what is behind these is to be reached. */
void farm_say_parts(struct farm_world *w, unsigned peer, const struct step *step);
void farm_say_message(struct farm_world *w, unsigned peer, const Farm__Envelope *m, const void *payload, size_t size);
void farm_drain(struct farm_world *w, unsigned peer); /* discards what it received */
void farm_hang_up(struct farm_world *w, unsigned peer);

/* What an honest worker answers to a lease of one of these jobs, in even light; batch_fini frees it. */
struct batch farm_batch(const struct lease_key *k, const struct plan *plan);
/* The submissions of the jobs, with a scene of one file; text and message are static. */
const Farm__Envelope *farm_submission(uint64_t job);
extern const char farm_scene[];
struct plan farm_plan(uint64_t job);

#endif
