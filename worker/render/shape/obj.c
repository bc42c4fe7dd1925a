/* SPDX-License-Identifier: Apache-2.0 */
/* Wavefront OBJ. Of materials only that there are some. */
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/shape/declare.h"
#include "worker/render/shape/obj_read.h"

#include <stdlib.h>
#include <string.h>

static const struct param params[] = {
	{"filename", UNDERSTOOD(VALUE_STRING)},
	{"face_normals", UNDERSTOOD(VALUE_BOOL)},
	{"flip_tex_coords", UNDERSTOOD(VALUE_BOOL)},
	{"collapse", IGNORED},
	{"load_materials", UNDERSTOOD(VALUE_BOOL)}, /* .mtl files are never read: false says that none is wanted */
	MESH_SMOOTH_PARAM,
	{"shape_index", REFUSED},
	SHAPE_PARAMS_END,
};

static int compare_corners(const void *a, const void *b)
{
	const struct obj_corner *x = a, *y = b;
	tick();
	if (x->v != y->v)
		return x->v < y->v ? -1 : 1;
	if (x->vt != y->vt)
		return x->vt < y->vt ? -1 : 1;
	if (x->vn != y->vn)
		return x->vn < y->vn ? -1 : 1;
	return x->at < y->at ? -1 : x->at > y->at;
}

static bool same_vertex(const struct obj_corner *a, const struct obj_corner *b)
{
	return a->v == b->v && a->vt == b->vt && a->vn == b->vn;
}

static void set_vertex(const struct obj_file *o, struct mesh *m, uint32_t i, const struct obj_corner *c, bool flip)
{
	memcpy(m->position[i], (const double *)o->positions.items + 3 * (c->v - 1), sizeof m->position[i]);
	if (m->normal && c->vn)
		memcpy(m->normal[i], (const double *)o->normals.items + 3 * (c->vn - 1), sizeof m->normal[i]);
	if (m->uv && c->vt) {
		const double *uv = (const double *)o->uvs.items + 2 * (c->vt - 1);
		m->uv[i][0] = uv[0];
		m->uv[i][1] = flip ? 1 - uv[1] : uv[1];
	}
}

/* Corners that agree in all three indices share a vertex. Sorting takes a bounded time whatever the file says. False:
 * out of memory. */
static bool make_mesh(struct obj_file *o, struct arena *arena, struct mesh *m, bool flip)
{
	struct obj_corner *c = o->corners.items;
	size_t n = o->corners.count;
	uint32_t *vertex_of = mem_alloc(n, sizeof *vertex_of);
	if (!vertex_of)
		return false;
	qsort(c, n, sizeof *c, compare_corners);
	uint32_t vertices = 0;
	bool normals = false, uv = false;
	for (size_t i = 0; i < n; i++) {
		vertices += i == 0 || !same_vertex(&c[i - 1], &c[i]);
		vertex_of[c[i].at] = vertices - 1;
		normals |= c[i].vn != 0;
		uv |= c[i].vt != 0;
	}
	bool ok = mesh_alloc(m, vertices, (uint32_t)o->triangles.count, normals, uv, arena);
	for (size_t i = 0; ok && i < n; i++)
		if (i == 0 || !same_vertex(&c[i - 1], &c[i]))
			set_vertex(o, m, vertex_of[c[i].at], &c[i], flip);
	const uint32_t(*t)[3] = o->triangles.items;
	for (size_t i = 0; ok && i < o->triangles.count; i++)
		for (int k = 0; k < 3; k++)
			m->index[i][k] = vertex_of[t[i][k]];
	mem_free(vertex_of);
	return ok;
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct obj_file o;
	int r = obj_read(&o, n, assets, e);
	if (r)
		return r;
	const struct obj_run *first = o.runs.items;
	out->materials = (o.runs.count > 1 || first->name_length > 0) && node_bool(n, "load_materials", true);
	if (!make_mesh(&o, arena, &out->mesh, node_bool(n, "flip_tex_coords", true)))
		r = node_error(n, e, ENOMEM, "%s: out of memory", node_string(n, "filename", ""));
	obj_free(&o);
	return r;
}

const struct shape_ops shape_ops_obj = {.type = "obj", .params = params, .build = build};
