/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/film/moments.h"

#include "common/base/mem.h"

#include <string.h>

int chain_moments_init(struct chain_moments *m, const struct plan *p, struct error *e)
{
	*m = (struct chain_moments){.x = p->crop_x, .y = p->crop_y, .width = p->crop_width, .height = p->crop_height};
	if (p->kind != PLAN_CHAINS)
		return 0;
	m->tiles_x = (p->crop_width + TILE_SIZE - 1) / TILE_SIZE;
	m->tile_count = batch_film_tile_count(p);
	m->first_moment = mem_alloc(m->tile_count, sizeof *m->first_moment);
	m->second_moment = mem_alloc(m->tile_count, sizeof *m->second_moment);
	m->share = mem_alloc(m->tile_count, sizeof *m->share);
	m->touched_tiles = mem_alloc(m->tile_count, sizeof *m->touched_tiles);
	if (m->first_moment && m->second_moment && m->share && m->touched_tiles)
		return 0;
	chain_moments_fini(m);
	return error_set(e, ENOMEM, "out of memory for the moments of %u tiles", batch_film_tile_count(p));
}

void chain_moments_fini(struct chain_moments *m)
{
	mem_free(m->first_moment);
	mem_free(m->second_moment);
	mem_free(m->share);
	mem_free(m->touched_tiles);
	*m = (struct chain_moments){0};
}

void chain_moments_add_state(struct chain_moments *m, const struct splat *splats, uint32_t count, double intensity,
			     double weight)
{
	uint32_t touched_count = 0;
	if (m->tile_count == 0)
		return;
	for (uint32_t i = 0; i < count; i++) {
		const struct splat *s = &splats[i];
		double x = s->x - m->x, y = s->y - m->y;
		if (!(x >= 0 && y >= 0 && x < m->width && y < m->height))
			continue;
		uint32_t tile = (uint32_t)y / TILE_SIZE * m->tiles_x + (uint32_t)x / TILE_SIZE;
		double share = (s->xyz[0] + s->xyz[1] + s->xyz[2]) / intensity;
		if (!(share > 0))
			continue;
		if (m->share[tile] == 0)
			m->touched_tiles[touched_count++] = tile;
		m->share[tile] += share;
	}
	for (uint32_t i = 0; i < touched_count; i++) {
		double *share = &m->share[m->touched_tiles[i]];
		m->first_moment[m->touched_tiles[i]] += weight * *share;
		m->second_moment[m->touched_tiles[i]] += weight * *share * *share;
		*share = 0;
	}
}

void chain_moments_end_sequence(struct chain_moments *m, float *first)
{
	for (uint32_t t = 0; t < m->tile_count; t++)
		first[t] = (float)m->first_moment[t];
	memset(m->first_moment, 0, m->tile_count * sizeof *m->first_moment);
}

void chain_moments_end_lease(const struct chain_moments *m, float *second, double classes[PATH_CLASSES])
{
	for (uint32_t t = 0; t < m->tile_count; t++)
		second[t] = (float)m->second_moment[t];
	memcpy(classes, m->class_weight, sizeof m->class_weight);
}
