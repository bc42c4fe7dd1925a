/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/failing_memory.h"

#include "common/base/mem.h"

#include <stdatomic.h>
#include <stdbool.h>

void *__real_mem_alloc(size_t count, size_t size);
void *__wrap_mem_alloc(size_t count, size_t size);
void *__real_mem_grow(void *p, size_t old_size, size_t new_size);
void *__wrap_mem_grow(void *p, size_t old_size, size_t new_size);
char *__real_mem_strdup(const char *s);
char *__wrap_mem_strdup(const char *s);

static atomic_long countdown = -1;

static bool must_fail(void)
{
	if (atomic_load_explicit(&countdown, memory_order_relaxed) < 0)
		return false;
	return atomic_fetch_sub(&countdown, 1) == 0;
}

void mem_fail_after(long n)
{
	atomic_store(&countdown, n);
}

void *__wrap_mem_alloc(size_t count, size_t size)
{
	return must_fail() ? NULL : __real_mem_alloc(count, size);
}

void *__wrap_mem_grow(void *p, size_t old_size, size_t new_size)
{
	return must_fail() ? NULL : __real_mem_grow(p, old_size, new_size);
}

char *__wrap_mem_strdup(const char *s)
{
	return must_fail() ? NULL : __real_mem_strdup(s);
}
