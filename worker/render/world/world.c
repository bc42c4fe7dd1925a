/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/world.h"

#include "common/base/mem.h"
#include "worker/render/geom/coincide.h"

#include <string.h>

/* Bytes that Embree takes for a triangle, and for a shape with what accel.c keeps of it. */
enum { EMBREE_TRIANGLE = 150, EMBREE_SHAPE = 320 };

int32_t world_pick_emitter(const struct world *w, double u)
{
	uint32_t n = w->emitter_count;
	if (n == 0 || !(w->emitter_cdf[n] > 0))
		return -1;
	u *= w->emitter_cdf[n];
	uint32_t i = 0;
	while (i + 1 < n && w->emitter_cdf[i + 1] <= u)
		i++;
	while (w->emitter_pdf[i] == 0 && i > 0)
		i--;
	return (int32_t)i;
}

void world_summary(const struct world *w, struct render_summary *out)
{
	*out = (struct render_summary){.settings = w->settings,
				       .useful_depth = w->effects.max_depth,
				       .line_count = w->effects.line_count,
				       .shapes = w->shape_count,
				       .instances = w->instance_count,
				       .shared_meshes = w->shared_mesh_count,
				       .brightest = world_brightest(w),
				       .coincident = w->coincident};
	memcpy(out->scales, w->scales, sizeof out->scales);
	memcpy(out->flat, w->flat, sizeof out->flat);
	memcpy(out->lines, w->effects.lines, sizeof out->lines);
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct geom_shape *g = &w->shapes[i];
		out->triangles += g->triangle_count;
		if (!g->place || g->place->first == i)
			out->stored_triangles += g->triangle_count;
	}
	out->memory = w->arena.used + EMBREE_TRIANGLE * out->stored_triangles + EMBREE_SHAPE * w->shape_count;
}

int world_set_accuracy(struct world *w, const char *text, bool *fits, struct error *e)
{
	struct accuracy_settings accuracy;
	const struct render_setting *k;
	int rc = accuracy_settings_read(text, &accuracy, e);
	*fits = rc == 0;
	for (size_t i = 0; *fits && (k = render_setting_at(i)) != NULL; i++) {
		char old[32], new[32];
		accuracy_settings_value(&w->accuracy, i, old, sizeof old);
		accuracy_settings_value(&accuracy, i, new, sizeof new);
		*fits = k->place != SETTING_WORLD || strcmp(old, new) == 0;
	}
	if (*fits)
		w->accuracy = accuracy;
	return rc;
}

void world_free(struct world *w)
{
	if (!w)
		return;
	accel_free(w->accel);
	coincide_free(w->coincidence);
	arena_fini(&w->arena);
	mem_free(w);
}

double world_brightest(const struct world *w)
{
	double most = 0;
	for (uint32_t i = 0; i < w->emitter_count; i++)
		most = fmax(most, w->emitters[i].brightest);
	return 3 * most; /* X + Y + Z */
}

size_t world_embree_bytes(const struct world *w)
{
	return accel_bytes(w->accel);
}
