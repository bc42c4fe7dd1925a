/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shared by emitters that belong to a shape: their radiance, and points on their surface, uniform per area. `data` of
 * such an emitter begins with struct surface_light.
 *
 * A mesh that moves has its triangles by the areas that they have when the shutter opens, and points uniform within
 * each, so that the density is known at every time, however it is stretched by then.
 */
#ifndef WORKER_RENDER_EMITTER_SURFACE_LIGHT_H
#define WORKER_RENDER_EMITTER_SURFACE_LIGHT_H

#include "worker/render/emitter/emitter.h"

struct surface_light {
	struct texture radiance;
	struct emitter_surface surface;
	double area; /* of the rescaled world; of what moves, the mean over the time, until it is placed: a sphere's
			then */
	double *cdf; /* of triangles; cdf[triangle_count] = 1; NULL: a sphere */
	bool placed; /* positions are those of a mesh's own frame, from which this leads to the rescaled world: */
	mat4 to_world;
	bool other; /* corners are not what position says */
};

/* Reads `radiance` and sets everything of `em` except its power: data, and brightest to the largest radiance. -EINVAL
 * with a sentence if the surface, which must be there, has no area above 0. */
int surface_light_create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build,
			 struct error *e);

/* Operations of struct emitter_ops. A plug-in that keeps more of its place than that has its own `place`. */
void surface_light_place(struct emitter *em, const mat4 *to_world);
bool surface_light_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf);
double surface_light_pdf_point(const struct emitter *em, const struct emitter_point *x);
void surface_light_point_inverse(const struct emitter *em, const struct emitter_point *x, double u[2]);
#define SURFACE_LIGHT_OPS                                                                                        \
	.needs_surface = true, .sample_point = surface_light_sample_point, .pdf_point = surface_light_pdf_point, \
	.point_inverse = surface_light_point_inverse

/* The point of a sphere in direction w (unit) from its centre. */
void surface_light_on_sphere(const struct surface_light *l, vec3 w, struct emitter_point *x);
/* The point of a triangle with weight b1 of its second corner and b2 of its third. */
void surface_light_on_triangle(const struct surface_light *l, uint32_t triangle, double b1, double b2,
			       struct emitter_point *x);
/* The barycentric weights of the triangle's second and third corner at a point in its plane. */
void surface_light_weights(const struct surface_light *l, uint32_t triangle, vec3 p, double b[2]);
/* The normal of a triangle; its length is twice the area. */
vec3 surface_light_normal(const struct surface_light *l, uint32_t triangle);
/* A corner of a triangle, k in 0..2. */
vec3 surface_light_corner(const struct surface_light *l, uint32_t triangle, int k);

#endif
