/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/sobol.h"

enum { DIMENSIONS = 4 };

/* All 16 combinations of four columns by exclusive or. */
#define NIBBLE(a, b, c, d)                                                                                     \
	{                                                                                                      \
		0, (a), (b), (a) ^ (b), (c), (a) ^ (c), (b) ^ (c), (a) ^ (b) ^ (c), (d), (a) ^ (d), (b) ^ (d), \
			(a) ^ (b) ^ (d), (c) ^ (d), (a) ^ (c) ^ (d), (b) ^ (c) ^ (d), (a) ^ (b) ^ (c) ^ (d)    \
	}

/* The generator matrices by columns, least significant bit first, two dimensions in a word. These are the
 * direction numbers, bits reversed, from the primitive polynomials and initial numbers of Joe and Kuo 2008
 * (new-joe-kuo-6), dimensions 1 to 4. */
static const uint64_t first_two_dimensions[8][16] = {
	NIBBLE(UINT64_C(0x0000000100000001), UINT64_C(0x0000000300000002), UINT64_C(0x0000000500000004),
	       UINT64_C(0x0000000f00000008)),
	NIBBLE(UINT64_C(0x0000001100000010), UINT64_C(0x0000003300000020), UINT64_C(0x0000005500000040),
	       UINT64_C(0x000000ff00000080)),
	NIBBLE(UINT64_C(0x0000010100000100), UINT64_C(0x0000030300000200), UINT64_C(0x0000050500000400),
	       UINT64_C(0x00000f0f00000800)),
	NIBBLE(UINT64_C(0x0000111100001000), UINT64_C(0x0000333300002000), UINT64_C(0x0000555500004000),
	       UINT64_C(0x0000ffff00008000)),
	NIBBLE(UINT64_C(0x0001000100010000), UINT64_C(0x0003000300020000), UINT64_C(0x0005000500040000),
	       UINT64_C(0x000f000f00080000)),
	NIBBLE(UINT64_C(0x0011001100100000), UINT64_C(0x0033003300200000), UINT64_C(0x0055005500400000),
	       UINT64_C(0x00ff00ff00800000)),
	NIBBLE(UINT64_C(0x0101010101000000), UINT64_C(0x0303030302000000), UINT64_C(0x0505050504000000),
	       UINT64_C(0x0f0f0f0f08000000)),
	NIBBLE(UINT64_C(0x1111111110000000), UINT64_C(0x3333333320000000), UINT64_C(0x5555555540000000),
	       UINT64_C(0xffffffff80000000)),
};
static const uint64_t last_two_dimensions[8][16] = {
	NIBBLE(UINT64_C(0x0000000100000001), UINT64_C(0x0000000300000003), UINT64_C(0x0000000400000006),
	       UINT64_C(0x0000000a00000009)),
	NIBBLE(UINT64_C(0x0000001f00000017), UINT64_C(0x0000002e0000003a), UINT64_C(0x0000004500000071),
	       UINT64_C(0x000000c9000000a3)),
	NIBBLE(UINT64_C(0x0000011b00000116), UINT64_C(0x000002a400000339), UINT64_C(0x0000079a00000677),
	       UINT64_C(0x00000b67000009aa)),
	NIBBLE(UINT64_C(0x0000101e00001601), UINT64_C(0x0000302d00003903), UINT64_C(0x0000404100007706),
	       UINT64_C(0x0000a0c30000aa09)),
	NIBBLE(UINT64_C(0x0001f10400010117), UINT64_C(0x0002e28a0003033a), UINT64_C(0x000457df00060671),
	       UINT64_C(0x000c9bae000909a3)),
	NIBBLE(UINT64_C(0x0011a10500171616), UINT64_C(0x002a7289003a3939), UINT64_C(0x0079e7db00717777),
	       UINT64_C(0x00b6dba400a3aaaa)),
	NIBBLE(UINT64_C(0x0100011a01170001), UINT64_C(0x030002a7033a0003), UINT64_C(0x0400079e06710006),
	       UINT64_C(0x0a000b6d09a30009)),
	NIBBLE(UINT64_C(0x1f00100116160017), UINT64_C(0x2e0030033939003a), UINT64_C(0x4500400477770071),
	       UINT64_C(0xc900a00aaaaa00a3)),
};

/* Reverses the bits of both halves of a word and exchanges the halves. */
static uint64_t reverse_bits(uint64_t x)
{
	x = __builtin_bswap64(x);
	x = (x & UINT64_C(0x0f0f0f0f0f0f0f0f)) << 4 | (x >> 4 & UINT64_C(0x0f0f0f0f0f0f0f0f));
	x = (x & UINT64_C(0x3333333333333333)) << 2 | (x >> 2 & UINT64_C(0x3333333333333333));
	return (x & UINT64_C(0x5555555555555555)) << 1 | (x >> 1 & UINT64_C(0x5555555555555555));
}

/* A permutation of the 32-bit numbers in which each bit depends only on itself and the bits below (Laine and
 * Karras 2011, with the constants of Burley 2020). On a number whose bits are in reversed order it is a
 * nested uniform scramble. */
static uint32_t permute(uint32_t x, uint32_t seed)
{
	x += seed;
	x ^= x * 0x6c50b47c;
	x ^= x * 0xb82f1e52;
	x ^= x * 0xc7afe638;
	return x ^ x * 0x8d22f6e6;
}

/* Returns 64 well mixed bits of a counter (the finalizer of MurmurHash3). */
static uint64_t mix(uint64_t x)
{
	x = (x ^ x >> 33) * UINT64_C(0xff51afd7ed558ccd);
	x = (x ^ x >> 33) * UINT64_C(0xc4ceb9fe1a85ec53);
	return x ^ x >> 33;
}

/* Scrambles two dimensions of a point and adds independent bits below the 32 that are stratified. */
static void scramble(uint64_t reversed, uint64_t seeds, uint64_t tail, double out[2])
{
	uint64_t low = permute((uint32_t)reversed, (uint32_t)seeds),
		 high = permute((uint32_t)(reversed >> 32), (uint32_t)(seeds >> 32));
	uint64_t x = reverse_bits(high << 32 | low);
	out[0] = (double)((x >> 32) << 16 | (tail & 0xffff)) * 0x1p-48;
	out[1] = (double)((x & 0xffffffff) << 16 | (tail >> 16 & 0xffff)) * 0x1p-48;
}

/* Computes the four numbers of one half of a block. */
static void fill_half(const struct sampler_sobol *s, uint64_t half, double out[DIMENSIONS])
{
	uint64_t hash[4], point[2] = {0, 0};
	for (int i = 0; i < 4; i++)
		hash[i] = mix(s->key[i] + half * UINT64_C(0x9e3779b97f4a7c15));
	uint32_t order = permute(s->reversed_sample, (uint32_t)hash[0]);
	uint32_t number = (uint32_t)(reverse_bits(order) >> 32);
	for (int i = 0; i < 8; i++, number >>= 4) {
		point[0] ^= first_two_dimensions[i][number & 15];
		point[1] ^= last_two_dimensions[i][number & 15];
	}
	uint64_t tail = mix(hash[3] + s->sample);
	scramble(point[0], hash[1], tail, out);
	scramble(point[1], hash[2], tail >> 32, out + 2);
}

double *sampler_sobol_fill(struct sampler_sobol *s, enum sampler_side side, unsigned vertex)
{
	uint64_t half = sampler_half_index(side, vertex);
	fill_half(s, half, s->values[side]);
	fill_half(s, half + 1, s->values[side] + DIMENSIONS);
	return s->values[side];
}

static const double *sobol_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	return sampler_sobol_fill((struct sampler_sobol *)(void *)base, side, vertex);
}

void sampler_sobol_init(struct sampler_sobol *s, uint64_t seed, enum rng_stream stream, uint64_t index,
			uint64_t replicate, uint64_t sample)
{
	s->base.block = sobol_block;
	s->sample = sample;
	s->reversed_sample = (uint32_t)(reverse_bits(sample) >> 32);
	rng_bits4(seed, stream, index, replicate, sample >> 32, s->key);
}
