#include "worker/scene/displace.h"
#include "worker/scene/mesh_raw.h"

#include <float.h>
#include <string.h>

#define UNDERSTOOD(types) types, PARAM_UNDERSTOOD, 0, 0, NULL
#define IGNORED 0, PARAM_IGNORED, 0, 0, NULL
#define REFUSED 0, PARAM_REFUSED, 0, 0, NULL
#define PARAM_END {NULL, 0, 0, 0, 0, NULL}

static const struct param obj_params[] = {
	{"filename", UNDERSTOOD(VALUE_STRING)},
	{"to_world", UNDERSTOOD(VALUE_TRANSFORM)},
	{"face_normals", UNDERSTOOD(VALUE_BOOL)},
	{"flip_normals", UNDERSTOOD(VALUE_BOOL)},
	{"flip_tex_coords", UNDERSTOOD(VALUE_BOOL)},
	{"collapse", IGNORED},
	{"load_materials", IGNORED}, /* .mtl files are never read */
	{"max_smooth_angle", REFUSED},
	{"shape_index", REFUSED},
	DISPLACE_PARAMS,
	PARAM_END,
};

static const struct param rectangle_params[] = {
	{"to_world", UNDERSTOOD(VALUE_TRANSFORM)},
	{"flip_normals", UNDERSTOOD(VALUE_BOOL)},
	DISPLACE_PARAMS,
	PARAM_END,
};

static const struct param sphere_params[] = {
	{"center", UNDERSTOOD(VALUE_POINT)},
	{"radius", VALUE_FLOAT, PARAM_UNDERSTOOD, DBL_MIN, MESH_COORDINATE_MAX, NULL},
	{"to_world", UNDERSTOOD(VALUE_TRANSFORM)},
	{"flip_normals", UNDERSTOOD(VALUE_BOOL)},
	DISPLACE_PARAMS,
	PARAM_END,
};

enum { NESTED = 1 << PLUGIN_BSDF | 1 << PLUGIN_EMITTER };

const struct plugin_decl shape_decls[] = {
	{PLUGIN_SHAPE, "obj", obj_params, NESTED, PARAM_UNDERSTOOD},
	{PLUGIN_SHAPE, "rectangle", rectangle_params, NESTED, PARAM_UNDERSTOOD},
	{PLUGIN_SHAPE, "cube", rectangle_params, NESTED, PARAM_UNDERSTOOD},
	{PLUGIN_SHAPE, "sphere", sphere_params, NESTED, PARAM_UNDERSTOOD},
	{0, NULL, NULL, 0, 0},
};

static void set_vertex(struct mesh *m, uint32_t i, vec3 p, vec3 n, double u, double v)
{
	memcpy(m->position[i], (double[3]){p.x, p.y, p.z}, sizeof m->position[i]);
	memcpy(m->normal[i], (double[3]){n.x, n.y, n.z}, sizeof m->normal[i]);
	memcpy(m->uv[i], (double[2]){u, v}, sizeof m->uv[i]);
}

/* Vertices first .. first+3 in a circle. */
static void set_quad(struct mesh *m, uint32_t triangle, uint32_t first)
{
	memcpy(m->index[triangle], (uint32_t[3]){first, first + 1, first + 2}, sizeof m->index[0]);
	memcpy(m->index[triangle + 1], (uint32_t[3]){first, first + 2, first + 3}, sizeof m->index[0]);
}

static const double corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

static int make_rectangle(const struct scene_node *n, struct arena *arena, struct mesh *m, struct error *e)
{
	if (!mesh_alloc(m, 4, 2, true, true, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	for (uint32_t i = 0; i < 4; i++) {
		double u = corner[i][0], v = corner[i][1];
		set_vertex(m, i, (vec3){2 * u - 1, 2 * v - 1, 0}, (vec3){0, 0, 1}, u, v);
	}
	set_quad(m, 0, 0);
	return 0;
}

/* Each face with its normal and the directions in which u and v grow, as on Mitsuba's cube. Some are left-handed:
 * mesh_finish winds the triangles by their normals. */
static const struct face {
	vec3 n, u, v;
} faces[6] = {
	{{0, -1, 0}, {0, 0, 1}, {1, 0, 0}}, {{0, 1, 0}, {-1, 0, 0}, {0, 0, -1}}, {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
	{{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},  {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},	 {{0, 0, -1}, {0, -1, 0}, {1, 0, 0}},
};

static int make_cube(const struct scene_node *n, struct arena *arena, struct mesh *m, struct error *e)
{
	if (!mesh_alloc(m, 24, 12, true, true, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	for (uint32_t f = 0; f < 6; f++) {
		const struct face *face = &faces[f];
		for (uint32_t i = 0; i < 4; i++) {
			const double *c = corner[i];
			vec3 p = vec3_madd(vec3_madd(face->n, 2 * c[0] - 1, face->u), 2 * c[1] - 1, face->v);
			set_vertex(m, 4 * f + i, p, face->n, c[0], c[1]);
		}
		set_quad(m, 2 * f, 4 * f);
	}
	return 0;
}

/* Written matrices have six digits: that much unevenness passes for a similarity. */
#define SIMILARITY_TOLERANCE 1e-4

static int make_sphere(const struct scene_node *n, struct sphere *s, struct error *e)
{
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

int shape_build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		struct shape_geometry *out, uint64_t *dropped, struct error *e)
{
	*out = (struct shape_geometry){.kind = SHAPE_MESH};
	*dropped = 0;
	if (strcmp(n->type, "sphere") == 0) {
		out->kind = SHAPE_SPHERE;
		return make_sphere(n, &out->sphere, e);
	}
	int r;
	if (strcmp(n->type, "rectangle") == 0)
		r = make_rectangle(n, arena, &out->mesh, e);
	else if (strcmp(n->type, "cube") == 0)
		r = make_cube(n, arena, &out->mesh, e);
	else
		r = mesh_read_obj(n, assets, arena, &out->mesh, e);
	struct mesh_finish f = {node_transform(n, "to_world"), node_bool(n, "flip_normals", false),
				node_bool(n, "face_normals", false)};
	return r ? r : mesh_finish(&out->mesh, &f, arena, dropped, n, e);
}
