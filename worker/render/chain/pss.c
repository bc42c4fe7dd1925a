/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/chain/pss.h"

#include "common/base/bytes.h"

#include <assert.h>
#include <math.h>

/* Step sizes of Kelemen et al. 2002, sec. 5: between 1/1024 and 1/64, density proportional to 1/size. */
#define STEP_SMALL (1.0 / 1024)
#define STEP_LARGE (1.0 / 64)

double pss_small_step(double u, double r)
{
	double sign = r < 0.5 ? 1 : -1, v = r < 0.5 ? 2 * r : 2 * r - 1;
	double w = u + sign * STEP_LARGE * exp(-log(STEP_LARGE / STEP_SMALL) * v);
	if (w >= 1)
		w -= 1;
	else if (w < 0)
		w += 1;
	/* -2^-60 + 1 rounds to 1: the interval is half open. */
	return w < 1 ? w : 0;
}

/* Replaces the fresh numbers u by `from` moved by small steps that u determines. Only the wavelength stays fresh: the
 * target hardly depends on it, and a chain that moves through all wavelengths at once shows no coloured noise. */
static void move(enum sampler_side side, unsigned vertex, const double from[SAMPLER_BLOCK], double u[SAMPLER_BLOCK])
{
	double wavelength = u[DIM_WAVELENGTH];
	for (int i = 0; i < SAMPLER_BLOCK; i++)
		u[i] = pss_small_step(from[i], u[i]);
	if (side == SIDE_CAMERA && vertex == 0)
		u[DIM_WAVELENGTH] = wavelength;
}

static const double *block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct pss_sampler *s = (struct pss_sampler *)(void *)base;
	assert(vertex < PSS_MAX_VERTICES);
	for (unsigned v = s->point->used[side]; v <= vertex; v++) {
		double *u = s->point->u[side][v];
		sampler_fill(s->seed, s->stream, s->index, s->step, side, v, u);
		if (s->from && v < s->from->used[side])
			move(side, v, s->from->u[side][v], u);
		s->point->used[side] = v + 1;
	}
	return s->point->u[side][vertex];
}

void pss_sampler_init(struct pss_sampler *s, struct pss_point *point, const struct pss_point *from, uint64_t seed,
		      enum rng_stream stream, uint64_t index, uint64_t step)
{
	*s = (struct pss_sampler){{block}, point, from, seed, index, step, stream};
	for (int i = 0; i < SAMPLER_SIDES; i++)
		point->used[i] = 0;
}

void pss_choices(uint64_t seed, uint64_t chain, uint64_t step, double out[SAMPLER_BLOCK])
{
	sampler_fill(seed, RNG_CHAIN, chain, step, SIDE_CAMERA, PSS_MAX_VERTICES, out);
}

enum { HEADER = 8 };

size_t pss_write(const struct pss_point *p, uint8_t *bytes, size_t room)
{
	size_t block_size = SAMPLER_BLOCK * sizeof(double);
	size_t need = HEADER + (size_t)(p->used[0] + p->used[1]) * block_size;
	if (need > room)
		return 0;
	uint8_t *at = bytes + HEADER;
	for (int side = 0; side < SAMPLER_SIDES; side++) {
		put32(bytes + 4 * side, p->used[side]);
		copy_numbers(at, p->u[side], sizeof(double), (size_t)p->used[side] * SAMPLER_BLOCK);
		at += p->used[side] * block_size;
	}
	return need;
}

size_t pss_read(struct pss_point *p, const uint8_t *bytes, size_t size)
{
	size_t block_size = SAMPLER_BLOCK * sizeof(double), at = HEADER;
	if (size < HEADER)
		return 0;
	for (int side = 0; side < SAMPLER_SIDES; side++) {
		uint32_t used = get32(bytes + 4 * side);
		if (used > PSS_MAX_VERTICES || size - at < used * block_size)
			return 0;
		p->used[side] = used;
		copy_numbers(p->u[side], bytes + at, sizeof(double), (size_t)used * SAMPLER_BLOCK);
		at += used * block_size;
		for (uint32_t v = 0; v < used; v++)
			for (int i = 0; i < SAMPLER_BLOCK; i++)
				if (!(isfinite(p->u[side][v][i]) && p->u[side][v][i] >= 0 && p->u[side][v][i] < 1))
					return 0;
	}
	return at;
}
