/* A true sphere; what is scaled unevenly is refused. */
#include "worker/shape/declare.h"
#include "worker/shape/mesh.h"

#include <float.h>

static const struct param params[] = {
	{"center", UNDERSTOOD(VALUE_POINT)},
	{"radius", VALUE_FLOAT, PARAM_UNDERSTOOD, DBL_MIN, MESH_COORDINATE_MAX, NULL},
	SHAPE_PARAMS_END,
};

/* Written matrices have six digits: that much unevenness passes for a similarity. */
#define SIMILARITY_TOLERANCE 1e-4

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	(void)assets, (void)arena;
	out->kind = SHAPE_SPHERE;
	struct sphere *s = &out->sphere;
	mat4 m = node_transform(n, "to_world");
	vec3 x = {m.m[0][0], m.m[1][0], m.m[2][0]}, y = {m.m[0][1], m.m[1][1], m.m[2][1]}, z = {m.m[0][2], m.m[1][2], m.m[2][2]};
	double lx = vec3_length(x), ly = vec3_length(y), lz = vec3_length(z), scale = cbrt(fabs(mat4_det3(m)));
	double uneven = fmax(fabs(lx - scale), fmax(fabs(ly - scale), fabs(lz - scale)));
	if (!(scale > 0) || !(uneven <= SIMILARITY_TOLERANCE * scale))
		return node_error(n, e, EINVAL, "to_world must turn, move and scale a sphere evenly; use a mesh for an ellipsoid");
	const struct property *center = node_find(n, "center");
	s->center = mat4_point(&m, center ? center->value.as.point : (vec3){0, 0, 0});
	s->radius = scale * node_float(n, "radius", 1.0);
	s->flip_normals = node_bool(n, "flip_normals", false);
	if (!(s->radius > 0) || !(s->radius <= MESH_COORDINATE_MAX) ||
	    !(vec3_length(s->center) <= MESH_COORDINATE_MAX))
		return node_error(n, e, ERANGE, "a sphere of radius %g around (%g, %g, %g)", s->radius, s->center.x,
				  s->center.y, s->center.z);
	double hand = vec3_dot(vec3_cross(x, y), z) < 0 ? -1 : 1;
	z = vec3_normalize(z);
	x = vec3_normalize(vec3_madd(x, -vec3_dot(x, z), z));
	y = vec3_scale(hand, vec3_cross(z, x));
	s->to_world = (mat4){{{x.x, y.x, z.x, 0}, {x.y, y.y, z.y, 0}, {x.z, y.z, z.z, 0}, {0, 0, 0, 1}}};
	return 0;
}

const struct shape_ops shape_ops_sphere = {"sphere", params, build};
