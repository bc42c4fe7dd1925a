/*
 * Counter-based random numbers: (seed, stream, index, step, dimension) -> value, by Threefry-4x64-20 (Salmon et al.
 * 2011, through Random123). One stream constant a use, so that no two uses share numbers. Values are multiples of
 * 2^-53 in [0,1). Any thread; no state.
 */
#ifndef WORKER_MATH_RNG_H
#define WORKER_MATH_RNG_H

#include <stdint.h>

enum rng_stream { RNG_PATH = 1, RNG_BDPT, RNG_BOOTSTRAP, RNG_CHAIN, RNG_RESAMPLING, RNG_BEYOND, RNG_MUTATION, RNG_AROUND, RNG_TEST };

/* Four values: dimensions 4*block .. 4*block+3 of one (stream, index, step). */
void rng_uniform4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block, double out[4]);

#endif
