/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/math/rng.h"

#include <Random123/threefry.h>

void rng_bits4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block, uint64_t out[4])
{
	threefry4x64_key_t key = {{seed, (uint64_t)stream, 0, 0}};
	threefry4x64_ctr_t counter = {{index, step, block, 0}};
	threefry4x64_ctr_t r = threefry4x64(counter, key);
	for (int i = 0; i < 4; i++)
		out[i] = r.v[i];
}

void rng_uniform4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block, double out[4])
{
	uint64_t bits[4];
	rng_bits4(seed, stream, index, step, block, bits);
	for (int i = 0; i < 4; i++)
		out[i] = (double)(bits[i] >> 11) * 0x1p-53;
}
