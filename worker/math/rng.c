#include "worker/math/rng.h"

#include <Random123/threefry.h>

void rng_uniform4(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, uint64_t block, double out[4])
{
	threefry4x64_key_t key = {{seed, (uint64_t)stream, 0, 0}};
	threefry4x64_ctr_t counter = {{index, step, block, 0}};
	threefry4x64_ctr_t r = threefry4x64(counter, key);
	for (int i = 0; i < 4; i++)
		out[i] = (double)(r.v[i] >> 11) * 0x1p-53;
}
