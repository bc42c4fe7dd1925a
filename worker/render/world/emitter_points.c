/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds points that camera paths reach, and the shares of direct light at each.
 *
 * Walks leave the camera. A surface that scatters sends them on diffusely, a specular one straight through or by
 * reflection; the exact behaviour of materials does not matter for which lamps are near. At each point x, the
 * unoccluded light is computed for one sampled point of each part of the emitters. The largest of these contributions
 * are tested by shadow rays until the remaining ones are faint, so the work grows with the number of emitters that
 * matter at x, not with all.
 *
 * Fails only if out of memory. There may be fewer points than wanted, or none, if walks leave the scene.
 */
#include "worker/render/world/emitter_points.h"

#include "worker/render/math/rng.h"
#include "worker/render/world/emitter_part.h"

#include <string.h>

enum {
	WALKS_PER_POINT = 4, /* most walks for each point wanted */
	POINTS_PER_WALK = 4, /* most points per walk */
	STEPS_MAX = 16,	     /* most surfaces that a walk meets, including those that yield no point */
	TESTS_MAX = 96,	     /* most shadow rays per point */
	RAYS_MAX = 1 << 18,  /* most shadow rays for all points */
	SURFACES_MAX = 8,    /* most surfaces that a shadow ray passes */
};
static const double gloss_fraction = 0.1, /* fraction of the light that glossy reflection may add from any direction */
	faint_fraction = 0.01; /* fraction of the light that has arrived, below which an offer is not tested */

struct scatter_point {
	/* ng: on the side from which the walk came; 0 in a medium. */
	vec3 p, ng;
	struct prim_ref prim;
	bool is_opaque;
};

/* The end of a shadow ray. */
struct shadow_target {
	struct ray_end end; /* only if not infinite */
	bool is_infinite;
	vec3 d; /* unit direction to it */
};

struct point_finder {
	const struct world *w;
	bool has_transmission; /* some surface lets light through */
	uint32_t ray_count;
	uint32_t max_points, part_count;
	struct emitter_points *out;
	struct light_offer {
		double incident_light;
		bool is_tested;
	} * offers;		       /* the unoccluded light of each part */
	struct shadow_target *targets; /* and the point that emits it */
};

/* ---- what emitters bring ---- */

static bool transmits_light(const struct world *w, uint32_t shape)
{
	const struct shape_binding *binding = &w->shape_bindings[shape];
	return binding->is_null_face || (w->bsdfs[binding->bsdf].modes & BSDF_TRANSMIT);
}

/* Whether light arrives at x along a straight line, passing surfaces that let light through without being bent. */
static bool is_lit(const struct point_finder *f, const struct scatter_point *x, const struct shadow_target *y)
{
	const struct world *w = f->w;
	struct ray_end from = {x->p, x->ng, x->prim};
	for (int n = 0; n < SURFACES_MAX; n++) {
		struct ray_hit hit;
		struct surface_point at;
		if (y->is_infinite ? !accel_occluded_to_infinity(w->accel, &from, y->d)
				   : !accel_occluded(w->accel, &from, &y->end))
			return true;
		double end = y->is_infinite ? INFINITY : vec3_length(vec3_sub(y->end.p, from.p));
		if (!f->has_transmission || !accel_closest(w->accel, &from, y->d, 0, end, &hit) ||
		    !transmits_light(w, hit.prim.shape))
			return false;
		surface_from_hit(&w->shapes[hit.prim.shape], from.p, y->d, &hit, &at);
		from = (struct ray_end){at.p, at.ng, hit.prim};
	}
	return false;
}

/* Draws a point of the part from u. *pdf: its density as seen from x, per solid angle. Returns
 * false if there is no point. */
static bool draw_point(const struct world *w, uint32_t part, const struct emitter *em, const struct scatter_point *x,
		       const double u[2], struct emitter_point *y, struct shadow_target *target, double *pdf)
{
	double narrowed[2];
	emitter_part_remap(w, part, u, narrowed);
	if (!emitter_sample_toward(em, x->p, narrowed, y, pdf) || !(*pdf > 0))
		return false;
	*pdf *= emitter_part_density_ratio(w, part);
	*target = (struct shadow_target){.is_infinite = y->is_infinite, .d = y->p};
	if (y->is_infinite)
		return true;
	uint32_t shape = w->emitter_shapes[part];
	double time = x->prim.time;
	target->end = (struct ray_end){y->p, y->n,
				       shape == UINT32_MAX ? prim_none_at(time)
							   : (struct prim_ref){shape, y->texture_point.prim, time}};
	vec3 d = vec3_sub(y->p, x->p);
	double distance = vec3_length(d);
	if (!(distance > 0))
		return false;
	target->d = vec3_scale(1 / distance, d);
	*pdf *= distance * distance;
	if (!em->is_delta)
		*pdf /= fmax(fabs(vec3_dot(y->n, target->d)), 0x1p-30);
	return true;
}

/* Returns the light that the part would bring to x if nothing were between. */
static double unoccluded_light(const struct world *w, uint32_t part, const struct scatter_point *x, const double u[2],
			       const struct wavelengths *wl, struct shadow_target *target)
{
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(w, emitter_of_part(w, part), x->prim.time, &storage);
	struct emitter_point y;
	double pdf, sum = 0;
	if (!emitter_part_emits(w, part) || !draw_point(w, part, em, x, u, &y, target, &pdf))
		return 0;
	double cosine = vec3_dot(x->ng, target->d);
	if (x->is_opaque && !(cosine > 0))
		return 0;
	spectrum light = em->ops->radiance(em, &y, vec3_neg(target->d), wl);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		sum += light.v[i];
	double contribution = sum / pdf * (gloss_fraction + (1 - gloss_fraction) * fabs(cosine));
	return isfinite(contribution) ? contribution : 0;
}

static uint32_t brightest_untested(const struct light_offer *o, uint32_t n)
{
	uint32_t best = UINT32_MAX;
	for (uint32_t i = 0; i < n; i++)
		if (!o[i].is_tested && o[i].incident_light > 0 &&
		    (best == UINT32_MAX || o[i].incident_light > o[best].incident_light))
			best = i;
	return best;
}

/* Draws the numbers of one point or step of a walk; `use` counts from 0. */
static void draw_numbers(uint64_t walk, uint64_t step, uint64_t use, double u[4])
{
	rng_uniform4(0, RNG_EMITTERS, walk, step, use, u);
}

/* Adds the point x with its shares, if any light arrives there. */
static void add_point(struct point_finder *f, const struct scatter_point *x, uint64_t walk, uint64_t step)
{
	const struct world *w = f->w;
	double u[4], arrived = 0, sum = 0;
	draw_numbers(walk, step, 1, u);
	const struct wavelengths wl = world_sample_wavelengths(w, u[2]);
	for (uint32_t i = 0; i < f->part_count; i++)
		f->offers[i] = (struct light_offer){unoccluded_light(w, i, x, u, &wl, &f->targets[i]), false};
	for (int n = 0; n < TESTS_MAX; n++) {
		uint32_t i = brightest_untested(f->offers, f->part_count);
		if (i == UINT32_MAX || f->offers[i].incident_light < faint_fraction * arrived)
			break;
		f->offers[i].is_tested = true;
		f->ray_count++;
		if (is_lit(f, x, &f->targets[i]))
			arrived += f->offers[i].incident_light;
		else
			f->offers[i].incident_light = 0;
	}
	for (uint32_t i = 0; i < f->part_count; i++)
		sum += f->offers[i].incident_light;
	if (!(sum > 0) || !isfinite(sum))
		return;
	struct emitter_points *out = f->out;
	float *share = &out->shares[(size_t)out->count * f->part_count];
	for (uint32_t i = 0; i < f->part_count; i++)
		share[i] = (float)(f->offers[i].incident_light / sum);
	out->nodes[out->count] = (struct point_tree_node){x->p, out->count};
	out->count++;
}

/* ---- walks ---- */

struct walk_step {
	struct ray_end origin;
	vec3 d;
	double t_min, t_max;
};

/* Starts a walk at the camera. Returns false if the camera sees nothing at that film point. */
static bool start_walk(const struct world *w, uint64_t walk, struct walk_step *s)
{
	const struct scene_settings *set = &w->settings;
	struct camera storage;
	double u[4], v[4];
	draw_numbers(walk, 0, 0, u);
	draw_numbers(walk, 0, 2, v);
	const struct camera *c = camera_at(&w->camera, u[2], &storage);
	double x = set->crop_x + u[0] * scene_settings_width(set), y = set->crop_y + u[1] * scene_settings_height(set);
	if (!camera_film_point_is_valid(c, x, y))
		return false;
	s->origin = (struct ray_end){.p = camera_sample_point(c, v), .prim = prim_none_at(u[2])};
	s->d = camera_direction(c, s->origin.p, x, y);
	camera_clip_range(c, s->d, &s->t_min, &s->t_max);
	return true;
}

static vec3 mirror_direction(vec3 d, vec3 n)
{
	return vec3_madd(d, -2 * vec3_dot(d, n), n);
}

/* Returns the direction in which a walk that came along d continues. n: unit normal on the side from which it came. */
static vec3 scatter_direction(const struct bsdf *b, vec3 d, vec3 n, const double u[4])
{
	bool transmits = (b->modes & BSDF_TRANSMIT) && (u[2] < 0.5 || !(b->modes & BSDF_REFLECT));
	if (!b->has_smooth || (b->has_delta && u[3] < 0.5))
		return transmits ? d : mirror_direction(d, n);
	/* A direction distributed by the cosine. */
	struct frame axes = frame_around(transmits ? vec3_neg(n) : n);
	double r = sqrt(u[0]), phi = 2 * M_PI * u[1];
	return frame_to_world(&axes, (vec3){r * cos(phi), r * sin(phi), sqrt(1 - u[0])});
}

/* Adds a point on the way to the next surface, which is at `distance`. */
static void add_point_in_medium(struct point_finder *f, const struct walk_step *s, double distance, uint64_t walk,
				uint64_t step)
{
	double u[4];
	draw_numbers(walk, step, 2, u);
	const struct scatter_point x = {.p = vec3_madd(s->origin.p, s->t_min + u[0] * (distance - s->t_min), s->d),
					.prim = prim_none_at(s->origin.prim.time)};
	add_point(f, &x, walk, STEPS_MAX + step);
}

/* Continues a walk to the next surface and adds a point there if it scatters, which is counted in *points.
 * Returns false if the walk ends. */
static bool step_to_surface(struct point_finder *f, struct walk_step *s, uint64_t walk, uint64_t number, int *points)
{
	const struct world *w = f->w;
	struct ray_hit hit;
	struct surface_point at;
	double u[4];
	if (!accel_closest(w->accel, &s->origin, s->d, s->t_min, s->t_max, &hit))
		return false;
	surface_from_hit(&w->shapes[hit.prim.shape], s->origin.p, s->d, &hit, &at);
	if (EFFECT_IS_ON(w, scattering) && f->out->count < f->max_points)
		add_point_in_medium(f, s, vec3_length(vec3_sub(at.p, s->origin.p)), walk, number);
	const struct shape_binding *binding = &w->shape_bindings[hit.prim.shape];
	const struct bsdf *b = &w->bsdfs[binding->bsdf];
	vec3 n = vec3_dot(at.ng, s->d) > 0 ? vec3_neg(at.ng) : at.ng;
	if (!binding->is_null_face && b->has_smooth && f->out->count < f->max_points) {
		const struct scatter_point x = {at.p, n, hit.prim, !(b->modes & BSDF_TRANSMIT)};
		add_point(f, &x, walk, number);
		++*points;
	}
	draw_numbers(walk, number, 0, u);
	if (!binding->is_null_face)
		s->d = scatter_direction(b, s->d, n, u);
	s->origin = (struct ray_end){at.p, at.ng, hit.prim};
	s->t_min = 0;
	s->t_max = INFINITY;
	return binding->is_null_face || !b->is_black;
}

int emitter_points_find(const struct world *w, uint32_t max_points, struct arena *arena, struct emitter_points *out)
{
	struct point_finder f = {.w = w, .max_points = max_points, .part_count = emitter_part_count(w), .out = out};
	out->count = 0;
	out->nodes = arena_alloc(arena, max_points, sizeof *out->nodes);
	out->shares = arena_alloc(arena, (size_t)max_points * f.part_count, sizeof *out->shares);
	f.offers = arena_alloc(arena, f.part_count, sizeof *f.offers);
	f.targets = arena_alloc(arena, f.part_count, sizeof *f.targets);
	if (!out->nodes || !out->shares || !f.offers || !f.targets)
		return -ENOMEM;
	for (uint32_t i = 0; i < w->shape_count; i++)
		f.has_transmission |= transmits_light(w, i);
	for (uint64_t walk = 0;
	     walk < (uint64_t)WALKS_PER_POINT * max_points && out->count < max_points && f.ray_count < RAYS_MAX;
	     walk++) {
		struct walk_step s;
		int points = 0;
		if (!start_walk(w, walk, &s))
			continue;
		for (uint64_t n = 1; n <= STEPS_MAX && points < POINTS_PER_WALK; n++)
			if (!step_to_surface(&f, &s, walk, n, &points))
				break;
	}
	return 0;
}
