/*
 * Floating-point traps: on while our own code renders (an invalid operation is a fault of ours and stops the program),
 * masked around libraries that raise INVALID on ordinary input. One register on x86-64; no effect elsewhere.
 */
#ifndef WORKER_MATH_FPTRAP_H
#define WORKER_MATH_FPTRAP_H

#if defined(__x86_64__)
#include <xmmintrin.h>

static inline unsigned fptrap_enable(void) /* traps on invalid operations; returns what was before */
{
	unsigned before = _mm_getcsr();
	_mm_setcsr((before & ~(unsigned)_MM_MASK_INVALID) & ~(unsigned)_MM_EXCEPT_MASK);
	return before;
}

static inline unsigned fptrap_mask(void)
{
	unsigned before = _mm_getcsr();
	_mm_setcsr(before | _MM_MASK_INVALID);
	return before;
}

static inline void fptrap_restore(unsigned before)
{
	_mm_setcsr(before & ~(unsigned)_MM_EXCEPT_MASK);
}
#else
static inline unsigned fptrap_enable(void)
{
	return 0;
}

static inline unsigned fptrap_mask(void)
{
	return 0;
}

static inline void fptrap_restore(unsigned before)
{
	(void)before;
}
#endif

#endif
