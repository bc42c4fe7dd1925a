/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Invalid floating-point operations (0/0, inf - inf, sqrt of a negative): a fault of ours goes back to where the thread
 * said that faults are caught (fptrap_catch), and stops the program by SIGFPE where it did not; a library that raises
 * INVALID on ordinary input does no harm.
 *
 * The processor's own traps would have to be masked around every ray, and changing that mask empties the pipeline
 * twice: 16 % of a path tracer's time. So the traps stay masked and the sticky flag is looked at where our code ends:
 * at the door of the library and at the end of the watch. What the library raised is wiped away, at a cost only where
 * it did raise. Since faults are found at these places alone, and none of them is inside a library, leaving by longjmp
 * skips only frames of ours: between the catch and the fault nobody may hold a lock or memory that only his frame
 * knows. State of the calling thread. Works on x86-64; no effect elsewhere.
 */
#ifndef WORKER_RENDER_MATH_FPTRAP_H
#define WORKER_RENDER_MATH_FPTRAP_H

#include <setjmp.h>
#include <stdbool.h>

/* From here on a fault of this thread is a longjmp to `back` (with 1; nothing is watched or caught any more then);
 * NULL: it is a signal again. Returns what was before. */
jmp_buf *fptrap_catch(jmp_buf *back);
/* Numbers that a library cannot bear are at its door: a fault, watched or not. */
void fptrap_fault(void) __attribute__((noreturn));

#if defined(__x86_64__)
#include <xmmintrin.h>

extern _Thread_local bool fptrap_watching;

/* From here on INVALID is a fault; returns what was before. */
static inline bool fptrap_watch(void)
{
	bool before = fptrap_watching;
	_mm_setcsr(_mm_getcsr() & ~(unsigned)_MM_EXCEPT_MASK);
	fptrap_watching = true;
	return before;
}

/* Our code ends here, a library's begins. */
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
