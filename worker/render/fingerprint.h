/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The numeric fingerprint (docs/design.md, rules 1): everything that affects the bits of a result besides plan and
 * scene. Programs with equal fingerprints give equal bits. Any thread.
 */
#ifndef WORKER_RENDER_FINGERPRINT_H
#define WORKER_RENDER_FINGERPRINT_H

#include <stdint.h>

enum { FINGERPRINT_MAX = 256 };

/* "build=... embree=... libc=... fma=1 self=...": build id of this program, Embree with its instruction set, libm's
 * version, and a hash of what it computes here. */
void fingerprint_make(char text[FINGERPRINT_MAX]);

/* The part of Embree: "embree 3.13.5 avx2". */
const char *fingerprint_embree(void);

/* FNV-1a over the results of libm's functions on fixed inputs; takes about a millisecond. */
uint64_t fingerprint_self_test(void);

#endif
