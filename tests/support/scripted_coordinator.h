/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator of a few lines for one worker, whose loop it runs: both are in this thread, so nothing happens at once
 * by chance. Its jobs 1 to 4 have a scene file of their own, which is no scene, and a mesh that all have. What it does
 * not hear as expected fails the test.
 */
#ifndef TESTS_SUPPORT_SCRIPTED_COORDINATOR_H
#define TESTS_SUPPORT_SCRIPTED_COORDINATOR_H

#include "tests/support/scripted.h"
#include "worker/daemon/agent_state.h"

enum { PIECE = 1000, MESH = 3500, PIECES = 4 };

struct coord_file {
	const unsigned char *bytes;
	size_t size;
	struct blob_hash hash;
};

struct coord_test {
	struct agent *agent;
	int listener;
	char address[32];
	struct scripted *at; /* the connection, from the coordinator's side */
	struct coord_file mesh, scenes[4];
	unsigned char mesh_bytes[MESH];
	bool own; /* what the last failure said */
};
extern struct coord_test coord;

void coord_make_file(struct coord_file *f, const void *bytes, size_t size);

/* The worker, whose cache is in `folder` (folder.h), and the end of both. */
void coord_start(uint64_t cache_bytes);
void coord_finish(void);
void coord_welcome(void); /* a connection of the worker */
void coord_hang_up(void);

const Farm__Envelope *coord_hear(void); /* NULL: it hung up */
void coord_hear_job_get(uint64_t job);
void coord_hear_blob_get(const struct coord_file *f, uint64_t offset);
uint64_t coord_hear_failed(const char *why); /* the job */
void coord_hear_built(int count);	     /* leases of so many jobs fail with their scenes, which are none */
void coord_hear_silence(void);		     /* it says nothing more: the answer to something else comes next */

void coord_say_grant(uint64_t job);
void coord_grant(uint64_t job); /* of a job that the worker asks for */
void coord_say_revoke(uint64_t job);
void coord_describe(uint64_t job);
void coord_end_job(uint64_t job);
void coord_send_piece(struct coord_file *f, uint64_t offset);
/* Each piece is asked for once, from the given one on. */
void coord_serve_mesh(int from, int to);
/* Jobs 1 to count, with their own files; whoever asked first has asked for the mesh. */
void coord_begin_jobs(uint64_t count);

#endif
