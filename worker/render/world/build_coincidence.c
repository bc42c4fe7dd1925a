/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/build_coincidence.h"

#include "common/base/text.h"
#include "worker/render/geom/coincide_find.h"

#include <stdio.h>

static enum surface_rank surface_rank_of(const struct world *w, const struct shape_binding *binding)
{
	const struct bsdf *b = &w->bsdfs[binding->bsdf];
	if (binding->emitter >= 0)
		return SURFACE_EMITS;
	if (!(b->modes & BSDF_TRANSMIT))
		return SURFACE_OPAQUE;
	return b->is_see_through && b->eta == 1 ? SURFACE_SEE_THROUGH : SURFACE_TRANSMITS;
}

struct accel_shape *build_coincidence_make_shapes(const struct world *w, struct arena *arena)
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
			.rank = surface_rank_of(w, &w->shape_bindings[i]),
			.placement = g->placement,
			.unrounded = (const double(*)[3])g->unrounded,
			.curves = g->curves,
			.culls_backfaces = g->culls_backfaces,
		};
	}
	return s;
}

static const char *covering_reason(enum surface_rank hidden, enum surface_rank covering)
{
	if (hidden == covering)
		return "comes first in the file";
	return covering == SURFACE_EMITS ? "shines" : covering == SURFACE_OPAQUE ? "is opaque" : "refracts or scatters";
}

/* Whether the pair is worth a note; otherwise it is not visible which of the two surfaces is present. */
static bool is_noteworthy(const struct world *w, const struct accel_shape *s, const struct coincide_shape_pair *c)
{
	if (c->hidden == c->covering)
		return true;
	return s[c->hidden].rank != SURFACE_OPAQUE || s[c->covering].rank != SURFACE_OPAQUE ||
	       (c->faces_same_side && w->shape_bindings[c->hidden].bsdf != w->shape_bindings[c->covering].bsdf);
}

static void describe_pair(struct coincidence_notes *out, const struct coincide_shape_pair *c,
			  const struct accel_shape *s, const struct scene_node *const *nodes)
{
	char hidden[NODE_TITLE_MAX], covering[NODE_TITLE_MAX], *text = out->text[out->count];
	if (out->pair_count++ >= COINCIDENCE_NOTES_MAX)
		return;
	out->count++;
	if (c->hidden == c->covering) {
		snprintf(text, sizeof out->text[0], "triangles of %s coincide: only the first of them is present",
			 node_title(nodes[c->hidden], hidden));
	} else {
		bool both_emit = s[c->hidden].rank == SURFACE_EMITS && s[c->covering].rank == SURFACE_EMITS;
		bool both_transmit = s[c->hidden].rank == SURFACE_TRANSMITS && s[c->covering].rank == SURFACE_TRANSMITS;
		snprintf(
			text, sizeof out->text[0], "%s coincides with %s, which %s and hides it where they overlap%s",
			node_title(nodes[c->hidden], hidden), node_title(nodes[c->covering], covering),
			covering_reason(s[c->hidden].rank, s[c->covering].rank),
			both_emit && !c->faces_same_side
				? "; light to the other side is lost: for a lamp with two sides use two surfaces, slightly apart"
			: both_transmit
				? "; where two media touch, use one surface with the int_ior and ext_ior of both"
				: "");
	}
	text_clean(text);
}

int build_coincidence_find(struct world *w, const struct scene_node *const *nodes, const struct accel_shape *shapes,
			   struct error *e)
{
	int rc = coincide_find(&w->coincidence, shapes, w->shape_count, e);
	const struct coincidence *c = w->coincidence;
	for (size_t i = 0; c && i < c->shape_pair_count; i++)
		if (is_noteworthy(w, shapes, &c->shape_pairs[i]))
			describe_pair(&w->coincidence_notes, &c->shape_pairs[i], shapes, nodes);
	w->coincidence_notes.is_incomplete = c && c->is_incomplete;
	return rc;
}
