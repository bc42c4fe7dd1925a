/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Lets a watchdog see that a thread makes progress: liveness_tick() increments the thread's counter, and a counter that
 * stands still means that the thread hangs. Code that may run for long calls liveness_tick() more than once a second.
 * In threads without a watchdog, liveness_tick() costs one load.
 */
#ifndef COMMON_BASE_LIVENESS_H
#define COMMON_BASE_LIVENESS_H

#include <stdatomic.h>

extern _Thread_local atomic_ullong *liveness_counter; /* NULL: this thread is not watched */

/* Increments the counter (NULL: does nothing). Only one thread may increment it; any thread may read it. */
static inline void liveness_tick_on(atomic_ullong *counter)
{
	if (counter)
		atomic_store_explicit(counter, atomic_load_explicit(counter, memory_order_relaxed) + 1,
				      memory_order_relaxed);
}

static inline void liveness_tick(void)
{
	liveness_tick_on(liveness_counter);
}

#endif
