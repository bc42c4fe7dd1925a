/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Emitters. One file per plug-in and one line in emitter_list.h; the generic tests include it. A point on an emitter is
 * a position with a normal, or, for emitters at infinity, the unit direction from the scene towards it. Measures:
 * `pdf_point` and `pdf_toward` are per area (world units of the rescaled scene), or per solid angle at infinity.
 * Immutable after creation; any thread; allocates nothing after create.
 *
 * Delta emitters are a single point (or direction): no path hits them by chance, x_0 has the counting measure, and both
 * densities are 1. `radiance` gives intensity per solid angle at a point (without a cosine; n is 0), or irradiance
 * across the direction at infinity.
 */
#ifndef WORKER_RENDER_EMITTER_EMITTER_H
#define WORKER_RENDER_EMITTER_EMITTER_H

#include "worker/render/math/frame.h"
#include "worker/render/math/motion.h"
#include "worker/render/texture/texture.h"

struct emitter_point {
	vec3 p;			    /* position, or direction towards the emitter when infinite */
	vec3 n;			    /* unit normal on the emitting side; 0 at a delta emitter; unused when infinite */
	struct texture_point where; /* on the surface; unused when infinite */
	bool infinite;
};

/* The surface of an area emitter in the rescaled world. Its triangles are those that rays hit. */
struct emitter_surface {
	bool is_sphere;
	vec3 center;
	double radius, normal_sign; /* -1: normals point inwards */
	struct frame sphere_axes;   /* of the (u,v) parametrisation */
	uint32_t triangle_count;
	const float (*position)[3];
	const double (*unrounded)[3]; /* NULL: position; see worker/render/geom/primitive.h */
	const uint32_t (*index)[3];
	const float (*uv)[2];	    /* NULL: none */
	const struct motion *moves; /* to the rescaled world, for a sphere from where it is here; NULL: it is still */
};

struct emitter_build {
	const struct asset_source *assets;
	struct arena *arena;
	bool dialect_3;
	const struct emitter_surface *surface; /* NULL if it has no shape */
	struct attribute_table *attributes;    /* of the mesh; NULL: none */
	vec3 center;			       /* a scene point p is at scale (p - center) in the rescaled world */
	double scale;
	const struct volume_build *volumes; /* NULL: none */
	double shutter_open, shutter_close; /* of the camera */
};

struct emitter;

struct emitter_ops {
	struct plugin_decl decl;
	size_t data_size;   /* of em->data, which is zeroed memory before `create`; 0: it has none yet */
	bool needs_surface; /* area: belongs to a shape */
	bool in_medium;	    /* what is inside its shape shines: no struct emitter is made of it */
	int (*create)(struct emitter *em, const struct scene_node *n, const struct emitter_build *build,
		      struct error *e);
	/* Radiance leaving x in direction w (unit, away from the emitter, into the scene). */
	spectrum (*radiance)(const struct emitter *em, const struct emitter_point *x, vec3 w,
			     const struct wavelengths *wl);
	/* Samples where a light sub-path starts. */
	bool (*sample_point)(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf_point);
	double (*pdf_point)(const struct emitter *em, const struct emitter_point *x);
	/* The numbers in [0,1) from which sample_point makes x; NULL for delta emitters. */
	void (*point_inverse)(const struct emitter *em, const struct emitter_point *x, double u[2]);
	/* Samples the direction in which it leaves; not called for infinite emitters. */
	bool (*sample_direction)(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
				 double *pdf_solid);
	double (*pdf_direction)(const struct emitter *em, const struct emitter_point *x, vec3 w);
	/* Samples a point for next event estimation from ref. Both NULL: as sample_point and pdf_point. */
	bool (*sample_toward)(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x,
			      double *pdf_toward);
	double (*pdf_toward)(const struct emitter *em, vec3 ref, const struct emitter_point *x);
	/* Puts it where a transform to the rescaled world leads: the motion of its surface, or what its to_world, a
	 * VALUE_PLACE, is at a time. NULL: it cannot move. */
	void (*place)(struct emitter *em, const mat4 *to_world);
};

struct emitter {
	const struct emitter_ops *ops;
	bool infinite, textured, delta;
	bool beam; /* a delta emitter of one direction: no path is joined to it, and light sub-paths begin all alike */
	enum color_shape shape; /* CONSTANT, D65: the same spectrum everywhere, up to a factor */
	double power; /* for choosing among emitters: area x pi x mean radiance; infinite ones: mean radiance x 4 pi, or
			 irradiance, which the caller multiplies by the scene's cross section pi R^2 */
	double brightest; /* upper bound of the radiance over places, directions and wavelengths; for delta emitters a
			     bound that pixels are expected to stay below, see delta.h */
	const struct motion *moves; /* to the rescaled world; NULL: it is still. Otherwise `data` is that when the
				       shutter opens */
	void *data;
};

/* For an emitter that moves, as it is at one time. */
enum { EMITTER_ROOM = 1024 };
struct emitter_room {
	struct emitter em;
	_Alignas(16) unsigned char data[EMITTER_ROOM];
};

void emitter_move(const struct emitter *em, double time, struct emitter_room *room) __attribute__((cold));
static inline const struct emitter *emitter_at(const struct emitter *em, double time, struct emitter_room *room)
{
	if (!em->moves)
		return em;
	emitter_move(em, time, room);
	return &room->em;
}

static inline bool emitter_sample_toward(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x,
					 double *pdf_toward)
{
	return em->ops->sample_toward ? em->ops->sample_toward(em, ref, u, x, pdf_toward)
				      : em->ops->sample_point(em, u, x, pdf_toward);
}

static inline double emitter_pdf_toward(const struct emitter *em, vec3 ref, const struct emitter_point *x)
{
	return em->ops->pdf_toward ? em->ops->pdf_toward(em, ref, x) : em->ops->pdf_point(em, x);
}

/* Whether it belongs to a shape. */
bool emitter_needs_surface(const struct scene_node *n);
/* Whether the medium inside a shape shines. */
bool emitter_is_in_medium(const struct scene_node *n);

int emitter_create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e);

/* Reads property `name` of an emitter: a colour or a texture; 1 if absent. */
int emitter_texture(struct texture *t, const struct scene_node *n, const char *name, enum color_role role,
		    const struct emitter_build *build, struct error *e);

extern const struct emitter_ops *const emitter_registry[]; /* ends with NULL */

#endif
