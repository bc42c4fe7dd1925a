/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Emitters. One file per plug-in and one line in emitter_list.h; the generic tests include it. A point on an emitter is
 * a position with a normal, or, for emitters at infinity, the unit direction from the scene towards it. Measures:
 * `pdf_point` and `pdf_toward` are per area (world units of the rescaled scene), or per solid angle at infinity.
 * Immutable after creation; any thread; allocates nothing after create.
 *
 * Delta emitters are a single point (or direction): no path hits them by chance, x_0 is in the counting measure, and
 * both densities are 1. `radiance` gives intensity per solid angle at a point (without a cosine; n is 0), or irradiance
 * across the direction at infinity.
 */
#ifndef WORKER_RENDER_EMITTER_EMITTER_H
#define WORKER_RENDER_EMITTER_EMITTER_H

#include "worker/render/math/frame.h"
#include "worker/render/math/motion.h"
#include "worker/render/texture/texture.h"

struct emitter_point {
	vec3 p; /* position, or direction towards the emitter when infinite */
	vec3 n; /* unit normal on the emitting side; 0 at a delta emitter; unused when infinite */
	struct texture_point texture_point; /* on the surface; unused when infinite */
	bool is_infinite;
};

/* The surface of an area emitter in the rescaled world. Its triangles are those that rays hit. */
struct emitter_surface {
	bool is_sphere;
	vec3 center;
	double radius, normal_sign; /* -1: normals point inwards */
	struct frame sphere_axes;   /* axes of the (u,v) parametrisation */
	uint32_t triangle_count;
	const float (*position)[3];
	const double (*unrounded)[3]; /* replaces `position` unless NULL; see worker/render/geom/primitive.h */
	const uint32_t (*index)[3];
	const float (*uv)[2];	     /* NULL: none */
	const struct motion *motion; /* to the rescaled world, of a sphere from `center`; NULL: no motion */
};

struct emitter_build {
	const struct asset_source *assets;
	struct arena *arena;
	bool is_dialect_3;
	const struct emitter_surface *surface; /* NULL: the emitter has no shape */
	struct attribute_table *attributes;    /* of the mesh; NULL: none */
	vec3 world_center; /* a scene point p is at world_scale (p - world_center) in the rescaled world */
	double world_scale;
	const struct volume_build *volumes; /* NULL: none */
	double shutter_open, shutter_close; /* of the camera */
};

struct emitter;

struct emitter_ops {
	struct plugin_decl decl;
	size_t data_size;   /* bytes of em->data, which is zeroed before `create` is called; 0: none */
	bool needs_surface; /* belongs to a shape */
	bool is_volumetric; /* the medium inside its shape emits: no struct emitter is created for it */
	int (*create)(struct emitter *em, const struct scene_node *n, const struct emitter_build *build,
		      struct error *e);
	/* Returns the radiance that leaves x in direction w (unit, away from the emitter, into the scene). */
	spectrum (*radiance)(const struct emitter *em, const struct emitter_point *x, vec3 w,
			     const struct wavelengths *wl);
	/* Samples the point at which a light sub-path starts. Returns false if there is none. */
	bool (*sample_point)(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf_point);
	double (*pdf_point)(const struct emitter *em, const struct emitter_point *x);
	/* Computes the numbers in [0,1) that sample_point maps to x; NULL for delta emitters. */
	void (*point_inverse)(const struct emitter *em, const struct emitter_point *x, double u[2]);
	/* Samples the direction in which a light sub-path leaves x; pdf_solid: per solid angle. Not called for infinite
	 * emitters. */
	bool (*sample_direction)(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
				 double *pdf_solid);
	double (*pdf_direction)(const struct emitter *em, const struct emitter_point *x, vec3 w);
	/* Samples a point for next event estimation from ref. If both are NULL, sample_point and pdf_point are used. */
	bool (*sample_toward)(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x,
			      double *pdf_toward);
	double (*pdf_toward)(const struct emitter *em, vec3 ref, const struct emitter_point *x);
	/* Moves the emitter to its position at one time. to_world: transform to the rescaled world, from the motion of
	 * the surface or from the emitter's own to_world, a VALUE_TRANSFORM_OR_ANIMATION. NULL: the emitter cannot
	 * move. */
	void (*set_transform)(struct emitter *em, const mat4 *to_world);
};

struct emitter {
	const struct emitter_ops *ops;
	bool is_infinite, is_textured, is_delta;
	bool is_beam; /* a delta emitter of one direction: nothing connects to it, and all its light sub-paths begin
		       * alike
		       */
	enum color_kind color_kind; /* CONSTANT, D65: the same spectrum everywhere, up to a factor */
	double power; /* for choosing among emitters: area x pi x mean radiance; infinite ones: mean radiance x 4 pi, or
			 irradiance, which the caller multiplies by the scene's cross section pi R^2 */
	double brightness_bound; /* upper bound of the radiance over positions, directions and wavelengths; for delta
			     emitters, a bound below which pixels are expected to stay (delta.h) */
	const struct motion *motion; /* motion to the rescaled world; NULL: none. With one, `data` describes the emitter
				       when the shutter opens */
	void *data;
};

/* Storage for a moving emitter at one time. EMITTER_DATA_MAX: the largest data_size. */
enum { EMITTER_DATA_MAX = 1024 };
struct emitter_storage {
	struct emitter em;
	_Alignas(16) unsigned char data[EMITTER_DATA_MAX];
};

/* Sets storage->em to the moving emitter em at the given time. emitter_at returns it, or em if em does not move. */
void emitter_move(const struct emitter *em, double time, struct emitter_storage *storage) __attribute__((cold));
static inline const struct emitter *emitter_at(const struct emitter *em, double time, struct emitter_storage *storage)
{
	if (!em->motion)
		return em;
	emitter_move(em, time, storage);
	return &storage->em;
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

/* Returns whether emitters of this type belong to a shape. */
bool emitter_needs_surface(const struct scene_node *n);
/* Returns whether emitters of this type make the medium inside a shape emit. */
bool emitter_is_volumetric(const struct scene_node *n);

/* Creates em from n, with em->data in build->arena. Returns 0 or a negative error code: -ENOTSUP if the type is not
 * known, -EINVAL if it has to be inside a shape and is not, or the other way round, -ENOMEM, or the code of the
 * plug-in. */
int emitter_create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e);

/* Reads the property `name` of an emitter, a colour or a texture; 1 if absent. Returns 0 or a negative error code. */
int emitter_read_texture(struct texture *t, const struct scene_node *n, const char *name, enum color_role role,
			 const struct emitter_build *build, struct error *e);

extern const struct emitter_ops *const emitter_registry[]; /* ends with NULL */

#endif
