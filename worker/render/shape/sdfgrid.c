/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The surface on which a trilinearly interpolated grid of values over the unit cube is 0; values outside the surface
 * are positive. The surface is open where it leaves the cube, and has no texture coordinates.
 *
 * Each voxel is cut into CELLS_PER_VOXEL^3 cells, and each cell into six tetrahedra around its diagonal, one for each
 * order of walking along x, y and z from corner (0,0,0) to (1,1,1); neighbouring cells meet without gaps. If the field
 * changes sign along an edge, there is a vertex exactly on the surface, shared by all tetrahedra around the edge. A
 * tetrahedron with one corner on either side of the surface yields one triangle, one with two corners on each side
 * yields two. Cells are visited in layers along z, so that only the vertices of two layers have to be stored for
 * look-up.
 *
 * With `normals` "smooth", the normal of a vertex is interpolated linearly between those of the eight nearest voxels at
 * that point (Hansson-Soderlund, Evans and Akenine-Moller 2022, Ray Tracing of Signed Distance Function Grids, section
 * 5). With "analytic", triangles are flat, where Mitsuba uses the exact normal at each point.
 *
 * Creation fails if the file cannot be read (grid_file.h), if there is no surface, or if there are more triangles than
 * a mesh may have.
 */
#include "worker/render/shape/declare.h"
#include "worker/render/shape/shape.h"
#include "worker/render/volume/grid_file.h"

#include "common/base/list.h"
#include "common/base/liveness.h"
#include "common/base/mem.h"

#include <string.h>

enum { CELLS_PER_VOXEL = 2, EDGE_DIRECTIONS = 7, ROOT_STEPS = 24 };

struct surface {
	struct grid_file grid;
	uint32_t cell_count[3];
	/* For two layers of corners, by parity of z: the field, and 1 + the vertex on the edge from a corner in each
	 * direction (1 .. 7: bits of x, y, z), 0 if there is none yet. */
	double *field[2];
	uint32_t (*edge_vertex[2])[EDGE_DIRECTIONS];
	struct list positions, triangles; /* double[3], in voxels; uint32_t[3] */
};

/* ---- the field, in voxels ---- */

static double grid_corner_value(const struct grid_file *g, const uint32_t voxel[3], int corner)
{
	uint32_t x = voxel[0] + (corner & 1), y = voxel[1] + (corner >> 1 & 1), z = voxel[2] + (uint32_t)(corner >> 2);
	return (double)g->value[((size_t)z * g->size[1] + y) * g->size[0] + x];
}

/* Interpolates between the corners of a voxel; x may lie outside it. Also computes the gradient, unless NULL. */
static double interpolate(const struct grid_file *g, const uint32_t voxel[3], const double x[3], double gradient[3])
{
	double w[3][2], sum = 0;
	for (int i = 0; i < 3; i++) {
		w[i][1] = x[i] - voxel[i];
		w[i][0] = 1 - w[i][1];
	}
	for (int i = 0; gradient && i < 3; i++)
		gradient[i] = 0;
	for (int c = 0; c < 8; c++) {
		double f = grid_corner_value(g, voxel, c), wx = w[0][c & 1], wy = w[1][c >> 1 & 1], wz = w[2][c >> 2];
		sum += f * wx * wy * wz;
		if (!gradient)
			continue;
		gradient[0] += (c & 1 ? f : -f) * wy * wz;
		gradient[1] += (c & 2 ? f : -f) * wx * wz;
		gradient[2] += (c & 4 ? f : -f) * wx * wy;
	}
	return sum;
}

static double field_at(const struct grid_file *g, const double x[3])
{
	uint32_t voxel[3];
	for (int i = 0; i < 3; i++)
		voxel[i] = (uint32_t)fmin(fmax(floor(x[i]), 0), g->size[i] - 2);
	return interpolate(g, voxel, x, NULL);
}

/* Returns the normal at x in object space: the mean of the normals at x of the eight voxels whose centres surround
 * x. */
static vec3 normal_at(const struct grid_file *g, const double x[3])
{
	double w[3][2], sum[3] = {0, 0, 0};
	uint32_t voxels[3][2];
	for (int i = 0; i < 3; i++) {
		double center = x[i] - 0.5, low = floor(center);
		for (int k = 0; k < 2; k++)
			voxels[i][k] = (uint32_t)fmin(fmax(low + k, 0), g->size[i] - 2);
		w[i][1] = center - low;
		w[i][0] = 1 - w[i][1];
	}
	for (int c = 0; c < 8; c++) {
		const uint32_t voxel[3] = {voxels[0][c & 1], voxels[1][c >> 1 & 1], voxels[2][c >> 2]};
		double gradient[3], weight = w[0][c & 1] * w[1][c >> 1 & 1] * w[2][c >> 2];
		interpolate(g, voxel, x, gradient);
		for (int i = 0; i < 3; i++)
			gradient[i] *= g->size[i] - 1;
		vec3 n = vec3_unit_or_zero(vec3_load(gradient));
		vec3_store(sum, vec3_madd(vec3_load(sum), weight, n));
	}
	return vec3_unit_or_zero(vec3_load(sum));
}

/* ---- vertices ---- */

/* Finds the zero of the field between a, with the value fa, and b, with the value fb of opposite sign, by regula falsi
 * with Illinois weights. */
static void find_root(const struct grid_file *g, const double a[3], double fa, const double b[3], double fb,
		      double out[3])
{
	double low = 0, high = 1;
	for (int i = 0; i < ROOT_STEPS; i++) {
		double t = low + (high - low) * (fa / (fa - fb));
		for (int k = 0; k < 3; k++)
			out[k] = a[k] + t * (b[k] - a[k]);
		double f = field_at(g, out);
		if (f == 0 || !(t > low && t < high))
			return;
		if ((f < 0) == (fa < 0)) {
			low = t;
			fa = f;
			fb *= 0.5;
		} else {
			high = t;
			fb = f;
			fa *= 0.5;
		}
	}
}

struct cell {
	uint32_t index[3];
	double field[8];
};

static size_t layer_index(const struct surface *s, uint32_t x, uint32_t y)
{
	return (size_t)y * (s->cell_count[0] + 1) + x;
}

static void corner_position(const struct cell *c, unsigned corner, double out[3])
{
	for (int i = 0; i < 3; i++)
		out[i] = (c->index[i] + (corner >> i & 1)) / (double)CELLS_PER_VOXEL;
}

/* Returns 1 + the vertex between corner `from` and corner `to`, which is further along all axes in which they differ; 0
 * if out of memory. */
static uint32_t vertex_between(struct surface *s, const struct cell *c, unsigned from, unsigned to)
{
	uint32_t z = c->index[2] + (from >> 2);
	uint32_t *slot = &s->edge_vertex[z & 1][layer_index(s, c->index[0] + (from & 1), c->index[1] + (from >> 1 & 1))]
					[(to & ~from) - 1];
	double a[3], b[3], *p = *slot ? NULL : list_push(&s->positions);
	if (!p)
		return *slot;
	corner_position(c, from, a);
	corner_position(c, to, b);
	find_root(&s->grid, a, c->field[from], b, c->field[to], p);
	return *slot = (uint32_t)s->positions.count;
}

/* ---- triangles ---- */

/* Adds a triangle, oriented such that it faces away from `inside_point`, in the direction in which the field grows. v:
 * 1 + vertices. -EFBIG or -ENOMEM. */
static int add_triangle(struct surface *s, const uint32_t v[3], const double inside_point[3])
{
	const double(*p)[3] = s->positions.items;
	vec3 a = vec3_load(p[v[0] - 1]), b = vec3_load(p[v[1] - 1]), c = vec3_load(p[v[2] - 1]);
	vec3 n = vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
	bool flip = vec3_dot(n, vec3_sub(vec3_load(inside_point), a)) > 0;
	if (s->triangles.count >= MESH_TRIANGLES_MAX)
		return -EFBIG;
	uint32_t *t = list_push(&s->triangles);
	if (!t)
		return -ENOMEM;
	t[0] = v[0] - 1;
	t[1] = v[flip ? 2 : 1] - 1;
	t[2] = v[flip ? 1 : 2] - 1;
	return 0;
}

/* corner: those of a tetrahedron, each further along than the one before. */
static int cut_tetrahedron(struct surface *s, const struct cell *c, const unsigned corner[4])
{
	uint32_t vertices[4] = {0};
	unsigned in[4], out[4], inside_count = 0, outside_count = 0, crossings = 0;
	for (int i = 0; i < 4; i++)
		if (c->field[corner[i]] < 0)
			in[inside_count++] = corner[i];
		else
			out[outside_count++] = corner[i];
	if (inside_count == 0 || outside_count == 0)
		return 0;
	/* The crossings have to be in order around the cut. With two corners on each side, the order of the outer
	 * corners is therefore reversed for the second inner corner. */
	for (unsigned i = 0; i < inside_count; i++)
		for (unsigned k = 0; k < outside_count; k++) {
			unsigned a = in[i], b = out[inside_count == 2 && i == 1 ? outside_count - 1 - k : k];
			bool is_ordered = (a & b) == a;
			uint32_t v = vertex_between(s, c, is_ordered ? a : b, is_ordered ? b : a);
			if (!v)
				return -ENOMEM;
			vertices[crossings++] = v;
		}
	double inside_point[3];
	corner_position(c, in[0], inside_point);
	int rc = add_triangle(s, vertices, inside_point);
	if (rc || crossings == 3)
		return rc;
	const uint32_t rest[3] = {vertices[0], vertices[2], vertices[3]};
	return add_triangle(s, rest, inside_point);
}

static int cut_cell(struct surface *s, const struct cell *c)
{
	static const unsigned axis_orders[6][2] = {{1, 2}, {1, 4}, {2, 1}, {2, 4}, {4, 1}, {4, 2}};
	int rc = 0;
	for (int i = 0; i < 6 && !rc; i++) {
		unsigned first = axis_orders[i][0], second = first | axis_orders[i][1];
		rc = cut_tetrahedron(s, c, (const unsigned[4]){0, first, second, 7});
	}
	return rc;
}

/* ---- layers ---- */

static void fill_layer(struct surface *s, uint32_t z)
{
	size_t count = (size_t)(s->cell_count[0] + 1) * (s->cell_count[1] + 1);
	memset(s->edge_vertex[z & 1], 0, count * sizeof *s->edge_vertex[0]);
	for (uint32_t y = 0; y <= s->cell_count[1]; y++) {
		liveness_tick();
		for (uint32_t x = 0; x <= s->cell_count[0]; x++) {
			const double p[3] = {x / (double)CELLS_PER_VOXEL, y / (double)CELLS_PER_VOXEL,
					     z / (double)CELLS_PER_VOXEL};
			s->field[z & 1][layer_index(s, x, y)] = field_at(&s->grid, p);
		}
	}
}

static int cut_layer(struct surface *s, uint32_t z)
{
	struct cell c = {.index = {0, 0, z}};
	int rc = 0;
	for (c.index[1] = 0; c.index[1] < s->cell_count[1] && !rc; c.index[1]++) {
		liveness_tick();
		for (c.index[0] = 0; c.index[0] < s->cell_count[0] && !rc; c.index[0]++) {
			unsigned inside_count = 0;
			for (unsigned k = 0; k < 8; k++) {
				size_t corner = layer_index(s, c.index[0] + (k & 1), c.index[1] + (k >> 1 & 1));
				c.field[k] = s->field[(z + (k >> 2)) & 1][corner];
				inside_count += c.field[k] < 0;
			}
			if (inside_count > 0 && inside_count < 8)
				rc = cut_cell(s, &c);
		}
	}
	return rc;
}

static int cut_all_layers(struct surface *s)
{
	size_t count = 1;
	for (int i = 0; i < 3; i++) {
		s->cell_count[i] = CELLS_PER_VOXEL * (s->grid.size[i] - 1);
		count *= i < 2 ? s->cell_count[i] + 1 : 1;
	}
	for (int k = 0; k < 2; k++) {
		s->field[k] = mem_alloc(count, sizeof *s->field[k]);
		s->edge_vertex[k] = mem_alloc(count, sizeof *s->edge_vertex[k]);
		if (!s->field[k] || !s->edge_vertex[k])
			return -ENOMEM;
	}
	int rc = 0;
	fill_layer(s, 0);
	for (uint32_t z = 0; z < s->cell_count[2] && !rc; z++) {
		fill_layer(s, z + 1);
		rc = cut_layer(s, z);
	}
	return rc;
}

/* ---- the mesh ---- */

static int make_mesh(const struct surface *s, bool smooth, struct arena *arena, struct mesh *m)
{
	const double(*p)[3] = s->positions.items;
	if (!mesh_alloc(m, (uint32_t)s->positions.count, (uint32_t)s->triangles.count, smooth, false, arena))
		return -ENOMEM;
	memcpy(m->index, s->triangles.items, s->triangles.count * sizeof *m->index);
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		liveness_tick();
		for (int k = 0; k < 3; k++)
			m->position[i][k] = p[i][k] / (s->grid.size[k] - 1);
		if (smooth)
			vec3_store(m->normal[i], normal_at(&s->grid, p[i]));
	}
	return 0;
}

static int read_field(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		      struct grid_file *grid, struct error *e)
{
	int rc = grid_file_read(n, assets, 1, arena, grid, e);
	for (int i = 0; i < 3 && !rc; i++)
		if (grid->size[i] < 2)
			rc = node_error(n, e, ERANGE, "%s: %u values along %c; 2 to %d are supported",
					node_string(n, "filename", ""), grid->size[i], "xyz"[i], GRID_SIDE_MAX);
	return rc;
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct surface s = {.positions = {.item_size = 3 * sizeof(double)},
			    .triangles = {.item_size = 3 * sizeof(uint32_t)}};
	bool smooth = strcmp(node_string(n, "normals", "smooth"), "smooth") == 0;
	struct arena grid_arena = {.limit = 0};
	int rc = read_field(n, assets, &grid_arena, &s.grid, e);
	if (rc) {
		arena_fini(&grid_arena);
		return rc;
	}
	rc = cut_all_layers(&s);
	if (!rc && s.triangles.count > 0)
		rc = make_mesh(&s, smooth, arena, &out->mesh);
	if (rc == -EFBIG)
		node_error(n, e, EFBIG, "its surface has more than %d triangles", MESH_TRIANGLES_MAX);
	else if (rc)
		node_error(n, e, -rc, "out of memory");
	else if (s.triangles.count == 0)
		rc = node_error(n, e, EINVAL, "%s: its values do not change their sign: there is no surface",
				node_string(n, "filename", ""));
	out->has_face_normals = !smooth;
	out->is_generated = true;
	for (int k = 0; k < 2; k++) {
		mem_free(s.field[k]);
		mem_free(s.edge_vertex[k]);
	}
	list_fini(&s.positions);
	list_fini(&s.triangles);
	arena_fini(&grid_arena);
	return rc;
}

const struct shape_ops shape_ops_sdfgrid = {
	.decl = {PLUGIN_SHAPE, "sdfgrid",
		 PARAMS({"filename", UNDERSTOOD(VALUE_STRING)},
			{.name = "normals", .types = VALUE_STRING, .choices = "smooth|analytic"}, SHAPE_PARAMS),
		 1u << PLUGIN_BSDF, PARAM_UNDERSTOOD},
	.build = build,
};
