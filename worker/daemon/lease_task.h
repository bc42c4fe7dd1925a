/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A lease at a worker: from the grant, through a render thread, to the frame with its result, which is kept until the
 * coordinator has acknowledged it. Loop's thread, except for the rendering itself.
 */
#ifndef WORKER_DAEMON_LEASE_TASK_H
#define WORKER_DAEMON_LEASE_TASK_H

#include "common/wire/batch_wire.h"
#include "worker/daemon/job_cache.h"

#include <stdatomic.h>

enum lease_task_state {
	LEASE_WAITING, /* for its job cache */
	LEASE_QUEUED,  /* for a thread, or running */
	LEASE_RENDERED /* frame holds the result */
};

struct lease_task {
	struct task task;
	struct lease_task *next;
	struct grant grant;
	struct job_cache *job_cache;
	enum lease_task_state state;
	atomic_bool stop;
	bool unwanted; /* nobody wants it: dropped when its thread returns */
	bool sent;     /* on this connection */
	unsigned char *frame;
	size_t frame_size;
	/* set by the thread */
	enum lease_end end;
	int rc;
	struct error error;
	void *owner;
	void (*finished)(struct lease_task *);
};

int lease_task_new(struct lease_task **l, struct grant *g, struct job_cache *b, struct error *e); /* takes the grant */
void lease_task_free(struct lease_task *l); /* not while a thread has it */
void lease_task_start(struct lease_task *l, struct thread_pool *c);

#endif
