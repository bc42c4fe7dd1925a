/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Counter-based random numbers: (seed, stream, index, step, dimension) -> value, by Threefry-4x64-20 (Salmon et al.
 * 2011, as implemented in Random123). Each use has its own stream constant, so no two uses share numbers. Values are
 * multiples of 2^-53 in [0,1). Any thread; no state.
 */
#ifndef WORKER_RENDER_MATH_RNG_H
#define WORKER_RENDER_MATH_RNG_H

#include <stdint.h>

/* Constants are never reused for another purpose, because jobs that continue depend on them: add new ones at the
 * end. */
enum rng_stream {
	RNG_PATH = 1,
	RNG_BDPT = 2,
	RNG_BOOTSTRAP = 3,
	RNG_CHAIN = 4,
	RNG_RESAMPLING = 5,
	RNG_OVERLONG_PATH = 6,
	RNG_MUTATION = 7,
	RNG_BIDIRECTIONAL_MUTATION = 8,
	RNG_TEST = 9,
	RNG_CHOICE = 10,
	RNG_BDPT8 = 11,
	RNG_ERPT = 12,
	RNG_REDISTRIBUTION = 13,
	RNG_BRIGHTNESS = 14,
	RNG_ERPT4 = 15,
	RNG_EMITTERS = 16,
};

/* Computes four values: dimensions 4*block .. 4*block+3 of one (stream, index, step). */
void rng_uniform4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block, double out[4]);
/* Computes the 256 random bits from which rng_uniform4 makes its values. */
void rng_bits4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block, uint64_t out[4]);

#endif
