/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Mitsuba's binary meshes (.serialized, versions 3 to 5). A file contains any number of meshes, each compressed
 * separately, and a table of their offsets at its end; `shape_index` selects a mesh.
 *
 * A mesh is a magic number, a version, and a zlib stream with flags, a name (from version 4), counts, positions, then
 * normals, texture coordinates and colours if the flags say so, and triangles. Version 5 instead has a record of eight
 * floats per vertex, one of four integers per triangle, two maps from vertices to positions and to normals, which only
 * editors need, and named attributes. Everything is little-endian.
 *
 * Reading fails if the table exceeds the file, if a stream is damaged or truncated, if an index is out of range, if a
 * number is not finite, or if a mesh has tangents (in version 5, where they replace the normals) or several BSDFs.
 * Counts are checked against the most bytes that the stream can decompress to.
 */
#include "common/base/bytes.h"
#include "common/base/liveness.h"
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"

#include <string.h>

#define ZLIB_CONST
#include <zlib.h>

enum { MAGIC = 0x041c, VERSION_3 = 3, VERSION_4 = 4, VERSION_5 = 5, NAME_BYTES_MAX = 1 << 16, CHUNK_ITEMS = 1024 };
enum { ZLIB_RATIO = 1032 /* the most bytes that one byte of deflate can represent */ };
enum { HAS_NORMALS = 1, HAS_UV = 2, HAS_COLOURS = 8, HAS_FACE_NORMALS = 16, HAS_DOUBLES = 0x2000 };

/* Flags and sizes of version 5. */
enum {
	HAS_TANGENTS_5 = 2,
	HAS_UV_5 = 4,
	HAS_FLOATS = 0x1000,
	VERTEX_RECORD_SIZE = 32,
	FACE_RECORD_SIZE = 16,
	ATTRIBUTES_MAX = 64
};

struct stream {
	const struct scene_node *node;
	const char *name;
	struct error *error;
	z_stream z;
	uint64_t max_bytes; /* the most bytes that the stream can decompress to */
};

static int file_error(const struct stream *s, const char *what)
{
	return node_error(s->node, s->error, EINVAL, "%s: %s", s->name, what);
}

static int read_stream(struct stream *s, void *out, size_t size)
{
	s->z.next_out = out;
	while (size > 0) {
		uInt piece = size < 1u << 20 ? (uInt)size : 1u << 20;
		s->z.avail_out = piece;
		liveness_tick();
		int code = inflate(&s->z, Z_SYNC_FLUSH);
		size -= piece - s->z.avail_out;
		if (s->z.avail_out > 0 && code != Z_OK)
			return code == Z_MEM_ERROR ? node_error(s->node, s->error, ENOMEM, "%s: out of memory", s->name)
						   : file_error(s, "the compressed mesh is damaged or ends too early");
	}
	return 0;
}

static int read_uint(struct stream *s, int size, uint64_t *x)
{
	unsigned char raw[8];
	int r = read_stream(s, raw, (size_t)size);
	*x = r ? 0 : get_bytes(raw, size);
	return r;
}

static int skip_bytes(struct stream *s, uint64_t size)
{
	unsigned char raw[4096];
	int r = 0;
	for (; !r && size > 0; size -= size < sizeof raw ? size : sizeof raw)
		r = read_stream(s, raw, size < sizeof raw ? (size_t)size : sizeof raw);
	return r;
}

static int skip_name(struct stream *s)
{
	char c;
	for (int i = 0; i < NAME_BYTES_MAX; i++) {
		int r = read_stream(s, &c, 1);
		if (r || c == 0)
			return r;
	}
	return file_error(s, "the mesh's name does not end");
}

/* Reads count x width numbers. */
static int read_floats(struct stream *s, bool doubles, bool must_be_finite, uint32_t count, int width, double *out)
{
	unsigned char raw[CHUNK_ITEMS * 8];
	int size = doubles ? 8 : 4;
	uint64_t remaining = (uint64_t)count * (uint64_t)width;
	while (remaining > 0) {
		size_t n = remaining < CHUNK_ITEMS ? (size_t)remaining : CHUNK_ITEMS;
		int r = read_stream(s, raw, n * (size_t)size);
		if (r)
			return r;
		for (size_t i = 0; i < n; i++) {
			uint64_t bits = get_bytes(raw + i * (size_t)size, size);
			uint32_t low = (uint32_t)bits;
			float f;
			memcpy(&f, &low, sizeof f);
			if (doubles)
				memcpy(out, &bits, sizeof *out);
			else
				*out = (double)f;
			if (must_be_finite && !(fabs(*out) <= MESH_COORDINATE_MAX))
				return file_error(s, "a number that is not finite, or beyond 1e60");
			out++;
		}
		remaining -= n;
	}
	return 0;
}

static int read_attribute_values(struct stream *s, bool doubles, uint32_t items, struct attribute *a)
{
	enum { ITEMS_AT_ONCE = 256 };
	double x[ATTRIBUTE_CHANNELS_MAX * ITEMS_AT_ONCE];
	for (uint32_t done = 0; done < items;) {
		uint32_t n = items - done < ITEMS_AT_ONCE ? items - done : ITEMS_AT_ONCE;
		int r = read_floats(s, doubles, false, n, (int)a->channels, x);
		if (r)
			return r;
		for (uint32_t i = 0; i < n * a->channels; i++)
			mesh_set_attribute(a, done + i / a->channels, i % a->channels, x[i]);
		done += n;
	}
	return 0;
}

/* Reads colours, which are linear, as the attribute that Mitsuba 3 calls vertex_color. */
static int read_colours(struct stream *s, bool doubles, struct mesh *m, struct arena *arena)
{
	struct attribute *a = mesh_add_attribute(m, "vertex_color", false, 3, 1, arena);
	if (!a)
		return node_error(s->node, s->error, ENOMEM, "%s: out of memory", s->name);
	return read_attribute_values(s, doubles, m->vertex_count, a);
}

/* Reads triangles: three indices each, and in version 5 the index of a BSDF. */
static int read_triangles(struct stream *s, int version, struct mesh *m)
{
	size_t size = version == VERSION_5 ? FACE_RECORD_SIZE : 12;
	unsigned char raw[CHUNK_ITEMS * FACE_RECORD_SIZE];
	for (uint32_t done = 0; done < m->triangle_count;) {
		uint32_t n = m->triangle_count - done < CHUNK_ITEMS ? m->triangle_count - done : CHUNK_ITEMS;
		int r = read_stream(s, raw, n * size);
		if (r)
			return r;
		for (const unsigned char *face = raw; face < raw + n * size; face += size, done++) {
			for (int k = 0; k < 3; k++) {
				m->index[done][k] = (uint32_t)get_bytes(face + 4 * k, 4);
				if (m->index[done][k] >= m->vertex_count)
					return file_error(s, "a triangle's index is out of range");
			}
			if (version == VERSION_5 && get_bytes(face + 12, 4) != 0)
				return node_error(s->node, s->error, ENOTSUP,
						  "%s: a mesh with several BSDFs is not supported", s->name);
		}
	}
	return 0;
}

/* Reads to the end of the stream, where its checksum is. Undamaged data after the triangles is ignored. */
static int check_end(struct stream *s)
{
	unsigned char extra;
	s->z.next_out = &extra;
	s->z.avail_out = 1;
	return inflate(&s->z, Z_SYNC_FLUSH) == Z_DATA_ERROR ? file_error(s, "the compressed mesh is damaged") : 0;
}

/* Allocates count[0] vertices and count[1] triangles, after checking that the stream can contain them. Sizes are in
 * bytes. */
static int alloc_mesh(const struct stream *s, const uint64_t count[2], uint64_t vertex_size, uint64_t triangle_size,
		      bool normals, bool uv, struct arena *arena, struct mesh *m)
{
	if (count[0] == 0 && count[1] > 0)
		return file_error(s, "the mesh has triangles, but no vertices");
	if (count[1] > MESH_TRIANGLES_MAX || count[0] >= UINT32_MAX || count[0] > s->max_bytes / vertex_size ||
	    count[1] > s->max_bytes / triangle_size)
		return file_error(s, "more vertices or triangles than the file can contain");
	if (!mesh_alloc(m, (uint32_t)count[0], (uint32_t)count[1], normals, uv, arena))
		return node_error(s->node, s->error, ENOMEM, "%s: out of memory", s->name);
	return 0;
}

/* Reads a length and a text of that length into out, terminated by 0. */
static int read_string(struct stream *s, char *out, size_t capacity)
{
	uint64_t length = 0;
	int r = read_uint(s, 4, &length);
	if (!r && length >= capacity)
		return file_error(s, "a name that is too long");
	if (!r)
		r = read_stream(s, out, (size_t)length);
	out[r ? 0 : length] = 0;
	return r;
}

/* Reads records of position, normal and texture coordinates; the numbers that a mesh does not use are ignored. */
static int read_vertex_records(struct stream *s, struct mesh *m)
{
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		double record[8];
		int r = read_floats(s, false, false, 1, 8, record);
		if (r)
			return r;
		for (int k = 0; k < 8; k++)
			if (!(fabs(record[k]) <= MESH_COORDINATE_MAX) && (k < 3 || (k < 6 ? !!m->normal : !!m->uv)))
				return file_error(s, "a number that is not finite, or beyond 1e60");
		memcpy(m->position[i], record, sizeof m->position[i]);
		if (m->normal)
			memcpy(m->normal[i], record + 3, sizeof m->normal[i]);
		if (m->uv)
			memcpy(m->uv[i], record + 6, sizeof m->uv[i]);
	}
	return 0;
}

/* Reads an attribute. Those with coefficients of a spectral variant are not colours and are left out. */
static int read_attribute(struct stream *s, struct mesh *m, uint32_t capacity, struct arena *arena)
{
	char name[ATTRIBUTE_NAME_MAX];
	uint64_t coefficients, channels;
	int r = read_string(s, name, sizeof name);
	if (!r)
		r = read_uint(s, 1, &coefficients);
	if (!r)
		r = read_uint(s, 4, &channels);
	if (r)
		return r;
	bool per_face = strncmp(name, "face_", 5) == 0;
	uint64_t items = per_face ? m->triangle_count : m->vertex_count;
	if (!per_face && strncmp(name, "vertex_", 7) != 0)
		return file_error(s, "an attribute that is neither of vertices nor of faces");
	if (channels < 1 || channels > ATTRIBUTE_CHANNELS_MAX || items > s->max_bytes / (4 * channels))
		return file_error(s, "an attribute with more numbers than the file can contain");
	if (coefficients & 1)
		return skip_bytes(s, 4 * items * channels);
	struct attribute *a = mesh_add_attribute(m, name, per_face, (uint32_t)channels, capacity, arena);
	if (!a)
		return node_error(s->node, s->error, ENOMEM, "%s: out of memory", s->name);
	return read_attribute_values(s, false, (uint32_t)items, a);
}

static int read_attributes(struct stream *s, struct mesh *m, struct arena *arena)
{
	uint64_t count;
	int r = read_uint(s, 4, &count);
	if (!r && count > ATTRIBUTES_MAX)
		return file_error(s, "more than 64 attributes");
	for (uint64_t i = 0; !r && i < count; i++)
		r = read_attribute(s, m, (uint32_t)count, arena);
	return r;
}

static int read_mesh_5(struct stream *s, uint64_t flags, struct arena *arena, struct mesh *m)
{
	uint64_t length = 0, count[4] = {0}; /* of vertices, triangles, positions, normals */
	int r = read_uint(s, 4, &length);
	if (!r)
		r = length > NAME_BYTES_MAX ? file_error(s, "a name that is too long") : skip_bytes(s, length);
	for (int i = 0; !r && i < 4; i++)
		r = read_uint(s, 8, &count[i]);
	if (r)
		return r;
	if (!(flags & HAS_FLOATS) || count[2] > count[0] || count[3] > count[0])
		return file_error(s, "the header of the mesh is damaged");
	if (flags & HAS_TANGENTS_5)
		return node_error(s->node, s->error, ENOTSUP, "%s: shading tangents are not supported", s->name);
	r = alloc_mesh(s, count, VERTEX_RECORD_SIZE, FACE_RECORD_SIZE, flags & HAS_NORMALS, flags & HAS_UV_5, arena, m);
	if (!r)
		r = read_vertex_records(s, m);
	if (!r)
		r = read_triangles(s, VERSION_5, m);
	if (!r)
		r = skip_bytes(s, count[2] > 0 ? 4 * count[0] : 0);
	if (!r)
		r = skip_bytes(s, count[3] > 0 ? 4 * count[0] : 0);
	if (!r)
		r = read_attributes(s, m, arena);
	return r;
}

static int read_mesh_3_or_4(struct stream *s, int version, uint64_t flags, struct arena *arena, struct mesh *m)
{
	uint64_t count[2];
	int r = version == VERSION_4 ? skip_name(s) : 0;
	for (int i = 0; !r && i < 2; i++)
		r = read_uint(s, 8, &count[i]);
	if (r)
		return r;
	bool doubles = flags & HAS_DOUBLES;
	r = alloc_mesh(s, count, doubles ? 24 : 12, 12, flags & HAS_NORMALS, flags & HAS_UV, arena, m);
	if (!r)
		r = read_floats(s, doubles, true, m->vertex_count, 3, m->position[0]);
	if (!r && m->normal)
		r = read_floats(s, doubles, true, m->vertex_count, 3, m->normal[0]);
	if (!r && m->uv)
		r = read_floats(s, doubles, true, m->vertex_count, 2, m->uv[0]);
	if (!r && (flags & HAS_COLOURS))
		r = read_colours(s, doubles, m, arena);
	if (!r)
		r = read_triangles(s, version, m);
	return r;
}

static int read_mesh(struct stream *s, int version, struct arena *arena, struct shape_geometry *out)
{
	struct mesh *m = &out->mesh;
	uint64_t flags;
	int r = read_uint(s, 4, &flags);
	if (!r)
		r = version == VERSION_5 ? read_mesh_5(s, flags, arena, m)
					 : read_mesh_3_or_4(s, version, flags, arena, m);
	if (!r)
		r = check_end(s);
	for (uint32_t i = 0; !r && m->normal && i < m->vertex_count; i++)
		vec3_store(m->normal[i], vec3_unit_or_zero(vec3_load(m->normal[i])));
	out->has_face_normals = flags & HAS_FACE_NORMALS;
	return r;
}

/* Finds the beginning and the end of mesh `index`. The last four bytes of the file are the number of meshes; their
 * offsets precede it. */
static int find_mesh(const struct stream *s, const struct asset *a, uint64_t index, size_t *begin, size_t *end)
{
	enum { MESH_HEADER_SIZE = 4 };
	if (a->size < MESH_HEADER_SIZE + 4 || get_bytes(a->bytes, 2) != MAGIC)
		return file_error(s, "this is not a serialized mesh");
	uint64_t version = get_bytes(a->bytes + 2, 2);
	if (version < VERSION_3 || version > VERSION_5)
		return node_error(s->node, s->error, ENOTSUP, "%s: version %llu is not supported (supported: 3, 4, 5)",
				  s->name, (unsigned long long)version);
	uint64_t count = get_bytes(a->bytes + a->size - 4, 4);
	int width = version == VERSION_3 ? 4 : 8;
	if (count == 0 || count > (a->size - 4) / (uint64_t)width)
		return file_error(s, "the table of meshes at its end is damaged");
	if (index >= count)
		return node_error(s->node, s->error, ERANGE,
				  "%s: shape_index=%llu, but the file has %llu mesh%s, counted from 0", s->name,
				  (unsigned long long)index, (unsigned long long)count, count == 1 ? "" : "es");
	size_t table = a->size - 4 - (size_t)count * (size_t)width;
	uint64_t mesh_begin = get_bytes(a->bytes + table + index * (size_t)width, width);
	uint64_t mesh_end =
		index + 1 < count ? get_bytes(a->bytes + table + (index + 1) * (size_t)width, width) : table;
	if (mesh_begin > table || mesh_end > table || mesh_end < mesh_begin + MESH_HEADER_SIZE ||
	    get_bytes(a->bytes + mesh_begin, 2) != MAGIC || get_bytes(a->bytes + mesh_begin + 2, 2) != version)
		return file_error(s, "the table of meshes at its end is damaged");
	*begin = (size_t)mesh_begin;
	*end = (size_t)mesh_end;
	return 0;
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct asset a;
	int r = mesh_open_file(n, assets, &a, e);
	if (r)
		return r;
	struct stream s = {.node = n, .name = node_string(n, "filename", ""), .error = e};
	size_t begin = 0, end = 0;
	r = find_mesh(&s, &a, (uint64_t)node_int(n, "shape_index", 0), &begin, &end);
	if (!r && end - begin > UINT_MAX)
		r = node_error(n, e, EFBIG, "%s: a mesh of more than 4 GB", s.name);
	if (!r && inflateInit(&s.z) != Z_OK)
		r = node_error(n, e, ENOMEM, "%s: out of memory", s.name);
	if (!r) {
		size_t size = end - begin - 4;
		s.z.next_in = a.bytes + begin + 4;
		s.z.avail_in = (uInt)size;
		s.max_bytes = (uint64_t)size * ZLIB_RATIO;
		r = read_mesh(&s, (int)get_bytes(a.bytes + begin + 2, 2), arena, out);
		inflateEnd(&s.z);
	}
	assets->close(assets->user, &a);
	return r;
}

SHAPE_OPS(serialized, {"filename", UNDERSTOOD(VALUE_STRING)},
	  {"shape_index", VALUE_INT, PARAM_UNDERSTOOD, 0, 1 << 24, NULL}, {"face_normals", UNDERSTOOD(VALUE_BOOL)},
	  {"collapse", IGNORED}, MESH_SMOOTH_PARAM, SHAPE_PARAMS);
