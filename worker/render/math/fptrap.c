/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/math/fptrap.h"

#include <signal.h>
#include <stddef.h>
#include <stdlib.h>

static _Thread_local jmp_buf *catcher;

jmp_buf *fptrap_catch(jmp_buf *back)
{
	jmp_buf *before = catcher;
	catcher = back;
	return before;
}

#if defined(__x86_64__)
_Thread_local bool fptrap_watching;

static void clear_exceptions(void)
{
	fptrap_watching = false;
	_mm_setcsr(_mm_getcsr() & ~(unsigned)_MM_EXCEPT_MASK);
}
#else
static void clear_exceptions(void)
{
}
#endif

void fptrap_fault(void)
{
	jmp_buf *back = catcher;
	if (back) {
		catcher = NULL;
		clear_exceptions();
		longjmp(*back, 1);
	}
	raise(SIGFPE);
	abort();
}
