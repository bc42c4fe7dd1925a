/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A scripted coordinator for one worker. Both run in this thread, and the coordinator runs the worker's loop, so that
 * the order of messages is deterministic. Each of jobs 1 to 4 has its own scene file, which contains no scene, so that
 * leases fail as soon as all files have arrived; the jobs share one mesh file. An unexpected message fails the test.
 */
#ifndef TESTS_SUPPORT_SCRIPTED_COORDINATOR_H
#define TESTS_SUPPORT_SCRIPTED_COORDINATOR_H

#include "tests/support/scripted_peer.h"
#include "worker/daemon/agent_state.h"

enum { COORD_PIECE_BYTES = 1000, COORD_MESH_BYTES = 3500, COORD_MESH_PIECES = 4 };

struct coord_file {
	const unsigned char *bytes;
	size_t size;
	struct blob_hash hash;
};

struct coord_state {
	struct agent *agent;
	int listener;
	char address[32];
	struct scripted_peer *connection; /* from the coordinator's side */
	struct coord_file mesh, scenes[4];
	unsigned char mesh_bytes[COORD_MESH_BYTES];
	bool worker_at_fault; /* of the last LeaseFailed */
};
extern struct coord_state coord;

void coord_make_file(struct coord_file *f, const void *bytes, size_t size);

/* Starts both; the worker's cache is in `temporary_folder`. */
void coord_start(uint64_t cache_bytes);
void coord_stop(void);
void coord_accept_worker(void); /* accepts a connection of the worker */
void coord_disconnect(void);

const Farm__Envelope *coord_receive(void); /* NULL: the worker hung up */
void coord_expect_job_get(uint64_t job);
void coord_expect_blob_get(const struct coord_file *f, uint64_t offset);
uint64_t coord_expect_lease_failed(const char *why); /* with `why` in its text; returns the job */
void coord_expect_built_jobs(
	int count);		 /* `count` jobs had all files: their leases fail, as their scenes cannot be read */
void coord_expect_silence(void); /* checks that no message is on its way: the answer to another message comes first */

void coord_send_grant(uint64_t job);
/* A lease of a job that the worker does not know, so that it asks for the job. */
void coord_grant_new_job(uint64_t job);
void coord_send_revoke(uint64_t job);
void coord_send_job_info(uint64_t job);
void coord_send_job_end(uint64_t job);
void coord_send_piece(struct coord_file *f, uint64_t offset);
/* Sends pieces first .. end - 1 of the mesh, each after the worker has asked for it. */
void coord_serve_mesh(int first, int end);
/* Grants one lease each of jobs 1 to count, and sends their scene files. The worker then asks for the mesh once. */
void coord_begin_jobs(uint64_t count);

#endif
