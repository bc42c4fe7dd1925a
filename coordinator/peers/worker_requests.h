/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Requests of workers for jobs and for chunks of their files. They are answered in order, a few megabytes ahead of
 * what the worker has read, so a worker that asks and does not read costs no more than that.
 */
#ifndef COORDINATOR_PEERS_WORKER_REQUESTS_H
#define COORDINATOR_PEERS_WORKER_REQUESTS_H

#include "common/blob/blob.h"

#include <sys/queue.h>

struct session;

struct worker_request {
	STAILQ_ENTRY(worker_request) next;
	bool is_blob;		/* a chunk of a blob; otherwise a job */
	uint64_t job_or_offset; /* id of the job; offset in the blob */
	struct blob_hash hash;
};

/* Answers a request, which is copied, now or later; disconnects a worker that has asked for too much. */
void worker_requests_handle(struct session *p, const struct worker_request *a);
void worker_requests_resume(void *session); /* call when the worker has read everything sent */
/* A file has been checked. refusal: why it cannot be sent; "": it can be. */
void worker_requests_file_checked(struct session *p, const struct blob_hash *h, const char *refusal);
void worker_requests_drop(struct session *p);

#endif
