/* SPDX-License-Identifier: Apache-2.0 */
/* Wavefront OBJ files: all faces, those of one material, or one of the meshes that `g` and `usemtl` separate. */
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/shape/declare.h"
#include "worker/render/shape/obj_read.h"

#include <stdlib.h>
#include <string.h>

static int compare_obj_corners(const void *a, const void *b)
{
	const struct obj_corner *x = a, *y = b;
	liveness_tick();
	if (x->v != y->v)
		return x->v < y->v ? -1 : 1;
	if (x->vt != y->vt)
		return x->vt < y->vt ? -1 : 1;
	if (x->vn != y->vn)
		return x->vn < y->vn ? -1 : 1;
	return x->index < y->index ? -1 : x->index > y->index;
}

static bool same_vertex(const struct obj_corner *a, const struct obj_corner *b)
{
	return a->v == b->v && a->vt == b->vt && a->vn == b->vn;
}

/* Returns whether all vertices have colours; otherwise colours are not used. */
static bool has_colours(const struct obj_file *o)
{
	return o->colours.count > 0 && o->colours.count == o->positions.count;
}

static void set_vertex(const struct obj_file *o, struct mesh *m, uint32_t i, const struct obj_corner *c, bool flip)
{
	memcpy(m->position[i], (const double *)o->positions.items + 3 * (c->v - 1), sizeof m->position[i]);
	if (m->normal && c->vn)
		mesh_set_normal(m, i, vec3_load((const double *)o->normals.items + 3 * (c->vn - 1)));
	if (m->uv && c->vt) {
		const double *uv = (const double *)o->uvs.items + 2 * (c->vt - 1);
		m->uv[i][0] = uv[0];
		m->uv[i][1] = flip ? 1 - uv[1] : uv[1];
	}
	for (uint32_t k = 0; m->attribute_count && k < 3; k++)
		mesh_set_attribute(m->attributes, i, k, ((const double *)o->colours.items)[3 * (c->v - 1) + k]);
}

/* The faces of a mesh, in arrays of their own or in those of the file; sorting changes the order of the corners. */
struct faces {
	struct obj_corner *corners;
	uint32_t (*triangles)[3];
	size_t corner_count, triangle_count;
};

/* Makes a mesh in which corners with the same three indices share a vertex. They are found by sorting, which takes
 * bounded time for any file. Returns false if out of memory. */
static bool make_mesh(const struct obj_file *o, struct faces *f, struct arena *arena, struct mesh *m, bool flip)
{
	struct obj_corner *c = f->corners;
	size_t n = f->corner_count;
	uint32_t *vertex_of = mem_alloc(n, sizeof *vertex_of);
	if (!vertex_of)
		return false;
	if (n > 0) /* a file without faces has no array to sort */
		qsort(c, n, sizeof *c, compare_obj_corners);
	uint32_t vertices = 0;
	bool normals = false, uv = false;
	for (size_t i = 0; i < n; i++) {
		vertices += i == 0 || !same_vertex(&c[i - 1], &c[i]);
		vertex_of[c[i].index] = vertices - 1;
		normals |= c[i].vn != 0;
		uv |= c[i].vt != 0;
	}
	bool ok = mesh_alloc(m, vertices, (uint32_t)f->triangle_count, normals, uv, arena) &&
		  (!has_colours(o) || mesh_add_attribute(m, "vertex_color", false, 3, 1, arena));
	for (size_t i = 0; ok && i < n; i++)
		if (i == 0 || !same_vertex(&c[i - 1], &c[i]))
			set_vertex(o, m, vertex_of[c[i].index], &c[i], flip);
	for (size_t i = 0; ok && i < f->triangle_count; i++)
		for (int k = 0; k < 3; k++)
			m->index[i][k] = vertex_of[f->triangles[i][k]];
	mem_free(vertex_of);
	return ok;
}

/* Consecutive faces of the file: their corners and triangles, each from the first to the one after the last. */
struct face_range {
	size_t corner_begin, corner_end, triangle_begin, triangle_end;
};

static struct face_range run_range(const struct obj_file *o, size_t run)
{
	const struct obj_run *r = (const struct obj_run *)o->runs.items + run;
	bool last = run + 1 == o->runs.count;
	return (struct face_range){r->first_corner, last ? o->corners.count : r[1].first_corner, r->first_triangle,
				   last ? o->triangles.count : r[1].first_triangle};
}

static struct face_range mesh_range(const struct obj_file *o, size_t mesh)
{
	const struct obj_mesh *m = (const struct obj_mesh *)o->meshes.items + mesh;
	bool last = mesh + 1 == o->meshes.count;
	return (struct face_range){m->first_corner, last ? o->corners.count : m[1].first_corner, m->first_triangle,
				   last ? o->triangles.count : m[1].first_triangle};
}

static bool run_has_material(const struct obj_file *o, size_t run, const char *material)
{
	const struct obj_run *r = (const struct obj_run *)o->runs.items + run;
	size_t n = strlen(material);
	return r->name_length == n &&
	       (n == 0 || memcmp((const char *)o->names.items + r->name_offset, material, n) == 0);
}

static void append_faces(const struct obj_file *o, struct face_range r, struct faces *f)
{
	const struct obj_corner *corners = o->corners.items;
	const uint32_t(*triangles)[3] = o->triangles.items;
	uint32_t shift = (uint32_t)(f->corner_count - r.corner_begin);
	for (size_t i = r.triangle_begin; i < r.triangle_end; i++, f->triangle_count++)
		for (int k = 0; k < 3; k++)
			f->triangles[f->triangle_count][k] = triangles[i][k] + shift;
	for (size_t i = r.corner_begin; i < r.corner_end; i++, f->corner_count++) {
		f->corners[f->corner_count] = corners[i];
		f->corners[f->corner_count].index = (uint32_t)f->corner_count;
	}
}

static int out_of_memory(const struct scene_node *n, struct error *e)
{
	return node_error(n, e, ENOMEM, "%s: out of memory", node_string(n, "filename", ""));
}

/* Returns room for that many corners and triangles; has_memory() says whether there was memory for it. */
static struct faces alloc_faces(size_t corners, size_t triangles)
{
	return (struct faces){.corners = mem_alloc(corners, sizeof(struct obj_corner)),
			      .triangles = mem_alloc(triangles, sizeof(uint32_t[3]))};
}

static bool has_memory(const struct faces *f)
{
	return f->corners && f->triangles;
}

/* Makes the mesh of copied faces, and frees these. */
static int build_copies(const struct scene_node *n, const struct obj_file *o, struct faces *f, struct arena *arena,
			struct shape_geometry *out, struct error *e)
{
	bool ok = has_memory(f) && make_mesh(o, f, arena, &out->mesh, node_bool(n, "flip_tex_coords", true));
	mem_free(f->corners);
	mem_free(f->triangles);
	return ok ? 0 : out_of_memory(n, e);
}

/* Builds the faces of one material from copies, since the file is kept for the other materials. */
static int build_material(const struct scene_node *n, const struct obj_file *o, const char *material,
			  struct arena *arena, struct shape_geometry *out, struct error *e)
{
	size_t corners = 0, triangles = 0;
	for (size_t i = 0; i < o->runs.count; i++) {
		if (!run_has_material(o, i, material))
			continue;
		struct face_range r = run_range(o, i);
		corners += r.corner_end - r.corner_begin;
		triangles += r.triangle_end - r.triangle_begin;
	}
	if (triangles == 0)
		return node_error(n, e, EINVAL, "%s: has no faces of the material `%.64s`",
				  node_string(n, "filename", ""), material);
	struct faces f = alloc_faces(corners, triangles);
	for (size_t i = 0; has_memory(&f) && i < o->runs.count; i++)
		if (run_has_material(o, i, material))
			append_faces(o, run_range(o, i), &f);
	return build_copies(n, o, &f, arena, out, e);
}

/* One mesh, copied. `material`, if not NULL, must be its own. */
static int build_mesh(const struct scene_node *n, const struct obj_file *o, const char *material, struct arena *arena,
		      struct shape_geometry *out, struct error *e)
{
	const char *name = node_string(n, "filename", "");
	size_t index = (size_t)node_int(n, "shape_index", 0);
	if (index >= o->meshes.count)
		return node_error(n, e, ERANGE, "%s: shape_index=%zu, but the file has %zu mesh%s, counted from 0",
				  name, index, o->meshes.count, o->meshes.count == 1 ? "" : "es");
	if (material && !run_has_material(o, ((const struct obj_mesh *)o->meshes.items)[index].run, material))
		return node_error(n, e, EINVAL, "%s: mesh %zu has no faces of the material `%.64s`", name, index,
				  material);
	struct face_range r = mesh_range(o, index);
	struct faces f = alloc_faces(r.corner_end - r.corner_begin, r.triangle_end - r.triangle_begin);
	if (has_memory(&f))
		append_faces(o, r, &f);
	return build_copies(n, o, &f, arena, out, e);
}

static int build_all(const struct scene_node *n, struct obj_file *o, struct arena *arena, struct shape_geometry *out,
		     struct error *e)
{
	const struct obj_run *first = o->runs.items;
	out->has_materials = (o->runs.count > 1 || first->name_length > 0) && node_bool(n, "load_materials", true);
	struct faces f = {o->corners.items, o->triangles.items, o->corners.count, o->triangles.count};
	bool ok = make_mesh(o, &f, arena, &out->mesh, node_bool(n, "flip_tex_coords", true));
	return ok ? 0 : out_of_memory(n, e);
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	const char *material = node_string(n, "material", NULL);
	bool single_mesh = node_int(n, "shape_index", -1) >= 0;
	struct obj_cache local_cache = {.name = NULL},
			 *cache = (material || single_mesh) && assets->obj_cache ? assets->obj_cache : &local_cache;
	int r = obj_cache_read(cache, n, assets, e);
	if (!r && single_mesh)
		r = build_mesh(n, &cache->file, material, arena, out, e);
	else if (!r)
		r = material ? build_material(n, &cache->file, material, arena, out, e)
			     : build_all(n, &cache->file, arena, out, e);
	obj_cache_fini(&local_cache);
	return r;
}

SHAPE_OPS(obj, {"filename", UNDERSTOOD(VALUE_STRING)},
	  {"material", UNDERSTOOD(VALUE_STRING)}, /* only the faces after `usemtl` with this name; "": those before the
						     first `usemtl` */
	  {"face_normals", UNDERSTOOD(VALUE_BOOL)}, {"flip_tex_coords", UNDERSTOOD(VALUE_BOOL)}, {"collapse", IGNORED},
	  {"load_materials", UNDERSTOOD(VALUE_BOOL)}, /* .mtl files are not read; false: without a note */
	  {"shape_index", VALUE_INT, PARAM_UNDERSTOOD, -1, 1 << 24, NULL}, /* -1: all meshes */
	  MESH_SMOOTH_PARAM, SHAPE_PARAMS);
