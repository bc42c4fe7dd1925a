/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What workers ask for: jobs, and pieces of their files. It is answered in the order in which it was asked, a few
 * megabytes ahead of what the worker takes, so that one who asks and does not read costs no more.
 */
#ifndef COORDINATOR_PEERS_WORKER_REQUESTS_H
#define COORDINATOR_PEERS_WORKER_REQUESTS_H

#include "common/blob/blob.h"

struct session;

struct worker_request {
	struct worker_request *next;
	bool blob;	 /* else of a job */
	uint64_t number; /* the job's; the place in the blob */
	struct blob_hash hash;
};

void worker_requests_take(
	struct session *p,
	const struct worker_request *a);       /* copies; answers now or later, or hangs up on whoever asks too much */
void worker_requests_go_on(struct session *p); /* the worker has taken all that was sent */
void worker_requests_drop(struct session *p);

#endif
