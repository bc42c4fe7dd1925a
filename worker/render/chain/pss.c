/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/chain/pss.h"

#include "common/base/bytes.h"

#include <assert.h>
#include <math.h>

/* Step sizes of Kelemen et al. 2002, sec. 5: between 1/1024 and 1/64, density proportional to 1/size. */
#define STEP_MIN (1.0 / 1024)
#define STEP_MAX (1.0 / 64)

double pss_small_step(double u, double r)
{
	double sign = r < 0.5 ? 1 : -1, v = r < 0.5 ? 2 * r : 2 * r - 1;
	double w = u + sign * STEP_MAX * exp(-log(STEP_MAX / STEP_MIN) * v);
	if (w >= 1)
		w -= 1;
	else if (w < 0)
		w += 1;
	/* -2^-60 + 1 rounds to 1: the interval is half open. */
	return w < 1 ? w : 0;
}

/* Replaces the fresh numbers u by `origin` moved by small steps that u determines. Only the wavelength stays fresh: the
 * target hardly depends on it, and a chain that moves through all wavelengths at once shows no coloured noise. */
static void perturb_block(enum sampler_side side, unsigned vertex, const double origin[SAMPLER_BLOCK_SIZE],
			  double u[SAMPLER_BLOCK_SIZE])
{
	double wavelength = u[DIM_WAVELENGTH];
	for (int i = 0; i < SAMPLER_BLOCK_SIZE; i++)
		u[i] = pss_small_step(origin[i], u[i]);
	if (side == SIDE_CAMERA && vertex == 0)
		u[DIM_WAVELENGTH] = wavelength;
}

static const double *pss_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct pss_sampler *s = (struct pss_sampler *)(void *)base;
	assert(vertex < PSS_VERTICES_MAX);
	for (unsigned v = s->point->block_count[side]; v <= vertex; v++) {
		double *u = s->point->u[side][v];
		sampler_fill_block(s->seed, s->stream, s->index, s->step, side, v, u);
		if (s->origin && v < s->origin->block_count[side])
			perturb_block(side, v, s->origin->u[side][v], u);
		s->point->block_count[side] = v + 1;
	}
	return s->point->u[side][vertex];
}

void pss_sampler_init(struct pss_sampler *s, struct pss_point *point, const struct pss_point *origin, uint64_t seed,
		      enum rng_stream stream, uint64_t index, uint64_t step)
{
	*s = (struct pss_sampler){{pss_block}, point, origin, seed, index, step, stream};
	for (int i = 0; i < SAMPLER_SIDES; i++)
		point->block_count[i] = 0;
}

void pss_draw_choices(uint64_t seed, uint64_t chain, uint64_t step, double out[SAMPLER_BLOCK_SIZE])
{
	sampler_fill_block(seed, RNG_CHAIN, chain, step, SIDE_CAMERA, PSS_VERTICES_MAX, out);
}

enum { HEADER_BYTES = 8 };

size_t pss_write(const struct pss_point *p, uint8_t *bytes, size_t capacity)
{
	size_t block_size = SAMPLER_BLOCK_SIZE * sizeof(double);
	size_t size = HEADER_BYTES + (size_t)(p->block_count[0] + p->block_count[1]) * block_size;
	if (size > capacity)
		return 0;
	uint8_t *at = bytes + HEADER_BYTES;
	for (int side = 0; side < SAMPLER_SIDES; side++) {
		put32(bytes + 4 * side, p->block_count[side]);
		copy_numbers(at, p->u[side], sizeof(double), (size_t)p->block_count[side] * SAMPLER_BLOCK_SIZE);
		at += p->block_count[side] * block_size;
	}
	return size;
}

size_t pss_read(struct pss_point *p, const uint8_t *bytes, size_t size)
{
	size_t block_size = SAMPLER_BLOCK_SIZE * sizeof(double), at = HEADER_BYTES;
	if (size < HEADER_BYTES)
		return 0;
	for (int side = 0; side < SAMPLER_SIDES; side++) {
		uint32_t used = get32(bytes + 4 * side);
		if (used > PSS_VERTICES_MAX || size - at < used * block_size)
			return 0;
		p->block_count[side] = used;
		copy_numbers(p->u[side], bytes + at, sizeof(double), (size_t)used * SAMPLER_BLOCK_SIZE);
		at += used * block_size;
		for (uint32_t v = 0; v < used; v++)
			for (int i = 0; i < SAMPLER_BLOCK_SIZE; i++)
				if (!(isfinite(p->u[side][v][i]) && p->u[side][v][i] >= 0 && p->u[side][v][i] < 1))
					return 0;
	}
	return at;
}
