/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/coincident.h"

#include "common/base/text.h"
#include "worker/render/geom/coincide_find.h"

#include <stdio.h>

static enum surface_rank rank_of(const struct world *w, const struct world_shape *part)
{
	const struct bsdf *b = &w->bsdfs[part->bsdf];
	if (part->emitter >= 0)
		return SURFACE_SHINES;
	if (!(b->modes & BSDF_TRANSMIT))
		return SURFACE_OPAQUE;
	return b->passes && b->eta == 1 ? SURFACE_PASSES : SURFACE_TRANSMITS;
}

struct accel_shape *coincident_shapes(const struct world *w, struct arena *arena)
{
	struct accel_shape *s = arena_alloc(arena, w->shape_count, sizeof *s);
	for (uint32_t i = 0; s && i < w->shape_count; i++) {
		const struct geom_shape *g = &w->shapes[i];
		s[i] = (struct accel_shape){
			.is_sphere = g->is_sphere,
			.center = g->center,
			.radius = g->radius,
			.vertex_count = g->vertex_count,
			.triangle_count = g->triangle_count,
			.position = (const float(*)[3])g->position,
			.index = (const uint32_t(*)[3])g->index,
			.rank = rank_of(w, &w->parts[i]),
			.place = g->place,
			.unrounded = (const double(*)[3])g->unrounded,
			.curves = g->curves,
			.culled = g->culled,
		};
	}
	return s;
}

static const char *reason(enum surface_rank hidden, enum surface_rank by)
{
	if (hidden == by)
		return "comes first in the file";
	return by == SURFACE_SHINES ? "shines" : by == SURFACE_OPAQUE ? "is opaque" : "refracts or scatters";
}

/* Whether the pair is worth a note; otherwise it is not visible which of the two surfaces is present. */
static bool is_news(const struct world *w, const struct accel_shape *s, const struct coincide_shapes *c)
{
	if (c->hidden == c->by)
		return true;
	return s[c->hidden].rank != SURFACE_OPAQUE || s[c->by].rank != SURFACE_OPAQUE ||
	       (c->same_side && w->parts[c->hidden].bsdf != w->parts[c->by].bsdf);
}

static void describe_pair(struct render_coincident *out, const struct coincide_shapes *c, const struct accel_shape *s,
			  const struct scene_node *const *nodes)
{
	char hidden[NODE_TITLE_MAX], by[NODE_TITLE_MAX], *text = out->text[out->count];
	if (out->total++ >= RENDER_COINCIDENT_MAX)
		return;
	out->count++;
	if (c->hidden == c->by) {
		snprintf(text, sizeof out->text[0], "triangles of %s coincide: only the first of them is present",
			 node_title(nodes[c->hidden], hidden));
	} else {
		bool shine = s[c->hidden].rank == SURFACE_SHINES && s[c->by].rank == SURFACE_SHINES;
		bool refract = s[c->hidden].rank == SURFACE_TRANSMITS && s[c->by].rank == SURFACE_TRANSMITS;
		snprintf(
			text, sizeof out->text[0], "%s coincides with %s, which %s and hides it where they overlap%s",
			node_title(nodes[c->hidden], hidden), node_title(nodes[c->by], by),
			reason(s[c->hidden].rank, s[c->by].rank),
			shine && !c->same_side
				? "; light to the other side is lost: for a lamp with two sides use two surfaces, slightly apart"
			: refract ? "; where two media touch, use one surface with the int_ior and ext_ior of both"
				  : "");
	}
	text_clean(text);
}

int coincident_find(struct world *w, const struct scene_node *const *nodes, const struct accel_shape *shapes,
		    struct error *e)
{
	int rc = coincide_find(&w->coincidence, shapes, w->shape_count, e);
	const struct coincidence *c = w->coincidence;
	for (size_t i = 0; c && i < c->shapes_count; i++)
		if (is_news(w, shapes, &c->shapes[i]))
			describe_pair(&w->coincident, &c->shapes[i], shapes, nodes);
	w->coincident.incomplete = c && c->incomplete;
	return rc;
}
