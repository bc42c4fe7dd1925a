/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An exact sphere. If to_world scales it unevenly, it is an ellipsoid: a mesh of 8 * 4^ELLIPSOID_LEVEL triangles with
 * exact normals.
 */
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"

#include <float.h>

/* A transform with at most this relative unevenness counts as a similarity, since matrices in files have six digits. */
#define SIMILARITY_TOLERANCE 1e-4

enum { ELLIPSOID_LEVEL = 6 };

static double zero_height(const void *user, double u, double v)
{
	(void)user, (void)u, (void)v;
	return 0;
}

static int check_extent(const struct sphere *s, const struct scene_node *n, struct error *e)
{
	if (s->radius > 0 && s->radius <= MESH_COORDINATE_MAX && vec3_length(s->center) <= MESH_COORDINATE_MAX)
		return 0;
	return node_error(n, e, ERANGE, "a sphere of radius %g around (%g, %g, %g)", s->radius, s->center.x,
			  s->center.y, s->center.z);
}

/* Makes the mesh in object space; shape_build applies to_world. */
static int make_ellipsoid(const struct scene_node *n, struct arena *arena, struct shape_geometry *out, struct error *e)
{
	const struct displacement flat = {
		.height = zero_height, .is_constant = true, .level = ELLIPSOID_LEVEL, .tessellation = 1};
	out->sphere.to_world = mat4_identity();
	int r = check_extent(&out->sphere, n, e);
	return r ? r : displace_geometry(out, &flat, arena, n, e);
}

static int make_sphere(const struct scene_node *n, const mat4 *m, double scale, vec3 x, vec3 z, struct sphere *s,
		       struct error *e)
{
	s->center = mat4_point(m, s->center);
	s->radius *= scale;
	s->flips_normals = node_bool(n, "flip_normals", false);
	double handedness = mat4_det3(*m) < 0 ? -1 : 1;
	z = vec3_normalize(z);
	x = vec3_normalize(vec3_madd(x, -vec3_dot(x, z), z));
	vec3 y = vec3_scale(handedness, vec3_cross(z, x));
	s->to_world = (mat4){{{x.x, y.x, z.x, 0}, {x.y, y.y, z.y, 0}, {x.z, y.z, z.z, 0}, {0, 0, 0, 1}}};
	return check_extent(s, n, e);
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	(void)assets;
	mat4 m = node_transform(n, "to_world");
	vec3 x = {m.m[0][0], m.m[1][0], m.m[2][0]}, y = {m.m[0][1], m.m[1][1], m.m[2][1]},
	     z = {m.m[0][2], m.m[1][2], m.m[2][2]};
	double lx = vec3_length(x), ly = vec3_length(y), lz = vec3_length(z), scale = cbrt(fabs(mat4_det3(m)));
	double unevenness = fmax(fabs(lx - scale), fmax(fabs(ly - scale), fabs(lz - scale)));
	const struct property *center = node_find_property(n, "center");
	out->kind = SHAPE_SPHERE;
	out->sphere.center = center ? center->value.as.point : (vec3){0, 0, 0};
	out->sphere.radius = node_float(n, "radius", 1);
	if (!(scale > 0))
		return node_error(n, e, EINVAL, "to_world flattens the shape (it has no inverse)");
	if (!(unevenness <= SIMILARITY_TOLERANCE * scale))
		return make_ellipsoid(n, arena, out, e);
	return make_sphere(n, &m, scale, x, z, &out->sphere, e);
}

SHAPE_OPS(sphere, {"center", VALUE_POINT, PARAM_UNDERSTOOD, -MESH_COORDINATE_MAX, MESH_COORDINATE_MAX, NULL},
	  {"radius", VALUE_FLOAT, PARAM_UNDERSTOOD, DBL_MIN, MESH_COORDINATE_MAX, NULL}, SHAPE_PARAMS);
