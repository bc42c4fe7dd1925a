/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Functions shared by emitters that belong to a shape: their radiance, and points on their surface, uniform per area.
 * `data` of such an emitter begins with struct surface_light.
 *
 * On a mesh that moves, triangles are chosen by their areas at the opening of the shutter, and points uniformly within
 * a triangle, so that the density is known at every time even if the motion stretches the mesh.
 */
#ifndef WORKER_RENDER_EMITTER_SURFACE_LIGHT_H
#define WORKER_RENDER_EMITTER_SURFACE_LIGHT_H

#include "worker/render/emitter/emitter.h"

struct surface_light {
	struct texture radiance;
	struct emitter_surface surface;
	double area; /* in the rescaled world; of a moving surface the mean over time, of a sphere that has been placed
			its area then */
	double *cdf; /* cumulative areas of triangles; cdf[triangle_count] = 1; NULL: a sphere */
	bool is_moving_mesh; /* a mesh that moves: positions are in its own frame, which to_world transforms to the
			rescaled world */
	mat4 to_world;
	bool has_computed_corners; /* corners are not simply surface.position: `is_moving_mesh`, or surface.unrounded */
};

/* Reads `radiance` and sets all members of `em` except its power; brightness_bound becomes the largest radiance.
 * build->surface must not be NULL. Returns 0, -EINVAL with a sentence if the surface has no area, or another negative
 * error code. */
int surface_light_create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build,
			 struct error *e);

/* Operations of struct emitter_ops. A plug-in with further data that depends on the position has its own
 * `set_transform`. */
void surface_light_set_transform(struct emitter *em, const mat4 *to_world);
bool surface_light_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf);
double surface_light_pdf_point(const struct emitter *em, const struct emitter_point *x);
void surface_light_point_inverse(const struct emitter *em, const struct emitter_point *x, double u[2]);
#define SURFACE_LIGHT_OPS                                                                                        \
	.needs_surface = true, .sample_point = surface_light_sample_point, .pdf_point = surface_light_pdf_point, \
	.point_inverse = surface_light_point_inverse

/* Sets x to the point of a sphere in the unit direction w from its centre. */
void surface_light_set_sphere_point(const struct surface_light *l, vec3 w, struct emitter_point *x);
/* Sets x to the point of a triangle with the barycentric weights b1 of its second corner and b2 of its third. */
void surface_light_set_triangle_point(const struct surface_light *l, uint32_t triangle, double b1, double b2,
				      struct emitter_point *x);
/* Computes the barycentric weights of the triangle's second and third corner at a point p in its plane. */
void surface_light_barycentrics(const struct surface_light *l, uint32_t triangle, vec3 p, double b[2]);
/* Returns the normal of a triangle, with twice its area as length. */
vec3 surface_light_normal(const struct surface_light *l, uint32_t triangle);
/* Returns corner k, from 0 to 2, of a triangle. */
vec3 surface_light_corner(const struct surface_light *l, uint32_t triangle, int k);

#endif
