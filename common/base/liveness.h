/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Work that says that it gets on: a thread's ticks count up a counter of its own, and whoever watches that sees it
 * stand still when the thread hangs. Code that may run for long ticks more often than once a second. Threads that
 * nobody watches lose a look at a variable by it.
 */
#ifndef COMMON_BASE_LIVENESS_H
#define COMMON_BASE_LIVENESS_H

#include <stdatomic.h>
#include <stddef.h>

extern _Thread_local atomic_ullong *tick_counter; /* NULL: nobody watches this thread */

/* One thread counts, others look. */
static inline void tick_on(atomic_ullong *counter)
{
	if (counter)
		atomic_store_explicit(counter, atomic_load_explicit(counter, memory_order_relaxed) + 1,
				      memory_order_relaxed);
}

static inline void tick(void)
{
	tick_on(tick_counter);
}

#endif
