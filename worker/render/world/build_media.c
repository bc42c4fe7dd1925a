/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/build_media.h"

#include "worker/render/world/node_table.h"

#include <stdio.h>

/* Sets *number to the number of a medium, 1 + its index in the order of first use, or to 0 if n is NULL. The medium
 * is made at its first use. */
static int get_medium_number(struct builder *b, const struct scene_node *n, struct node_table *numbers,
			     uint32_t *number)
{
	struct world *w = b->w;
	*number = 0;
	if (!n || node_table_find(numbers, n, NULL, number))
		return 0;
	*number = ++w->media_count;
	node_table_add(numbers, n, NULL, *number);
	int rc = medium_create(&w->media[*number - 1], n, &b->volumes, b->e);
	return rc ? build_record_problem(b, rc) : 0;
}

/* Makes the media inside shapes with a `volumelight` emit. emitter_nodes[]: the emitter of each medium so far. */
static int make_media_emit(struct builder *b, const struct scene_node **emitter_nodes)
{
	struct world *w = b->w;
	int rc = 0;
	for (uint32_t i = 0; i < w->shape_count && !rc; i++) {
		const struct scene_node *n = node_child(b->shape_nodes[i], PLUGIN_EMITTER, 0);
		uint32_t medium = w->shape_bindings[i].interior;
		if (!n || !emitter_is_volumetric(n) || (medium && emitter_nodes[medium - 1] == n))
			continue;
		if (!medium)
			rc = node_error(n, b->e, EINVAL, "\"%s\" must be inside a shape with an interior medium",
					n->type);
		else if (emitter_nodes[medium - 1])
			rc = node_error(n, b->e, EINVAL, "a medium may have only one \"%s\"", n->type);
		else
			rc = medium_set_emission(&w->media[medium - 1], n, &b->volumes, b->e);
		if (medium)
			emitter_nodes[medium - 1] = n;
		rc = rc ? build_record_problem(b, rc) : 0;
	}
	return rc;
}

static bool media_are_omitted(const struct builder *b)
{
	double media = b->w->accuracy.media;
	return media > SETTING_MEDIA_AUTO ? media > SETTING_MEDIA_SHOWN : b->scene->lacks_media;
}

int build_media(struct builder *b)
{
	struct world *w = b->w;
	if (media_are_omitted(b))
		return 0;
	struct node_table numbers;
	const struct scene_node *sensor = scene_sensor(b->scene, (uint32_t)w->accuracy.sensor),
				*camera = sensor ? node_child(sensor, PLUGIN_MEDIUM, 0) : NULL;
	uint32_t uses = camera ? 1 : 0;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		uses += node_ref(b->shape_nodes[i], "interior") ? 1 : 0;
		uses += node_ref(b->shape_nodes[i], "exterior") ? 1 : 0;
	}
	const struct scene_node **emitter_nodes = arena_alloc(&b->scratch, uses, sizeof(void *));
	if (!emitter_nodes)
		return build_out_of_memory(b->e);
	if (!uses)
		return make_media_emit(b, emitter_nodes);
	w->media = arena_alloc(&w->arena, uses, sizeof *w->media);
	if (!w->media || node_table_init(&numbers, uses, &b->scratch))
		return build_out_of_memory(b->e);
	int rc = 0;
	for (uint32_t i = 0; i < w->shape_count && !rc; i++) {
		const struct scene_node *n = b->shape_nodes[i];
		rc = get_medium_number(b, node_ref(n, "interior"), &numbers, &w->shape_bindings[i].interior);
		if (!rc)
			rc = get_medium_number(b, node_ref(n, "exterior"), &numbers, &w->shape_bindings[i].exterior);
	}
	if (!rc)
		rc = get_medium_number(b, camera, &numbers, &w->camera_medium);
	return rc ? rc : make_media_emit(b, emitter_nodes);
}

/* Whether the medium is bounded: by a shape, or because it varies in space or has no effect. */
static bool is_bounded(const struct world *w, uint32_t medium)
{
	const struct medium *m = &w->media[medium - 1];
	if (volume_varies(&m->first) || !(m->is_absorbing || m->is_scattering))
		return true;
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (w->shape_bindings[i].interior == medium)
			return true;
	return false;
}

void build_note_endless_medium(struct builder *b)
{
	struct world *w = b->w;
	if (!w->camera_medium || is_bounded(w, w->camera_medium))
		return;
	for (uint32_t i = 0; i < w->emitter_count; i++)
		if (w->emitters[i].is_infinite) {
			snprintf(w->notes.endless_medium, sizeof w->notes.endless_medium,
				 "the medium around the camera has no end, so no light from the `%s` emitter, or any "
				 "other at infinity, gets through; put it inside a shape to end it",
				 w->emitters[i].ops->decl.type);
			return;
		}
}

/* Returns the medium on the near side of the next surface along d that states one; if there is none, the camera's. */
static uint32_t next_medium(const struct world *w, struct ray_end from, vec3 d)
{
	enum { SURFACES = 1024 }; /* limit on surfaces without a medium */
	struct ray_hit hit;
	struct surface_point x;
	uint32_t medium;
	for (int i = 0; i < SURFACES && accel_closest(w->accel, &from, d, 0, INFINITY, &hit); i++) {
		surface_from_hit(&w->shapes[hit.prim.shape], from.p, d, &hit, &x);
		if (world_medium_of_side(&w->shape_bindings[hit.prim.shape], vec3_dot(x.ng, d) < 0, &medium))
			return medium;
		from = (struct ray_end){x.p, x.ng, x.prim};
	}
	return w->camera_medium;
}

static uint32_t medium_around_emitter(const struct world *w, uint32_t emitter)
{
	static const double middle[2] = {0.5, 0.5};
	static const vec3 arbitrary = {0.48, 0.6, 0.64};
	const struct emitter *em = &w->emitters[emitter];
	struct emitter_point p;
	double pdf;
	if (!em->ops->sample_point(em, middle, &p, &pdf) || p.is_infinite)
		return 0;
	uint32_t shape = w->emitter_shapes[emitter];
	bool has_surface = shape != UINT32_MAX;
	struct ray_end from = {p.p, has_surface ? p.n : (vec3){0, 0, 0},
			       has_surface ? (struct prim_ref){shape, p.texture_point.prim, 0} : PRIM_NONE};
	return next_medium(w, from, has_surface ? p.n : arbitrary);
}

int build_scattering(struct builder *b)
{
	struct world *w = b->w;
	if (!w->effects.scattering)
		return 0;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		w->shape_bindings[i].is_null_face =
			strcmp(w->bsdfs[w->shape_bindings[i].bsdf].ops->decl.type, "null") == 0 &&
			w->shape_bindings[i].emitter < 0;
		w->has_null_faces = w->has_null_faces || w->shape_bindings[i].is_null_face;
	}
	w->emitter_media = arena_alloc(&w->arena, w->emitter_count, sizeof *w->emitter_media);
	if (!w->emitter_media)
		return build_out_of_memory(b->e);
	for (uint32_t i = 0; i < w->emitter_count; i++)
		w->emitter_media[i] = medium_around_emitter(w, i);
	return 0;
}
