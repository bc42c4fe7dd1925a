/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/sampler.h"

void sampler_fill_block(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, enum sampler_side side,
			unsigned vertex, double out[SAMPLER_BLOCK_SIZE])
{
	uint64_t half = sampler_half_index(side, vertex);
	rng_uniform4(seed, stream, index, step, half, out);
	rng_uniform4(seed, stream, index, step, half + 1, out + 4);
}

static const double *random_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct sampler_random *s = (struct sampler_random *)(void *)base;
	sampler_fill_block(s->seed, s->stream, s->index, s->step, side, vertex, s->values[side]);
	return s->values[side];
}

void sampler_random_init(struct sampler_random *s, uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step)
{
	*s = (struct sampler_random){
		.base = {random_block}, .seed = seed, .stream = stream, .index = index, .step = step};
}
