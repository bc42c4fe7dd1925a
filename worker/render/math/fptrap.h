/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Invalid floating-point operations (0/0, inf - inf, sqrt of a negative). A fault of ours jumps back to where the
 * thread asked for that (fptrap_catch), or ends the program by SIGFPE; a library that raises INVALID on ordinary input
 * does no harm.
 *
 * The processor's own traps would have to be masked around every ray, and changing that mask empties the pipeline
 * twice: 16 % of a path tracer's time. So the traps stay masked, and the sticky flag is checked where our code ends:
 * before a call into the library and at the end of the watch. What the library raised is cleared, which costs something
 * only if it did. Faults are detected only at these places, none of which is inside a library, so leaving by longjmp
 * skips only frames of ours: between catch and fault, nobody may hold a lock or memory that only that frame knows.
 * State of the calling thread. Works on x86-64; no effect elsewhere.
 */
#ifndef WORKER_RENDER_MATH_FPTRAP_H
#define WORKER_RENDER_MATH_FPTRAP_H

#include <setjmp.h>
#include <stdbool.h>

/* From here on, a fault of this thread is a longjmp to `back` (with 1; watching and catching then end); NULL: it is
 * a signal again. Returns the previous value. */
jmp_buf *fptrap_catch(jmp_buf *back);
/* Arguments that a library cannot handle: a fault, watched or not. */
void fptrap_fault(void) __attribute__((noreturn));

#if defined(__x86_64__)
#include <xmmintrin.h>

extern _Thread_local bool fptrap_watching;

/* From here on, INVALID is a fault; returns the previous state. */
static inline bool fptrap_watch(void)
{
	bool before = fptrap_watching;
	_mm_setcsr(_mm_getcsr() & ~(unsigned)_MM_EXCEPT_MASK);
	fptrap_watching = true;
	return before;
}

/* Our code ends here, and a library's begins. */
static inline unsigned fptrap_leave(void)
{
	unsigned flags = _mm_getcsr();
	if ((flags & _MM_EXCEPT_INVALID) && fptrap_watching)
		fptrap_fault();
	return flags;
}

static inline void fptrap_return(unsigned left)
{
	unsigned flags = _mm_getcsr();
	if ((flags & ~left) & _MM_EXCEPT_INVALID)
		_mm_setcsr(flags & ~(unsigned)_MM_EXCEPT_INVALID);
}

static inline void fptrap_unwatch(bool before)
{
	fptrap_leave();
	fptrap_watching = before;
}
#else
static inline bool fptrap_watch(void)
{
	return false;
}

static inline unsigned fptrap_leave(void)
{
	return 0;
}

static inline void fptrap_return(unsigned left)
{
	(void)left;
}

static inline void fptrap_unwatch(bool before)
{
	(void)before;
}
#endif

#endif
