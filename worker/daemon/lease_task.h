/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A lease at a worker: from the grant, through a render thread, to the frame with its result, which is kept until the
 * coordinator has acknowledged it. The loop's thread, except for the rendering itself.
 */
#ifndef WORKER_DAEMON_LEASE_TASK_H
#define WORKER_DAEMON_LEASE_TASK_H

#include "common/wire/batch_wire.h"
#include "worker/daemon/job_cache.h"

#include <stdatomic.h>

enum lease_task_state {
	LEASE_WAITING, /* waits for its job's world */
	LEASE_QUEUED,  /* waits for a thread, or is being rendered */
	LEASE_RENDERED /* `frame` holds the result */
};

struct lease_task {
	struct task task;
	struct lease_task *next;
	struct grant grant;
	struct job_cache *job_cache;
	enum lease_task_state state;
	atomic_bool stop_requested; /* tells the thread to stop */
	bool is_unwanted;	    /* the result is not wanted any more: dropped when the thread returns it */
	bool is_sent;		    /* the result has been sent on this connection */
	unsigned char *frame;
	size_t frame_size;
	/* These three are set by the thread. */
	enum lease_outcome outcome;
	int rc;
	struct error error;
	void *owner;
	/* Called on the loop's thread when the render thread returns the lease. */
	void (*on_finished)(struct lease_task *);
};

/* Creates a lease, which then owns the contents of *g. Returns 0 or -ENOMEM. */
int lease_task_new(struct lease_task **out, struct grant *g, struct job_cache *cache, struct error *e);
void lease_task_free(struct lease_task *l); /* must not be called while a thread has the lease */
void lease_task_start(struct lease_task *l, struct thread_pool *c);

#endif
