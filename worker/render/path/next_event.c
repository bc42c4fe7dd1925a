/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/next_event.h"

#include "worker/render/world/emitter_choice.h"

double path_pdf_emitter(const struct path_context *c, const struct path_vertex *v)
{
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(c->w, v->emitter, v->x.prim.time, &storage);
	struct emitter_point p = world_emitter_point(&v->x);
	p.is_infinite = v->kind == VERTEX_INFINITE;
	return c->w->emitter_pdf[v->emitter] * em->ops->pdf_point(em, &p);
}

double path_pdf_toward(const struct path_context *c, const struct path_vertex *v, vec3 ref)
{
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(c->w, v->emitter, v->x.prim.time, &storage);
	struct emitter_point p = world_emitter_point(&v->x);
	p.is_infinite = v->kind == VERTEX_INFINITE;
	return emitter_choice_density_ratio(c->w, ref, v->emitter, em, &p) * emitter_pdf_toward(em, ref, &p);
}

bool path_sample_next_event(const struct path_context *c, const struct path_vertex *z, struct path_vertex *y,
			    double *pdf)
{
	const struct world *w = c->w;
	struct emitter_pick pick;
	if (!emitter_choice_pick(w, z->x.p, z->next_event, &pick))
		return false;
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(w, pick.emitter, z->x.prim.time, &storage);
	struct emitter_point p;
	if (!emitter_sample_toward(em, z->x.p, pick.u, &p, pdf) || !(*pdf > 0))
		return false;
	*pdf *= pick.density_ratio;
	*y = path_emitter_vertex(w, pick.emitter, &p, z->x.prim.time);
	y->pdf = w->emitter_pdf[pick.emitter] * em->ops->pdf_point(em, &p);
	return true;
}
