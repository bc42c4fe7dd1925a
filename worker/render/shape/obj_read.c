/* SPDX-License-Identifier: Apache-2.0 */
/*
 * obj_file_read opens an OBJ file and reads it line by line in one pass. Numbers, corners and triangles are added to
 * lists that grow by doubling; polygons are cut into triangles (polygon.h); `usemtl` begins a run of faces with one
 * material, and with `g` it separates meshes. The cache keeps the file that was read last.
 *
 * Reading fails, with the file and the line, if a number is invalid, or if an index refers to an element that the file
 * has not defined yet. It also fails if the file has neither vertices nor faces, or is larger than 4 GB. After an error
 * nothing is left allocated.
 */
#include "worker/render/shape/obj_read.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/text/number.h"
#include "worker/render/image/srgb.h"
#include "worker/render/shape/polygon.h"

#include <string.h>

struct reader {
	struct obj_file *file;
	const struct scene_node *node;
	const char *name;
	struct error *error;
	const char *p, *end;
	int line;
	bool is_in_mesh; /* a face now belongs to the last mesh */
};

static int out_of_memory(const struct reader *o)
{
	return node_error(o->node, o->error, ENOMEM, "%s:%d: out of memory", o->name, o->line);
}

/* Skips blanks, and the backslash that joins two lines. */
static void skip_blanks(struct reader *o)
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

static bool at_end_of_line(struct reader *o)
{
	skip_blanks(o);
	return o->p >= o->end || *o->p == '\n' || *o->p == '#';
}

static int read_numbers(struct reader *o, const char *keyword, struct list *l, size_t required, size_t count)
{
	double *v = list_push(l);
	if (!v)
		return out_of_memory(o);
	for (size_t i = 0; i < count; i++) {
		v[i] = 0;
		if (i >= required && at_end_of_line(o))
			continue;
		skip_blanks(o);
		bool normal = l == &o->file->normals;
		const char *rest = (normal ? number_scan_printed : number_scan)(o->p, o->end, &v[i]);
		bool is_terminated =
			rest && (rest == o->end || number_is_blank(*rest) || *rest == '\\' || *rest == '#');
		if (!is_terminated || (!(fabs(v[i]) <= MESH_COORDINATE_MAX) && !normal))
			return node_error(o->node, o->error, EINVAL, "%s:%d: `%s` needs %zu finite numbers", o->name,
					  o->line, keyword, required);
		o->p = rest;
	}
	return 0;
}

/* Reads the colour of a vertex: exactly three numbers between its position and the end of the line, in sRGB. Anything
 * else there is skipped. */
static int read_colour(struct reader *o)
{
	double rgb[3];
	for (int k = 0; k < 3; k++) {
		const char *rest = at_end_of_line(o) ? NULL : number_scan(o->p, o->end, &rgb[k]);
		if (!rest)
			return 0;
		o->p = rest;
	}
	if (!at_end_of_line(o))
		return 0;
	double *colour = list_push(&o->file->colours);
	if (!colour)
		return out_of_memory(o);
	for (int k = 0; k < 3; k++)
		colour[k] = fabs(rgb[k]) <= MESH_ATTRIBUTE_MAX ? srgb_to_linear(rgb[k]) : rgb[k];
	return 0;
}

static int read_position(struct reader *o)
{
	int r = read_numbers(o, "v", &o->file->positions, 3, 3);
	return r ? r : read_colour(o);
}

static int read_normal(struct reader *o)
{
	return read_numbers(o, "vn", &o->file->normals, 3, 3);
}

/* Reads an index. Indices count from 1, or backwards from -1 for the last element. */
static int read_index(struct reader *o, const char *element, size_t count, uint32_t *out)
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
				  element, (long long)i, count);
	*out = (uint32_t)k;
	o->p = rest;
	return 0;
}

static bool accept_char(struct reader *o, char c)
{
	if (o->p < o->end && *o->p == c) {
		o->p++;
		return true;
	}
	return false;
}

static int read_corner(struct reader *o)
{
	struct obj_corner c = {.index = (uint32_t)o->file->corners.count};
	int r = read_index(o, "vertex", o->file->positions.count, &c.v);
	if (!r && accept_char(o, '/')) {
		bool slash = accept_char(o, '/');
		if (!slash) {
			r = read_index(o, "texture coordinate", o->file->uvs.count, &c.vt);
			slash = !r && accept_char(o, '/');
		}
		if (!r && slash)
			r = read_index(o, "normal", o->file->normals.count, &c.vn);
	}
	if (r)
		return r;
	if (o->p < o->end && !number_is_blank(*o->p) && *o->p != '\\' && *o->p != '#')
		return node_error(o->node, o->error, EINVAL, "%s:%d: a face's corners are v, v/vt, v//vn or v/vt/vn",
				  o->name, o->line);
	struct obj_corner *new = list_push(&o->file->corners);
	if (!new)
		return out_of_memory(o);
	*new = c;
	return 0;
}

/* Replaces the fan of triangles of the last face by those of the polygon. Polygons of more than POLYGON_CORNERS_MAX
 * corners stay fans. */
static void triangulate_face(struct reader *o, uint32_t first, uint32_t n)
{
	const double(*position)[3] = o->file->positions.items;
	const struct obj_corner *c = (const struct obj_corner *)o->file->corners.items + first;
	uint32_t(*t)[3] = (uint32_t(*)[3])o->file->triangles.items + (o->file->triangles.count - (n - 2));
	struct polygon p;
	if (n > POLYGON_CORNERS_MAX)
		return;
	for (p.corner_count = 0; p.corner_count < n; p.corner_count++)
		p.corner[p.corner_count] = vec3_load(position[c[p.corner_count].v - 1]);
	polygon_triangulate(&p, t);
	for (uint32_t i = 0; i < n - 2; i++)
		for (int k = 0; k < 3; k++)
			t[i][k] += first;
}

static int add_triangle(struct reader *o, uint32_t a, uint32_t b, uint32_t c)
{
	if (o->file->triangles.count >= MESH_TRIANGLES_MAX)
		return node_error(o->node, o->error, E2BIG, "%s:%d: more than %d triangles", o->name, o->line,
				  MESH_TRIANGLES_MAX);
	uint32_t *t = list_push(&o->file->triangles);
	if (!t)
		return out_of_memory(o);
	t[0] = a;
	t[1] = b;
	t[2] = c;
	return 0;
}

/* Of the face that follows. */
static int begin_mesh(struct reader *o)
{
	struct obj_file *f = o->file;
	struct obj_mesh *m = list_push(&f->meshes);
	if (!m)
		return out_of_memory(o);
	*m = (struct obj_mesh){f->runs.count - 1, f->corners.count, f->triangles.count};
	o->is_in_mesh = true;
	return 0;
}

static int read_face(struct reader *o)
{
	uint32_t first = (uint32_t)o->file->corners.count, n = 0;
	if (!o->is_in_mesh && begin_mesh(o))
		return -ENOMEM;
	for (; !at_end_of_line(o); n++) {
		int r = read_corner(o);
		if (!r && n >= 2)
			r = add_triangle(o, first, first + n - 1, first + n);
		if (r)
			return r;
	}
	if (n == 0)
		return node_error(o->node, o->error, EINVAL, "%s:%d: a face without corners", o->name, o->line);
	/* Exporters write points and lines as faces of one or two corners: they become triangles without area. */
	if (n < 3)
		return add_triangle(o, first, first + n - 1, first + n - 1);
	if (n > 3)
		triangulate_face(o, first, n);
	return 0;
}

/* Begins a run of faces; replaces the last run if that has no faces. */
static int begin_run(struct reader *o, const char *name, size_t length)
{
	struct obj_file *f = o->file;
	struct obj_run *last = f->runs.count ? (struct obj_run *)f->runs.items + (f->runs.count - 1) : NULL;
	if (!last || last->first_triangle < f->triangles.count)
		last = list_push(&f->runs);
	if (!last)
		return out_of_memory(o);
	*last = (struct obj_run){f->names.count, length, f->corners.count, f->triangles.count};
	for (size_t i = 0; i < length; i++) {
		char *c = list_push(&f->names);
		if (!c)
			return out_of_memory(o);
		*c = name[i];
	}
	return 0;
}

/* The name of a material is the rest of the line, including blanks. */
static int read_material(struct reader *o)
{
	size_t length;
	o->is_in_mesh = false;
	const char *name = number_line_rest(o->p, o->end, &length);
	return begin_run(o, name, length);
}

static int read_line(struct reader *o)
{
	skip_blanks(o);
	const char *word = o->p;
	while (o->p < o->end && !number_is_blank(*o->p))
		o->p++;
	size_t n = (size_t)(o->p - word);
	if (n == 1 && *word == 'v')
		return read_position(o);
	if (n == 2 && memcmp(word, "vt", 2) == 0)
		return read_numbers(o, "vt", &o->file->uvs, 1, 2);
	if (n == 2 && memcmp(word, "vn", 2) == 0)
		return read_normal(o);
	if (n == 6 && memcmp(word, "usemtl", 6) == 0)
		return read_material(o);
	if (n == 1 && *word == 'g')
		o->is_in_mesh = false;
	return n == 1 && *word == 'f' ? read_face(o) : 0;
}

static int read_lines(struct reader *o)
{
	while (o->p < o->end) {
		o->line++;
		liveness_tick();
		int r = read_line(o);
		if (r)
			return r;
		const char *newline = memchr(o->p, '\n', (size_t)(o->end - o->p));
		o->p = newline ? newline + 1 : o->end;
	}
	/* A file with vertices but without faces is an empty mesh; one without either is not an OBJ file. */
	if (o->file->triangles.count == 0 && o->file->positions.count == 0)
		return node_error(o->node, o->error, EINVAL, "%s: has no vertices and no faces", o->name);
	return 0;
}

static void obj_file_free(struct obj_file *o)
{
	struct list *all[] = {&o->positions, &o->uvs,  &o->normals, &o->colours, &o->corners,
			      &o->triangles, &o->runs, &o->names,   &o->meshes};
	for (size_t i = 0; i < sizeof all / sizeof *all; i++)
		list_fini(all[i]);
	*o = (struct obj_file){0};
}

/* Reads the file that the node names. If it returns 0, *o has to be released with obj_file_free. */
static int obj_file_read(struct obj_file *o, const struct scene_node *n, const struct asset_source *assets,
			 struct error *e)
{
	*o = (struct obj_file){0};
	struct asset a;
	int r = mesh_open_file(n, assets, &a, e);
	if (r)
		return r;
	const char *bytes = (const char *)a.bytes;
	struct reader reader = {.file = o,
				.node = n,
				.name = node_string(n, "filename", ""),
				.error = e,
				.p = bytes,
				.end = bytes + a.size};
	o->positions.item_size = o->normals.item_size = o->colours.item_size = 3 * sizeof(double);
	o->uvs.item_size = 2 * sizeof(double);
	o->corners.item_size = sizeof(struct obj_corner);
	o->triangles.item_size = 3 * sizeof(uint32_t);
	o->runs.item_size = sizeof(struct obj_run);
	o->names.item_size = 1;
	o->meshes.item_size = sizeof(struct obj_mesh);
	if (a.size > UINT32_MAX)
		r = node_error(n, e, EFBIG, "%s: larger than 4 GB", reader.name);
	else if (!(r = begin_run(&reader, "", 0)))
		r = read_lines(&reader);
	assets->close(assets->user, &a);
	if (r)
		obj_file_free(o);
	return r;
}

int obj_cache_read(struct obj_cache *c, const struct scene_node *n, const struct asset_source *assets, struct error *e)
{
	const char *name = node_string(n, "filename", "");
	if (c->name && strcmp(c->name, name) == 0)
		return 0;
	obj_cache_fini(c);
	int r = obj_file_read(&c->file, n, assets, e);
	if (r)
		return r;
	c->name = mem_strdup(name);
	if (c->name)
		return 0;
	obj_file_free(&c->file);
	return node_error(n, e, ENOMEM, "%s: out of memory", name);
}

void obj_cache_fini(struct obj_cache *c)
{
	if (c->name)
		obj_file_free(&c->file);
	mem_free(c->name);
	c->name = NULL;
}
