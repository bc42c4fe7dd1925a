/*
 * What workers ask for: jobs, and pieces of their files. It is answered in the order in which it was asked, a few megabytes ahead of
 * what the worker takes, so that one who asks and does not read costs no more.
 */
#ifndef COORDINATOR_SHELL_ASKS_H
#define COORDINATOR_SHELL_ASKS_H

#include "common/blob/blob.h"

struct session;

struct ask {
	struct ask *next;
	bool blob;       /* else of a job */
	uint64_t number; /* the job's; the place in the blob */
	struct blob_hash hash;
};

void asks_take(struct session *p, const struct ask *a); /* copies; answers now or later, or hangs up on whoever asks too much */
void asks_go_on(struct session *p); /* the worker has taken all that was sent */
void asks_drop(struct session *p);

#endif
