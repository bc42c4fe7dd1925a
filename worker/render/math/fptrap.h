/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Detection of invalid floating-point operations (0/0, inf - inf, sqrt of a negative number). A fault in our code jumps
 * to where the thread asked for it (fptrap_catch), or ends the program by SIGFPE; a library that raises INVALID on
 * ordinary input does no harm.
 *
 * The processor's own traps would have to be masked around every ray, and changing that mask drains the pipeline twice,
 * which costs 16 % of a path tracer's time. So the traps stay masked, and the sticky flag is checked where our code
 * ends: before a call into a library and at the end of the watch. Flags raised by the library are cleared, which costs
 * something only if there are any. Faults are detected only at these places, none of which is inside a library, so the
 * longjmp skips only frames of ours: between catch and fault, no frame may hold a lock or memory that only it knows of.
 * The state belongs to the calling thread. Works on x86-64; has no effect elsewhere.
 */
#ifndef WORKER_RENDER_MATH_FPTRAP_H
#define WORKER_RENDER_MATH_FPTRAP_H

#include <setjmp.h>
#include <stdbool.h>

/* From now on, a fault of this thread is a longjmp to `back` with the value 1, which ends watching and catching. NULL:
 * faults are signals again. Returns the previous value. */
jmp_buf *fptrap_catch(jmp_buf *back);
/* Reports a fault, watched or not; for arguments that a library cannot handle. */
void fptrap_fault(void) __attribute__((noreturn));

#if defined(__x86_64__)
#include <xmmintrin.h>

extern _Thread_local bool fptrap_is_watching;

/* From now on, INVALID is a fault. Returns the previous state, for fptrap_unwatch. */
static inline bool fptrap_watch(void)
{
	bool previous = fptrap_is_watching;
	_mm_setcsr(_mm_getcsr() & ~(unsigned)_MM_EXCEPT_MASK);
	fptrap_is_watching = true;
	return previous;
}

/* Call when our code ends and a library's begins. Returns the flags, for fptrap_leave_library. */
static inline unsigned fptrap_enter_library(void)
{
	unsigned flags = _mm_getcsr();
	if ((flags & _MM_EXCEPT_INVALID) && fptrap_is_watching)
		fptrap_fault();
	return flags;
}

static inline void fptrap_leave_library(unsigned flags_before)
{
	unsigned flags = _mm_getcsr();
	if ((flags & ~flags_before) & _MM_EXCEPT_INVALID)
		_mm_setcsr(flags & ~(unsigned)_MM_EXCEPT_INVALID);
}

static inline void fptrap_unwatch(bool previous)
{
	fptrap_enter_library();
	fptrap_is_watching = previous;
}
#else
static inline bool fptrap_watch(void)
{
	return false;
}

static inline unsigned fptrap_enter_library(void)
{
	return 0;
}

static inline void fptrap_leave_library(unsigned flags_before)
{
	(void)flags_before;
}

static inline void fptrap_unwatch(bool previous)
{
	(void)previous;
}
#endif

#endif
