/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The world that all threads share: built once from a description, then immutable. Lengths are rescaled in double by a
 * power of two so that the scene's radius is in (1/2, 1], and the origin is moved to the centre of the scene's box or,
 * in a scene of mixed scales, among the small things (world_origin.h). Only then are positions rounded to float.
 */
#ifndef WORKER_RENDER_WORLD_WORLD_H
#define WORKER_RENDER_WORLD_WORLD_H

#include "worker/render/camera/camera.h"
#include "worker/render/geom/surface.h"
#include "worker/render/medium/medium.h"
#include "worker/render/settings/accuracy_settings.h"
#include "worker/render/world/box.h"
#include "worker/render/world/effects.h"

struct emitter_choice;
struct refracting_point;

struct shape_binding {
	uint32_t bsdf;
	int32_t emitter;	     /* -1: not an emitter */
	uint32_t interior, exterior; /* number of the medium: 1 + its index; 0: none */
	bool is_null_face;	     /* a face of `null` that is not a vertex of paths: path/media.h */
};

/* Sets *medium to the medium on one side of a shape that states media. Returns false if the shape states none. */
static inline bool world_medium_of_side(const struct shape_binding *s, bool outside, uint32_t *medium)
{
	if (!s->interior && !s->exterior)
		return false;
	*medium = outside ? s->exterior : s->interior;
	return true;
}

struct world {
	struct arena arena;
	struct scene_settings settings;
	struct effects effects;
	struct accuracy_settings accuracy;
	struct camera camera;
	vec3 center;
	/* scale: factor from scene to world lengths; radius: that of the rescaled bounding sphere around the origin. */
	double scale, radius;
	uint32_t shape_count, bsdf_count, emitter_count;
	uint32_t instance_count; /* number of instances in the scene, whether or not they share meshes */
	/* Number of shapes that share a mesh with others, and number of these meshes. */
	uint32_t sharing_shape_count, shared_mesh_count;
	struct geom_shape *shapes;
	struct shape_binding *shape_bindings; /* one per shape */
	struct bsdf *bsdfs;
	struct emitter *emitters;
	/* camera_medium: 1 + its index, as in shape_binding; 0: none. */
	uint32_t media_count, camera_medium;
	struct medium *media;
	bool has_null_faces;	       /* is_null_face is set for some shape */
	struct box see_through_bounds; /* bounds all surfaces that connections may look through; may be empty */
	struct box refracting_bounds;  /* bounds all surfaces that may refract connections; may be empty */
	struct refracting_point *refracting_points; /* points on these surfaces: refracting.h */
	uint32_t refracting_point_count;
	/* The medium around each emitter whose shape states none; only where media scatter. */
	uint32_t *emitter_media;
	uint32_t *emitter_shapes;	   /* the shape of each emitter; UINT32_MAX: none */
	double *emitter_pdf, *emitter_cdf; /* density and distribution function of the choice by light sub-paths */
	/* The choice for next event estimation; NULL: by emitter_pdf everywhere. */
	struct emitter_choice *emitter_choice;
	/* Index of the emitter that escaping rays meet; -1: none. */
	int32_t environment;
	double grey_xyz[3];			    /* CIE XYZ of the grey value 1 */
	struct coincidence *coincidence;	    /* coinciding surfaces; NULL: none */
	struct coincidence_notes coincidence_notes; /* notes about coinciding surfaces */
	struct world_notes notes;
	struct accel *accel;
};

/* Checks an effect while rendering. -DHSLT_PLAIN turns all of them off, to measure what these checks
 * cost (tests/bench/effects.c). */
#ifdef HSLT_PLAIN
#define EFFECT_IS_ON(w, effect) ((void)(w), false)
#else
#define EFFECT_IS_ON(w, effect) ((w)->effects.effect)
#endif

/* Returns what a path carries, chosen by a number in [0,1): wavelengths; R, G and B; or nothing in a grey scene. */
static inline struct wavelengths world_sample_wavelengths(const struct world *w, double u)
{
	if (!EFFECT_IS_ON(w, colour))
		return (struct wavelengths){.is_grey = true};
	if (w->accuracy.colour > 0)
		return (struct wavelengths){.is_rgb = true};
	return wavelengths_sample_distinct(u, (unsigned)w->accuracy.wavelengths);
}

/* Whether the shutter rolls, so that the time of a path depends on its film point. */
static inline bool world_has_rolling_shutter(const struct world *w)
{
	return EFFECT_IS_ON(w, motion) && w->settings.rolling_shutter != ROLL_NONE;
}

/* Returns the camera at the time of a path's vertex; `storage` is used if the camera moves. */
static inline const struct camera *world_camera_at(const struct world *w, const struct surface_point *x,
						   struct camera *storage)
{
	return camera_at(&w->camera, x->prim.time, storage);
}

/* Returns an emitter at the time of a path's vertex; `storage` is used if the emitter moves. */
static inline const struct emitter *world_emitter_at(const struct world *w, int32_t emitter, double time,
						     struct emitter_storage *storage)
{
	return emitter_at(&w->emitters[emitter], time, storage);
}

/* Returns the emitter selected by a number in [0,1); -1 if there is none. */
int32_t world_pick_emitter(const struct world *w, double u);

/* Converts a surface point to a texture_point. */
static inline struct texture_point world_texture_point(const struct surface_point *x)
{
	return (struct texture_point){x->u, x->v, x->b1, x->b2, x->prim.prim, .p = x->p};
}

/* Converts a surface point to a point of its emitter. */
static inline struct emitter_point world_emitter_point(const struct surface_point *x)
{
	return (struct emitter_point){x->p, x->ng, world_texture_point(x), false};
}

/* Converts a surface point to a point of its BSDF. */
static inline struct bsdf_point world_bsdf_point(const struct surface_point *x, const struct wavelengths *w,
						 enum transport transport)
{
	return (struct bsdf_point){world_texture_point(x),
				   w,
				   transport,
				   x->shape && x->shape->culls_backfaces,
				   {x, surface_frame_with_relief}};
}

#endif
