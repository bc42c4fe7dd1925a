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

enum { MAGIC = 0x041c, VERSION_3 = 3, VERSION_4 = 4, VERSION_5 = 5, NAME_MAX_BYTES = 1 << 16, CHUNK_ITEMS = 1024 };
enum { ZLIB_RATIO = 1032 /* the most bytes that one byte of deflate can represent */ };
enum { HAS_NORMALS = 1, HAS_UV = 2, HAS_COLOURS = 8, HAS_FACE_NORMALS = 16, DOUBLES = 0x2000 };

/* Flags and sizes of version 5. */
enum { HAS_TANGENTS_5 = 2, HAS_UV_5 = 4, FLOATS = 0x1000, RECORD = 32, FACE_RECORD = 16, ATTRIBUTES_MAX = 64 };

struct stream {
	const struct scene_node *node;
	const char *name;
	struct error *error;
	z_stream z;
	uint64_t most; /* the most bytes that the stream can decompress to */
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

static int take_number(struct stream *s, int bytes, uint64_t *x)
{
	unsigned char raw[8];
	int r = read_stream(s, raw, (size_t)bytes);
	*x = r ? 0 : get_bytes(raw, bytes);
	return r;
}

static int skip(struct stream *s, uint64_t size)
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
	for (int i = 0; i < NAME_MAX_BYTES; i++) {
		int r = read_stream(s, &c, 1);
		if (r || c == 0)
			return r;
	}
	return file_error(s, "the mesh's name does not end");
}

/* Reads count x width numbers. */
static int take_reals(struct stream *s, bool doubles, bool must_be_finite, uint32_t count, int width, double *out)
{
	unsigned char raw[CHUNK_ITEMS * 8];
	int size = doubles ? 8 : 4;
	uint64_t left = (uint64_t)count * (uint64_t)width;
	while (left > 0) {
		size_t n = left < CHUNK_ITEMS ? (size_t)left : CHUNK_ITEMS;
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
		left -= n;
	}
	return 0;
}

static int take_values(struct stream *s, bool doubles, uint32_t items, struct attribute *a)
{
	enum { AT_ONCE = 256 };
	double x[ATTRIBUTE_CHANNELS_MAX * AT_ONCE];
	for (uint32_t done = 0; done < items;) {
		uint32_t n = items - done < AT_ONCE ? items - done : AT_ONCE;
		int r = take_reals(s, doubles, false, n, (int)a->channels, x);
		if (r)
			return r;
		for (uint32_t i = 0; i < n * a->channels; i++)
			mesh_set_attribute(a, done + i / a->channels, i % a->channels, x[i]);
		done += n;
	}
	return 0;
}

/* Reads colours, which are linear, as the attribute that Mitsuba 3 calls vertex_color. */
static int take_colours(struct stream *s, bool doubles, struct mesh *m, struct arena *arena)
{
	struct attribute *a = mesh_add_attribute(m, "vertex_color", false, 3, 1, arena);
	if (!a)
		return node_error(s->node, s->error, ENOMEM, "%s: out of memory", s->name);
	return take_values(s, doubles, m->vertex_count, a);
}

/* Reads triangles: three indices each, and in version 5 the index of a BSDF. */
static int take_triangles(struct stream *s, int version, struct mesh *m)
{
	size_t size = version == VERSION_5 ? FACE_RECORD : 12;
	unsigned char raw[CHUNK_ITEMS * FACE_RECORD];
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
	unsigned char beyond;
	s->z.next_out = &beyond;
	s->z.avail_out = 1;
	return inflate(&s->z, Z_SYNC_FLUSH) == Z_DATA_ERROR ? file_error(s, "the compressed mesh is damaged") : 0;
}

/* Allocates count[0] vertices and count[1] triangles, after checking that the stream can contain them. Sizes are in
 * bytes. */
static int make_room(const struct stream *s, const uint64_t count[2], uint64_t vertex_size, uint64_t triangle_size,
		     bool normals, bool uv, struct arena *arena, struct mesh *m)
{
	if (count[0] == 0 && count[1] > 0)
		return file_error(s, "the mesh has triangles, but no vertices");
	if (count[1] > MESH_TRIANGLES_MAX || count[0] >= UINT32_MAX || count[0] > s->most / vertex_size ||
	    count[1] > s->most / triangle_size)
		return file_error(s, "more vertices or triangles than the file can contain");
	if (!mesh_alloc(m, (uint32_t)count[0], (uint32_t)count[1], normals, uv, arena))
		return node_error(s->node, s->error, ENOMEM, "%s: out of memory", s->name);
	return 0;
}

/* Reads a length and a text of that length into out, terminated by 0. */
static int take_text(struct stream *s, char *out, size_t room)
{
	uint64_t length = 0;
	int r = take_number(s, 4, &length);
	if (!r && length >= room)
		return file_error(s, "a name that is too long");
	if (!r)
		r = read_stream(s, out, (size_t)length);
	out[r ? 0 : length] = 0;
	return r;
}

/* Reads records of position, normal and texture coordinates; the numbers that a mesh does not use are ignored. */
static int take_records(struct stream *s, struct mesh *m)
{
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		double lane[8];
		int r = take_reals(s, false, false, 1, 8, lane);
		if (r)
			return r;
		for (int k = 0; k < 8; k++)
			if (!(fabs(lane[k]) <= MESH_COORDINATE_MAX) && (k < 3 || (k < 6 ? !!m->normal : !!m->uv)))
				return file_error(s, "a number that is not finite, or beyond 1e60");
		memcpy(m->position[i], lane, sizeof m->position[i]);
		if (m->normal)
			memcpy(m->normal[i], lane + 3, sizeof m->normal[i]);
		if (m->uv)
			memcpy(m->uv[i], lane + 6, sizeof m->uv[i]);
	}
	return 0;
}

/* Reads an attribute. Those with coefficients of a spectral variant are not colours and are left out. */
static int take_attribute(struct stream *s, struct mesh *m, uint32_t room, struct arena *arena)
{
	char name[ATTRIBUTE_NAME_MAX];
	uint64_t coefficients, channels;
	int r = take_text(s, name, sizeof name);
	if (!r)
		r = take_number(s, 1, &coefficients);
	if (!r)
		r = take_number(s, 4, &channels);
	if (r)
		return r;
	bool per_face = strncmp(name, "face_", 5) == 0;
	uint64_t items = per_face ? m->triangle_count : m->vertex_count;
	if (!per_face && strncmp(name, "vertex_", 7) != 0)
		return file_error(s, "an attribute that is neither of vertices nor of faces");
	if (channels < 1 || channels > ATTRIBUTE_CHANNELS_MAX || items > s->most / (4 * channels))
		return file_error(s, "an attribute with more numbers than the file can contain");
	if (coefficients & 1)
		return skip(s, 4 * items * channels);
	struct attribute *a = mesh_add_attribute(m, name, per_face, (uint32_t)channels, room, arena);
	if (!a)
		return node_error(s->node, s->error, ENOMEM, "%s: out of memory", s->name);
	return take_values(s, false, (uint32_t)items, a);
}

static int take_attributes(struct stream *s, struct mesh *m, struct arena *arena)
{
	uint64_t count;
	int r = take_number(s, 4, &count);
	if (!r && count > ATTRIBUTES_MAX)
		return file_error(s, "more than 64 attributes");
	for (uint64_t i = 0; !r && i < count; i++)
		r = take_attribute(s, m, (uint32_t)count, arena);
	return r;
}

static int take_mesh_5(struct stream *s, uint64_t flags, struct arena *arena, struct mesh *m)
{
	uint64_t length = 0, count[4] = {0}; /* of vertices, triangles, positions, normals */
	int r = take_number(s, 4, &length);
	if (!r)
		r = length > NAME_MAX_BYTES ? file_error(s, "a name that is too long") : skip(s, length);
	for (int i = 0; !r && i < 4; i++)
		r = take_number(s, 8, &count[i]);
	if (r)
		return r;
	if (!(flags & FLOATS) || count[2] > count[0] || count[3] > count[0])
		return file_error(s, "the header of the mesh is damaged");
	if (flags & HAS_TANGENTS_5)
		return node_error(s->node, s->error, ENOTSUP, "%s: shading tangents are not supported", s->name);
	r = make_room(s, count, RECORD, FACE_RECORD, flags & HAS_NORMALS, flags & HAS_UV_5, arena, m);
	if (!r)
		r = take_records(s, m);
	if (!r)
		r = take_triangles(s, VERSION_5, m);
	if (!r)
		r = skip(s, count[2] > 0 ? 4 * count[0] : 0);
	if (!r)
		r = skip(s, count[3] > 0 ? 4 * count[0] : 0);
	if (!r)
		r = take_attributes(s, m, arena);
	return r;
}

static int take_mesh_3(struct stream *s, int version, uint64_t flags, struct arena *arena, struct mesh *m)
{
	uint64_t count[2];
	int r = version == VERSION_4 ? skip_name(s) : 0;
	for (int i = 0; !r && i < 2; i++)
		r = take_number(s, 8, &count[i]);
	if (r)
		return r;
	bool doubles = flags & DOUBLES;
	r = make_room(s, count, doubles ? 24 : 12, 12, flags & HAS_NORMALS, flags & HAS_UV, arena, m);
	if (!r)
		r = take_reals(s, doubles, true, m->vertex_count, 3, m->position[0]);
	if (!r && m->normal)
		r = take_reals(s, doubles, true, m->vertex_count, 3, m->normal[0]);
	if (!r && m->uv)
		r = take_reals(s, doubles, true, m->vertex_count, 2, m->uv[0]);
	if (!r && (flags & HAS_COLOURS))
		r = take_colours(s, doubles, m, arena);
	if (!r)
		r = take_triangles(s, version, m);
	return r;
}

static int take_mesh(struct stream *s, int version, struct arena *arena, struct shape_geometry *out)
{
	struct mesh *m = &out->mesh;
	uint64_t flags;
	int r = take_number(s, 4, &flags);
	if (!r)
		r = version == VERSION_5 ? take_mesh_5(s, flags, arena, m) : take_mesh_3(s, version, flags, arena, m);
	if (!r)
		r = check_end(s);
	for (uint32_t i = 0; !r && m->normal && i < m->vertex_count; i++)
		mesh_store(m->normal[i], mesh_unit(mesh_load(m->normal[i])));
	out->face_normals = flags & HAS_FACE_NORMALS;
	return r;
}

/* Finds the beginning and the end of mesh `index`. The last four bytes of the file are the number of meshes; their
 * offsets precede it. */
static int find_mesh(const struct stream *s, const struct asset *a, uint64_t index, size_t *begin, size_t *end)
{
	enum { HEAD = 4 };
	if (a->size < HEAD + 4 || get_bytes(a->bytes, 2) != MAGIC)
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
	uint64_t from = get_bytes(a->bytes + table + index * (size_t)width, width);
	uint64_t to = index + 1 < count ? get_bytes(a->bytes + table + (index + 1) * (size_t)width, width) : table;
	if (from > table || to > table || to < from + HEAD || get_bytes(a->bytes + from, 2) != MAGIC ||
	    get_bytes(a->bytes + from + 2, 2) != version)
		return file_error(s, "the table of meshes at its end is damaged");
	*begin = (size_t)from;
	*end = (size_t)to;
	return 0;
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct asset a;
	int r = mesh_open(n, assets, &a, e);
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
		s.most = (uint64_t)size * ZLIB_RATIO;
		r = take_mesh(&s, (int)get_bytes(a.bytes + begin + 2, 2), arena, out);
		inflateEnd(&s.z);
	}
	assets->close(assets->user, &a);
	return r;
}

SHAPE_OPS(serialized, {"filename", UNDERSTOOD(VALUE_STRING)},
	  {"shape_index", VALUE_INT, PARAM_UNDERSTOOD, 0, 1 << 24, NULL}, {"face_normals", UNDERSTOOD(VALUE_BOOL)},
	  {"collapse", IGNORED}, MESH_SMOOTH_PARAM, SHAPE_PARAMS);
