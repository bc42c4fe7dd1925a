/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/math/fptrap.h"

#include <signal.h>
#include <stddef.h>
#include <stdlib.h>

static _Thread_local jmp_buf *catch_point;

jmp_buf *fptrap_catch(jmp_buf *back)
{
	jmp_buf *previous = catch_point;
	catch_point = back;
	return previous;
}

#if defined(__x86_64__)
_Thread_local bool fptrap_is_watching;

static void clear_exceptions(void)
{
	fptrap_is_watching = false;
	_mm_setcsr(_mm_getcsr() & ~(unsigned)_MM_EXCEPT_MASK);
}
#else
static void clear_exceptions(void)
{
}
#endif

void fptrap_fault(void)
{
	jmp_buf *back = catch_point;
	if (back) {
		catch_point = NULL;
		clear_exceptions();
		longjmp(*back, 1);
	}
	raise(SIGFPE);
	abort();
}
