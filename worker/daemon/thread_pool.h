/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The render threads: a queue of tasks to them, and a queue of finished ones back to the loop through one uv_async_t.
 * All calls on the loop's thread; only `run` is called on a render thread. Signals go to the loop's thread.
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
	void (*done)(struct task *); /* on the loop's thread */
	atomic_ullong ticks;	     /* ticks of the thread that has it (common/base/liveness.h); 0: none has started */
	unsigned long long seen;     /* ticks at the watchdog's last check */
	unsigned still;		     /* checks in a row without progress */
	bool hung;		     /* given up by the watchdog; a thread still has it */
};

struct thread_pool;

int thread_pool_new(struct thread_pool **c, uv_loop_t *loop, unsigned threads, struct error *e);
void thread_pool_add(struct thread_pool *c, struct task *t);
/* true: it had not started and is the caller's again. */
bool thread_pool_take_back(struct thread_pool *c, struct task *t);
unsigned thread_pool_pending(const struct thread_pool *c); /* tasks that are not done yet */
/* Waits for running tasks, forever if one never ends; `done` is not called any more. The memory is freed when the
 * loop has closed its handle. */
void thread_pool_close(struct thread_pool *c);

#endif
