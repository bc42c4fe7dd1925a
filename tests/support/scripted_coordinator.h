/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A scripted coordinator for one worker. Both run in this thread, and the coordinator runs the worker's loop, so that
 * the order of messages is deterministic. Each of jobs 1 to 4 has its own scene file, which contains no scene, so that
 * leases fail as soon as all files have arrived; the jobs share one mesh file. An unexpected message fails the test.
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
	bool own; /* of the last LeaseFailed */
};
extern struct coord_test coord;

void coord_make_file(struct coord_file *f, const void *bytes, size_t size);

/* Starts both; the worker's cache is in `folder` (folder.h). */
void coord_start(uint64_t cache_bytes);
void coord_finish(void);
void coord_welcome(void); /* accepts a connection of the worker */
void coord_hang_up(void);

const Farm__Envelope *coord_hear(void); /* NULL: the worker hung up */
void coord_hear_job_get(uint64_t job);
void coord_hear_blob_get(const struct coord_file *f, uint64_t offset);
uint64_t coord_hear_failed(const char *why); /* with `why` in its text; returns the job */
void coord_hear_built(int count); /* `count` jobs had all files: their leases fail, as their scenes cannot be read */
void coord_hear_silence(void);	  /* checks that no message is on its way: the answer to another message comes first */

void coord_say_grant(uint64_t job);
void coord_grant(uint64_t job); /* a lease of a job that the worker does not know, so that it asks for the job */
void coord_say_revoke(uint64_t job);
void coord_describe(uint64_t job);
void coord_end_job(uint64_t job);
void coord_send_piece(struct coord_file *f, uint64_t offset);
/* Sends pieces from .. to - 1 of the mesh, each after the worker has asked for it. */
void coord_serve_mesh(int from, int to);
/* Grants one lease each of jobs 1 to count, and sends their scene files. The worker then asks for the mesh once. */
void coord_begin_jobs(uint64_t count);

#endif
