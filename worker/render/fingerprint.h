/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The numeric fingerprint (docs/design.md, rules 1): everything that affects the bits of a result besides plan and
 * scene. Programs with equal fingerprints compute equal bits. Any thread.
 */
#ifndef WORKER_RENDER_FINGERPRINT_H
#define WORKER_RENDER_FINGERPRINT_H

#include <stdint.h>

enum { FINGERPRINT_MAX = 256 };

/* Writes "build=... embree ... libc=... fma=1 self=...": the build id of this program, Embree's version and instruction
 * set, libc's version, and a hash of what libm computes here. */
void fingerprint_make(char text[FINGERPRINT_MAX]);

/* Returns Embree's part: "embree 3.13.5 avx2". */
const char *fingerprint_embree(void);

/* Returns an FNV-1a hash of the results of libm's functions for fixed inputs; takes about a millisecond. */
uint64_t fingerprint_self_test(void);

#endif
