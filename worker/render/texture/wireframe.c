/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `wireframe` of 0.5/0.6: the edges of a mesh's triangles. With d the distance to the nearest edge of the triangle, in
 * scene units, and s(t) = t^2 (3 - 2 t) on [0,1], the colour is
 *
 *     edge_color + (interior_color - edge_color) s((d - (1 - step_width) line_width) / (step_width line_width)),
 *
 * so a line extends by line_width on either side of an edge. By default, line_width is a tenth of the mean length of
 * the edges, averaged over triangles: an edge between two triangles counts twice. Shapes that are not meshes in Mitsuba
 * have the colour of the interior only, even if they consist of triangles here.
 *
 * The distance to the edge opposite a corner is the barycentric coordinate of the corner times the height of the
 * triangle above that edge.
 */
#include "common/base/text.h"
#include "worker/render/texture/attribute_table.h"
#include "worker/render/texture/texture.h"

#include <string.h>

struct wireframe {
	struct texture edge, interior;
	struct attribute_table mesh; /* only its triangles are used */
	bool shows_lines;
	/* Distances at which the transition from edge to interior begins and ends. */
	double inner_distance, outer_distance;
};

static bool is_wired_shape(const struct attribute_table *mesh)
{
	static const char *const types[] = {"obj", "ply", "serialized", "gltf", "cube"};
	return mesh->triangle_count > 0 && text_is_among(mesh->shape->type, types, sizeof types / sizeof *types);
}

static double mean_edge_length(const struct attribute_table *mesh)
{
	double sum = 0;
	for (uint32_t t = 0; t < mesh->triangle_count; t++) {
		vec3 edge[3];
		attribute_table_edges(mesh, t, edge);
		sum += vec3_length(edge[0]) + vec3_length(edge[1]) + vec3_length(edge[2]);
	}
	return sum / (3.0 * mesh->triangle_count);
}

static void read_widths(struct wireframe *f, const struct scene_node *n)
{
	double width = node_float(n, "line_width", 0);
	f->outer_distance = width > 0 ? width : 0.1 * mean_edge_length(&f->mesh);
	f->inner_distance = f->outer_distance * (1 - node_float(n, "step_width", 0.5));
}

static int wireframe_create(struct texture *t, const struct scene_node *n, enum color_role role,
			    const struct texture_build *build, struct error *e)
{
	struct wireframe *f = t->data;
	if (color_role_is_number(role))
		return node_error(n, e, ENOTSUP, "the edges of a mesh cannot %s",
				  role == COLOR_HEIGHT ? "displace a surface" : "be a bump or normal map");
	if (!build->attributes)
		return node_error(n, e, EINVAL, "only the material or the light of a shape can show edges");
	int code = texture_from_node(&f->edge, n, "edge_color", 0.1, role, build, e);
	if (!code)
		code = texture_from_node(&f->interior, n, "interior_color", 0.5, role, build, e);
	if (code)
		return code;
	build->attributes->probes_per_triangle = TRIANGLE_PROBES_EDGES;
	f->mesh = *build->attributes;
	f->shows_lines = is_wired_shape(&f->mesh);
	if (f->shows_lines)
		read_widths(f, n);
	return 0;
}

/* Returns the share of the interior's colour at a point. */
static double interior_share(const struct wireframe *f, const struct texture_point *point)
{
	if (!f->shows_lines)
		return 1;
	vec3 edge[3];
	attribute_table_edges(&f->mesh, point->prim, edge);
	double double_area = vec3_length(vec3_cross(edge[1], edge[2])),
	       b[3] = {1 - point->b1 - point->b2, point->b1, point->b2}, d = INFINITY;
	for (int k = 0; k < 3; k++)
		d = fmin(d, b[k] * double_area / vec3_length(edge[k]));
	if (d >= f->outer_distance)
		return 1;
	if (d <= f->inner_distance)
		return 0;
	double x = (d - f->inner_distance) / (f->outer_distance - f->inner_distance);
	return x * x * (3 - 2 * x);
}

static spectrum wireframe_eval(const struct texture *t, const struct texture_point *point, const struct wavelengths *w)
{
	const struct wireframe *f = t->data;
	double a = interior_share(f, point);
	spectrum edge = a < 1 ? spectrum_scale(1 - a, texture_eval(&f->edge, point, w)) : spectrum_constant(0);
	return a > 0 ? spectrum_add(edge, spectrum_scale(a, texture_eval(&f->interior, point, w))) : edge;
}

static double wireframe_max(const struct texture *t)
{
	const struct wireframe *f = t->data;
	return fmax(texture_max(&f->edge), texture_max(&f->interior));
}

static enum color_kind wireframe_color_kind(const struct texture *t)
{
	const struct wireframe *f = t->data;
	enum color_kind first = texture_color_kind(&f->edge);
	return first == texture_color_kind(&f->interior) ? first : COLOR_KIND_OTHER;
}

/* No height and no jet: creation refuses the roles that need them. */
const struct texture_ops texture_ops_wireframe = {
	.decl = PLUGIN(TEXTURE, "wireframe", {.name = "edge_color", .types = VALUE_COLOR, .max = PARAM_LIGHT_MAX},
		       {.name = "interior_color", .types = VALUE_COLOR, .max = PARAM_LIGHT_MAX},
		       {.name = "line_width", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = PARAM_LENGTH_MAX},
		       {.name = "step_width", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1}),
	.data_size = sizeof(struct wireframe),
	.create = wireframe_create,
	.eval = wireframe_eval,
	.max = wireframe_max,
	.color_kind = wireframe_color_kind,
};
