/*
 * The render threads: a queue of tasks to them, a queue of finished ones back to the loop through one uv_async_t. All
 * calls on the loop's thread; `run` alone is called on a thread of the crew. Signals go to the loop's thread.
 */
#ifndef WORKER_DAEMON_CREW_H
#define WORKER_DAEMON_CREW_H

#include "common/base/error.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <uv.h>

struct task {
	struct task *next;
	void (*run)(struct task *);
	void (*done)(struct task *); /* on the loop's thread */
	atomic_ullong ticks;         /* of the thread that has it (common/base/tick.h); 0: none has begun */
	unsigned long long seen;     /* of them, when the watchdog looked last */
	unsigned still;              /* looks in a row that saw nothing new */
	bool hung;                   /* given up by the watchdog; a thread has it still */
};

struct crew;

int crew_new(struct crew **c, uv_loop_t *loop, unsigned threads, struct error *e);
void crew_add(struct crew *c, struct task *t);
/* true: it had not begun and is the caller's again. */
bool crew_take_back(struct crew *c, struct task *t);
unsigned crew_pending(const struct crew *c); /* tasks that are not done yet */
/* Waits for what runs, for ever where that never ends; `done` is not called any more. The memory goes when the loop has closed its handle. */
void crew_close(struct crew *c);

#endif
