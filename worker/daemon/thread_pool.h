/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The render threads: a queue of tasks for them, and a queue of finished tasks, of which one uv_async_t tells the loop.
 * All functions are called on the loop's thread; only task.run runs on a render thread. Signals are delivered to the
 * loop's thread.
 */
#ifndef WORKER_DAEMON_THREAD_POOL_H
#define WORKER_DAEMON_THREAD_POOL_H

#include "common/base/error.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <uv.h>

struct task {
	struct task *next;
	void (*run)(struct task *);
	void (*on_done)(struct task *); /* called on the loop's thread after `run` */
	atomic_ullong ticks;		/* ticks while it runs (common/base/liveness.h); 0: not started */
	unsigned long long last_ticks;	/* ticks at the last look of hang_watch.c */
	unsigned stalled_checks;	/* looks in a row without progress */
	bool is_hung;			/* given up by hang_watch.c; a thread still has it */
};

struct thread_pool;

int thread_pool_new(struct thread_pool **out, uv_loop_t *loop, unsigned threads, struct error *e);
void thread_pool_add(struct thread_pool *c, struct task *t);
/* Removes a task from the queue. Returns false if it has started. */
bool thread_pool_remove(struct thread_pool *c, struct task *t);
unsigned thread_pool_pending(const struct thread_pool *c); /* tasks added for which `on_done` has not been called */
/* Waits for running tasks, for ever if one never ends; `on_done` is not called any more. The memory is freed when the
 * loop has closed its handle. */
void thread_pool_close(struct thread_pool *c);

#endif
