/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/visibility_notes.h"

#include "worker/render/asset/asset_name.h"

#include <stdio.h>

/* The planes that a box can be beyond: the near and the far plane, and four planes through the edges of the film. */
enum { NEAR, FAR, LEFT, RIGHT, TOP, BOTTOM, SIDES };

/* Slopes of rays through the edges of the rendered region, including the pixels whose filter reaches into it. */
struct view {
	double slope[SIDES];
};

static struct view compute_view(const struct world *w)
{
	const struct camera *c = &w->camera;
	const struct scene_settings *s = &w->settings;
	double x = s->crop_x, y = s->crop_y, width = scene_settings_width(s), height = scene_settings_height(s),
	       margin = 1.0 + s->border;
	return (struct view){.slope = {[LEFT] = (x - margin - c->center_x) / c->pixels_per_slope,
				       [RIGHT] = (x + width + margin - c->center_x) / c->pixels_per_slope,
				       [TOP] = (y - margin - c->center_y) / c->pixels_per_slope,
				       [BOTTOM] = (y + height + margin - c->center_y) / c->pixels_per_slope}};
}

/* Whether p, in the camera's frame, is beyond a plane for every point of the aperture. The ray from the aperture point
 * at distance r from the axis has a slope that differs by -r / focus, so at depth z it is r (1 - z / focus) from the
 * pinhole's ray. The region beyond a plane is convex, so a box is beyond it if its corners are. */
static bool is_beyond(const struct camera *c, const struct view *v, int side, vec3 p)
{
	double blur = c->aperture_radius > 0 ? c->aperture_radius * fabs(1 - p.z / c->focus_distance) : 0,
	       edge = v->slope[side] * p.z;
	switch (side) {
	case NEAR:
		return p.z < c->near_clip;
	case FAR:
		return p.z > c->far_clip;
	case LEFT:
		return p.x < edge - blur;
	case RIGHT:
		return p.x > edge + blur;
	case TOP:
		return p.y < edge - blur;
	default:
		return p.y > edge + blur;
	}
}

/* Returns the planes, as bits, that all corners are beyond. */
static unsigned sides_beyond(const struct world *w, const struct view *v, const struct box *b)
{
	const struct camera *c = &w->camera;
	unsigned beyond = (1U << SIDES) - 1;
	for (int k = 0; k < 8; k++) {
		vec3 corner = {k & 1 ? b->max.x : b->min.x, k & 2 ? b->max.y : b->min.y, k & 4 ? b->max.z : b->min.z};
		vec3 in_world = vec3_scale(w->scale, vec3_sub(corner, w->center));
		vec3 p = frame_to_local(&c->axes, vec3_sub(in_world, c->position));
		for (int side = 0; side < SIDES; side++)
			if (!is_beyond(c, v, side, p))
				beyond &= ~(1U << side);
	}
	return beyond;
}

void world_note_nothing_visible(struct world *w, const struct box *boxes)
{
	if (w->camera.projection) /* such a view is not bounded by four planes */
		return;
	const struct view v = compute_view(w);
	unsigned beyond_by_all = (1U << SIDES) - 1;
	if (w->camera.motion)
		return;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		unsigned beyond = sides_beyond(w, &v, &boxes[i]);
		if (!beyond)
			return;
		beyond_by_all &= beyond;
	}
	if (w->shape_count > 0)
		snprintf(w->notes.nothing_visible, sizeof w->notes.nothing_visible,
			 "the camera sees no shape: %s; its to_world says where it is and where it looks",
			 beyond_by_all >> NEAR & 1  ? "all are behind it, or nearer than its near plane"
			 : beyond_by_all >> FAR & 1 ? "all are beyond its far plane"
						    : "all are beside the image or behind it");
}

void world_note_negative_pixels(struct world *w, const struct raised_pictures *images)
{
	char place[NODE_PLACE_MAX], file[129];
	if (!images->first)
		return;
	snprintf(w->notes.negative_pixels, sizeof w->notes.negative_pixels,
		 "%s: %llu pixel%s of %s ha%s a negative value, which counts as 0%s", node_place(images->first, place),
		 (unsigned long long)images->pixel_count, images->pixel_count == 1 ? "" : "s",
		 asset_name_display(node_string(images->first, "filename", ""), file, sizeof file),
		 images->pixel_count == 1 ? "s" : "ve",
		 images->has_others ? "; other images have such pixels, too" : "");
}

void world_note_no_light(struct world *w, bool dropped_emitter)
{
	bool has_light = false;
	for (uint32_t i = 0; i < w->emitter_count; i++)
		has_light |= w->emitters[i].power > 0;
	for (uint32_t i = 0; i < w->media_count; i++)
		has_light |= w->media[i].is_emissive;
	if (w->emitter_count > 0 && !has_light)
		snprintf(w->notes.no_light, sizeof w->notes.no_light,
			 "no emitter gives light from %g to %g nm, which is what is rendered: the image is black",
			 WAVELENGTH_MIN, WAVELENGTH_MAX);
	else if (dropped_emitter && !has_light)
		snprintf(w->notes.no_light, sizeof w->notes.no_light,
			 "the scene has no emitter with an area: the image is black");
}

/* ---- backs ---- */

enum {
	GRID_SIDE = 32,
	BACK_FRACTION_DIVISOR = 20
}; /* the note appears from a fraction of 1 / BACK_FRACTION_DIVISOR on */

/* Whether a ray meets the back of an opaque material that `twosided` does not cover, black or lit by the setting
 * `backs`. */
static bool is_bare_back(const struct world *w, const struct ray_hit *hit, vec3 from, vec3 d)
{
	const struct bsdf *b = &w->bsdfs[w->shape_bindings[hit->prim.shape].bsdf];
	struct surface_point x;
	if (b->is_black || (b->is_two_sided && !b->has_mirrored_back))
		return false;
	surface_from_hit(&w->shapes[hit->prim.shape], from, d, hit, &x);
	return vec3_dot(x.ng, d) > 0;
}

void world_note_black_backs(struct world *w, bool black)
{
	static const double middle[2] = {0.5, 0.5};
	const struct camera *c = &w->camera;
	const struct scene_settings *s = &w->settings;
	const struct ray_end from = {.p = camera_sample_point(c, middle), .prim = PRIM_NONE};
	double width = scene_settings_width(s), height = scene_settings_height(s);
	unsigned hits = 0, backs = 0;
	for (int i = 0; i < GRID_SIDE * GRID_SIDE; i++) {
		vec3 d = camera_direction(c, from.p, s->crop_x + (i % GRID_SIDE + 0.5) / GRID_SIDE * width,
					  s->crop_y + (i / GRID_SIDE + 0.5) / GRID_SIDE * height);
		double low, high;
		struct ray_hit hit;
		camera_clip_range(c, d, &low, &high);
		if (!accel_closest(w->accel, &from, d, low, high, &hit))
			continue;
		hits++;
		backs += is_bare_back(w, &hit, from.p, d);
	}
	if (backs > 0 && backs * BACK_FRACTION_DIVISOR >= hits)
		snprintf(w->notes.black_backs, sizeof w->notes.black_backs,
			 "%.0f %% of the surfaces that the camera sees are %s", ceil(100.0 * backs / hits),
			 black ? "black backs of opaque materials without `twosided`, as in Mitsuba 3; --set "
				 "backs=lit shows them"
			       : "backs of opaque materials without `twosided`, which Mitsuba 0.6 shows black; --set "
				 "backs=black does");
}
