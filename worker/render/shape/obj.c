/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Wavefront OBJ: v, vt, vn, f; everything else (groups, lines) has no meaning here, and of materials only that there
 * are some. Every index is checked where it stands, so that an error has a line.
 */
#include "common/base/mem.h"
#include "common/base/liveness.h"
#include "worker/render/scene/number.h"
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"

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

struct list {
	void *items;
	size_t count, room, size; /* size of one item */
};

struct corner {
	uint32_t v, vt, vn; /* from 1; 0: none */
	uint32_t at;	    /* place in the list of corners */
};

struct obj {
	const struct scene_node *node;
	const char *name;
	struct error *error;
	const char *p, *end;
	int line;
	struct list positions, uvs, normals; /* double[3], double[2], double[3] */
	struct list corners;		     /* struct corner, one for each corner of each polygon */
	struct list triangles;		     /* uint32_t[3] into corners */
	bool materials;			     /* faces are given some */
};

static void *push(struct list *l)
{
	if (l->count == l->room) {
		size_t room = l->room ? 2 * l->room : 256;
		void *more = mem_grow(l->items, l->room * l->size, room * l->size);
		if (!more)
			return NULL;
		l->items = more;
		l->room = room;
	}
	return (char *)l->items + l->size * l->count++;
}

static int out_of_memory(const struct obj *o)
{
	return node_error(o->node, o->error, ENOMEM, "%s:%d: out of memory", o->name, o->line);
}

/* Blanks, and the backslash that joins two lines. */
static void skip_blanks(struct obj *o)
{
	while (o->p < o->end) {
		if (*o->p == ' ' || *o->p == '\t' || *o->p == '\r') {
			o->p++;
		} else if (*o->p == '\\') {
			const char *q = o->p + 1;
			q += q < o->end && *q == '\r';
			if (q >= o->end || *q != '\n')
				return;
			o->p = q + 1;
			o->line++;
		} else {
			return;
		}
	}
}

static bool at_end_of_line(struct obj *o)
{
	skip_blanks(o);
	return o->p >= o->end || *o->p == '\n' || *o->p == '#';
}

static int read_numbers(struct obj *o, const char *what, struct list *l, size_t least, size_t count)
{
	double *v = push(l);
	if (!v)
		return out_of_memory(o);
	for (size_t i = 0; i < count; i++) {
		v[i] = 0;
		if (i >= least && at_end_of_line(o))
			continue;
		skip_blanks(o);
		bool normal = l == &o->normals;
		const char *rest = (normal ? number_scan_printed : number_scan)(o->p, o->end, &v[i]);
		bool ends = rest && (rest == o->end || number_is_blank(*rest) || *rest == '\\' || *rest == '#');
		if (!ends || (!(fabs(v[i]) <= MESH_COORDINATE_MAX) && !normal))
			return node_error(o->node, o->error, EINVAL, "%s:%d: `%s` needs %zu finite numbers", o->name,
					  o->line, what, least);
		o->p = rest;
	}
	return 0;
}

static int read_normal(struct obj *o)
{
	int r = read_numbers(o, "vn", &o->normals, 3, 3);
	if (r)
		return r;
	double *n = (double *)o->normals.items + 3 * (o->normals.count - 1);
	mesh_store(n, mesh_unit(mesh_load(n)));
	return 0;
}

/* Indices count from 1, or backwards from the last with -1. */
static int read_index(struct obj *o, const char *what, size_t count, uint32_t *out)
{
	int64_t i;
	const char *rest = number_scan_int(o->p, o->end, &i);
	if (!rest)
		return node_error(o->node, o->error, EINVAL, "%s:%d: a face's corners are v, v/vt, v//vn or v/vt/vn",
				  o->name, o->line);
	int64_t k = i < 0 ? (int64_t)count + 1 + i : i;
	if (k < 1 || k > (int64_t)count)
		return node_error(o->node, o->error, EINVAL,
				  "%s:%d: %s %lld is out of range; there are %zu before this line", o->name, o->line,
				  what, (long long)i, count);
	*out = (uint32_t)k;
	o->p = rest;
	return 0;
}

static bool take(struct obj *o, char c)
{
	if (o->p < o->end && *o->p == c) {
		o->p++;
		return true;
	}
	return false;
}

static int read_corner(struct obj *o)
{
	struct corner c = {.at = (uint32_t)o->corners.count};
	int r = read_index(o, "vertex", o->positions.count, &c.v);
	if (!r && take(o, '/')) {
		bool slash = take(o, '/');
		if (!slash) {
			r = read_index(o, "texture coordinate", o->uvs.count, &c.vt);
			slash = !r && take(o, '/');
		}
		if (!r && slash)
			r = read_index(o, "normal", o->normals.count, &c.vn);
	}
	if (r)
		return r;
	if (o->p < o->end && !number_is_blank(*o->p) && *o->p != '\\' && *o->p != '#')
		return node_error(o->node, o->error, EINVAL, "%s:%d: a face's corners are v, v/vt, v//vn or v/vt/vn",
				  o->name, o->line);
	struct corner *new = push(&o->corners);
	if (!new)
		return out_of_memory(o);
	*new = c;
	return 0;
}

static int read_face(struct obj *o)
{
	uint32_t first = (uint32_t)o->corners.count, n = 0;
	for (; !at_end_of_line(o); n++) {
		int r = read_corner(o);
		if (r)
			return r;
		if (n < 2)
			continue;
		if (o->triangles.count >= MESH_TRIANGLES_MAX)
			return node_error(o->node, o->error, E2BIG, "%s:%d: more than %d triangles", o->name, o->line,
					  MESH_TRIANGLES_MAX);
		uint32_t *t = push(&o->triangles);
		if (!t)
			return out_of_memory(o);
		t[0] = first;
		t[1] = first + n - 1;
		t[2] = first + n;
	}
	if (n < 3)
		return node_error(o->node, o->error, EINVAL, "%s:%d: a face of %u corners", o->name, o->line, n);
	return 0;
}

static int read_line(struct obj *o)
{
	skip_blanks(o);
	const char *word = o->p;
	while (o->p < o->end && !number_is_blank(*o->p))
		o->p++;
	size_t n = (size_t)(o->p - word);
	if (n == 1 && *word == 'v')
		return read_numbers(o, "v", &o->positions, 3, 3);
	if (n == 2 && memcmp(word, "vt", 2) == 0)
		return read_numbers(o, "vt", &o->uvs, 1, 2);
	if (n == 2 && memcmp(word, "vn", 2) == 0)
		return read_normal(o);
	o->materials |= n == 6 && memcmp(word, "usemtl", 6) == 0;
	return n == 1 && *word == 'f' ? read_face(o) : 0;
}

static int read_lines(struct obj *o)
{
	while (o->p < o->end) {
		o->line++;
		tick();
		int r = read_line(o);
		if (r)
			return r;
		const char *newline = memchr(o->p, '\n', (size_t)(o->end - o->p));
		o->p = newline ? newline + 1 : o->end;
	}
	if (o->triangles.count == 0)
		return node_error(o->node, o->error, EINVAL, "%s: has no faces", o->name);
	return 0;
}

static int compare_corners(const void *a, const void *b)
{
	const struct corner *x = a, *y = b;
	tick();
	if (x->v != y->v)
		return x->v < y->v ? -1 : 1;
	if (x->vt != y->vt)
		return x->vt < y->vt ? -1 : 1;
	if (x->vn != y->vn)
		return x->vn < y->vn ? -1 : 1;
	return x->at < y->at ? -1 : x->at > y->at;
}

static bool same_vertex(const struct corner *a, const struct corner *b)
{
	return a->v == b->v && a->vt == b->vt && a->vn == b->vn;
}

static void set_vertex(const struct obj *o, struct mesh *m, uint32_t i, const struct corner *c, bool flip)
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

/* Corners that agree in all three indices share a vertex. Sorting takes a bounded time whatever the file says. */
static int make_mesh(struct obj *o, struct arena *arena, struct mesh *m, bool flip)
{
	struct corner *c = o->corners.items;
	size_t n = o->corners.count;
	uint32_t *vertex_of = mem_alloc(n, sizeof *vertex_of);
	if (!vertex_of)
		return out_of_memory(o);
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
	return ok ? 0 : out_of_memory(o);
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct asset a;
	int r = mesh_open(n, assets, &a, e);
	if (r)
		return r;
	const char *name = node_string(n, "filename", ""), *bytes = (const char *)a.bytes;
	struct obj o = {.node = n, .name = name, .error = e, .p = bytes, .end = bytes + a.size};
	o.positions.size = o.normals.size = 3 * sizeof(double);
	o.uvs.size = 2 * sizeof(double);
	o.corners.size = sizeof(struct corner);
	o.triangles.size = 3 * sizeof(uint32_t);
	r = a.size > UINT32_MAX ? node_error(n, e, EFBIG, "%s: larger than 4 GB", name) : read_lines(&o);
	assets->close(assets->user, &a);
	out->materials = o.materials && node_bool(n, "load_materials", true);
	if (!r)
		r = make_mesh(&o, arena, &out->mesh, node_bool(n, "flip_tex_coords", true));
	mem_free(o.positions.items);
	mem_free(o.normals.items);
	mem_free(o.uvs.items);
	mem_free(o.corners.items);
	mem_free(o.triangles.items);
	return r;
}

const struct shape_ops shape_ops_obj = {.type = "obj", .params = params, .build = build};
