/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/media.h"

uint32_t path_medium_after(const struct world *w, const struct path_vertex *v, uint32_t medium, vec3 away)
{
	if (v->kind != VERTEX_SURFACE)
		return medium;
	const struct world_shape *s = &w->parts[v->x.prim.shape];
	if (!s->interior && !s->exterior)
		return medium;
	return vec3_dot(v->x.ng, away) > 0 ? s->exterior : s->interior;
}

spectrum path_transmittance(const struct world *w, const struct wavelengths *wl, uint32_t medium,
			    const struct path_vertex *a, const struct path_vertex *b)
{
	if (!medium)
		return spectrum_of(1);
	bool endless = a->kind == VERTEX_INFINITE || b->kind == VERTEX_INFINITE;
	double distance = endless ? INFINITY : vec3_length(vec3_sub(a->x.p, b->x.p));
	return medium_transmittance(&w->media[medium - 1], distance, wl);
}

void path_absorb(const struct path_context *c, const struct path_vertex *at, vec3 wi, struct path_vertex *to)
{
	to->medium = path_medium_after(c->w, at, at->medium, wi);
	to->beta = spectrum_mul(to->beta, path_transmittance(c->w, &c->wl, to->medium, at, to));
}
