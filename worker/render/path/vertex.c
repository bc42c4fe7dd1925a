/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/vertex.h"

spectrum path_emitted_radiance(const struct path_context *c, const struct path_vertex *v, vec3 w,
			       const struct wavelengths *wl)
{
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(c->w, v->emitter, v->x.prim.time, &storage);
	struct emitter_point p = world_emitter_point(&v->x);
	p.is_infinite = v->kind == VERTEX_INFINITE;
	return em->ops->radiance(em, &p, w, wl);
}

struct path_vertex path_emitter_vertex(const struct world *w, int32_t emitter, const struct emitter_point *p,
				       double time)
{
	struct path_vertex v = {.kind = p->is_infinite ? VERTEX_INFINITE : VERTEX_EMITTER, .emitter = emitter};
	uint32_t shape = w->emitter_shapes[emitter];
	v.x.p = p->p;
	v.x.ng = v.x.sh.n = p->n;
	v.x.u = p->texture_point.u;
	v.x.v = p->texture_point.v;
	v.x.b1 = p->texture_point.b1;
	v.x.b2 = p->texture_point.b2;
	v.x.prim = shape == UINT32_MAX ? prim_none_at(time) : (struct prim_ref){shape, p->texture_point.prim, time};
	return v;
}

bool path_extend(struct path_context *c, const struct path_vertex *from, vec3 d, double t_min, double t_max,
		 struct path_vertex *to)
{
	struct ray_end start = {from->x.p, from->kind == VERTEX_CAMERA ? (vec3){0, 0, 0} : from->x.ng, from->x.prim};
	struct ray_hit hit;
	c->counters[COUNT_RAYS_CLOSEST]++;
	to->to_prev = vec3_neg(d);
	to->is_delta = false;
	to->pdf_rev = 0;
	if (accel_closest(c->w->accel, &start, d, t_min, t_max, &hit)) {
		const struct shape_binding *binding = &c->w->shape_bindings[hit.prim.shape];
		surface_from_hit(&c->w->shapes[hit.prim.shape], from->x.p, d, &hit, &to->x);
		to->kind = VERTEX_SURFACE;
		to->bsdf = &c->w->bsdfs[binding->bsdf];
		to->emitter = binding->emitter;
		return true;
	}
	to->kind = VERTEX_INFINITE;
	to->x.p = d;
	to->x.prim = prim_none_at(from->x.prim.time);
	to->emitter = c->w->environment;
	to->bsdf = NULL;
	return to->emitter >= 0;
}
