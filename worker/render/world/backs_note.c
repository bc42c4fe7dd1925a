/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/backs_note.h"

#include "worker/render/geom/accel.h"
#include "worker/render/geom/surface.h"

#include <math.h>
#include <stdio.h>

enum { SIDE = 32, LEAST = 20 }; /* a share of 1 / LEAST is worth a sentence */

static bool is_black_back(const struct world *w, const struct ray_hit *hit, vec3 from, vec3 d)
{
	const struct bsdf *b = &w->bsdfs[w->parts[hit->prim.shape].bsdf];
	struct surface_point x;
	if (b->black || b->two_sided)
		return false;
	surface_from_hit(&w->shapes[hit->prim.shape], from, d, hit, &x);
	return vec3_dot(x.ng, d) > 0;
}

void backs_note(struct world *w)
{
	static const double middle[2] = {0.5, 0.5};
	const struct camera *c = &w->camera;
	const struct scene_settings *s = &w->settings;
	const struct ray_end from = {.p = camera_point(c, middle), .prim = PRIM_NONE};
	double width = s->crop_width ? s->crop_width : s->width, height = s->crop_width ? s->crop_height : s->height;
	unsigned hits = 0, backs = 0;
	for (int i = 0; i < SIDE * SIDE; i++) {
		vec3 d = camera_direction(c, from.p, s->crop_x + (i % SIDE + 0.5) / SIDE * width,
					  s->crop_y + (i / SIDE + 0.5) / SIDE * height);
		double low, high;
		struct ray_hit hit;
		camera_clip(c, d, &low, &high);
		if (!accel_closest(w->accel, &from, d, low, high, &hit))
			continue;
		hits++;
		backs += is_black_back(w, &hit, from.p, d);
	}
	if (backs > 0 && backs * LEAST >= hits)
		snprintf(w->notes.backs, sizeof w->notes.backs,
			 "%.0f %% of the surfaces that the camera sees are black backs of opaque materials without "
			 "`twosided`, as in Mitsuba 3; --set backs=lit shows them",
			 ceil(100.0 * backs / hits));
}
