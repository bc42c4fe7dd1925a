/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Writers of PLY (text, both byte orders) and of Mitsuba's serialized format (versions 3 to 5), which put one value
 * after the other into a fixed buffer and share no code with the readers under test.
 */
#include "tests/support/mesh_files.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <zlib.h>

const double solid_position[SOLID_VERTICES][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
const double solid_uv[SOLID_VERTICES][2] = {{0, 0}, {0.25, 0.5}, {0.5, 1}, {0.75, 0.125}, {1, 0.25}, {-2, 3}};
const uint32_t solid_index[SOLID_TRIANGLES][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
						  {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};

static void append_bytes(struct mesh_file *f, const void *bytes, size_t size)
{
	assert(f->size + size <= sizeof f->bytes);
	memcpy(f->bytes + f->size, bytes, size);
	f->size += size;
}

__attribute__((format(printf, 2, 3))) static void append_printf(struct mesh_file *f, const char *format, ...)
{
	char text[1024];
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(text, sizeof text, format, ap);
	va_end(ap);
	append_bytes(f, text, (size_t)n);
}

static void append_bits(struct mesh_file *f, uint64_t bits, int size, int big)
{
	unsigned char raw[8];
	for (int i = 0; i < size; i++)
		raw[big ? size - 1 - i : i] = (unsigned char)(bits >> 8 * i);
	append_bytes(f, raw, (size_t)size);
}

static void append_real(struct mesh_file *f, double x, int doubles, int big)
{
	uint64_t bits;
	uint32_t low;
	float narrow = (float)x;
	memcpy(&bits, &x, sizeof bits);
	memcpy(&low, &narrow, sizeof low);
	append_bits(f, doubles ? bits : low, doubles ? 8 : 4, big);
}

static void append_ply_vertex(struct mesh_file *f, enum ply_kind kind, int i)
{
	const double *p = solid_position[i], *uv = solid_uv[i];
	if (kind == PLY_ASCII) {
		append_printf(f, "%g %g %g 255 %g %g %g\n%g %g\n", p[0], p[1], p[2], 3 * p[0], 3 * p[1], 3 * p[2],
			      uv[0], uv[1]);
		return;
	}
	int big = kind == PLY_BIG;
	for (int k = 0; k < 3; k++)
		append_real(f, p[k], 0, big);
	append_bits(f, 255, 1, big);
	for (int k = 0; k < 3; k++)
		append_real(f, 3 * p[k], 1, big);
	for (int k = 0; k < 2; k++)
		append_real(f, uv[k], 0, big);
}

void mesh_file_make_ply(struct mesh_file *f, enum ply_kind kind)
{
	static const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
	f->size = 0;
	append_printf(
		f,
		"ply\nformat %s 1.0\ncomment by a test\nelement vertex 6\nproperty float x\nproperty float y\nproperty float32 z\n"
		"property uchar red\nproperty double nx\nproperty double ny\nproperty float64 nz\nproperty float s\n"
		"property float t\nelement edge 2\nproperty list uchar short ends\nelement face 8\n"
		"property int material\nproperty list uchar uint vertex_indices\nend_header\n",
		formats[kind]);
	for (int i = 0; i < SOLID_VERTICES; i++)
		append_ply_vertex(f, kind, i);
	int big = kind == PLY_BIG;
	for (int i = 0; i < 2; i++) {
		if (kind == PLY_ASCII) {
			append_printf(f, "%d%s\n", 2 * i, i ? " -1 1" : "");
			continue;
		}
		append_bits(f, (uint64_t)(2 * i), 1, big);
		for (int k = 0; k < 2 * i; k++)
			append_bits(f, 1, 2, big);
	}
	for (int i = 0; i < SOLID_TRIANGLES; i++) {
		const uint32_t *t = solid_index[i];
		if (kind == PLY_ASCII) {
			append_printf(f, "%d 3 %u %u %u\n", i, t[0], t[1], t[2]);
			continue;
		}
		append_bits(f, (uint64_t)i, 4, big);
		append_bits(f, 3, 1, big);
		for (int k = 0; k < 3; k++)
			append_bits(f, t[k], 4, big);
	}
}

static void append_compressed(struct mesh_file *f, const struct mesh_file *from)
{
	uLongf size = sizeof f->bytes - f->size;
	int code = compress(f->bytes + f->size, &size, from->bytes, from->size);
	assert(code == Z_OK);
	f->size += size;
}

static void append_string(struct mesh_file *f, const char *text)
{
	append_bits(f, strlen(text), 4, 0);
	append_bytes(f, text, strlen(text));
}

/* Flags are those of version 4. Both maps exist, and after the colours there are an attribute of the triangles and
 * one that a spectral variant writes. */
void mesh_file_make_stream_5(struct mesh_file *f, uint32_t flags, int scale)
{
	f->size = 0;
	append_bits(f, (flags & 1) | (flags & 2) << 1 | (flags & 16) | 0x1000, 4, 0);
	append_string(f, "a solid");
	append_bits(f, SOLID_VERTICES, 8, 0);
	append_bits(f, SOLID_TRIANGLES, 8, 0);
	append_bits(f, SOLID_VERTICES, 8, 0);
	append_bits(f, 1, 8, 0);
	for (int i = 0; i < SOLID_VERTICES; i++) {
		for (int c = 0; c < 3; c++)
			append_real(f, scale * solid_position[i][c], 0, 0);
		for (int c = 0; c < 3; c++)
			append_real(f, flags & 1 ? 5 * solid_position[i][c] : 0, 0, 0);
		for (int c = 0; c < 2; c++)
			append_real(f, flags & 2 ? solid_uv[i][c] : 0, 0, 0);
	}
	for (int i = 0; i < SOLID_TRIANGLES; i++)
		for (int c = 0; c < 4; c++)
			append_bits(f, c < 3 ? solid_index[i][c] : 0, 4, 0);
	for (int i = 0; i < SOLID_VERTICES; i++)
		append_bits(f, (uint64_t)i, 4, 0);
	for (int i = 0; i < SOLID_VERTICES; i++)
		append_bits(f, 0, 4, 0);
	append_bits(f, flags & 8 ? 3 : 0, 4, 0);
	if (!(flags & 8))
		return;
	append_string(f, "vertex_color");
	append_bits(f, 0, 1, 0);
	append_bits(f, 3, 4, 0);
	for (int i = 0; i < 3 * SOLID_VERTICES; i++)
		append_real(f, SOLID_COLOUR(i), 0, 0);
	append_string(f, "vertex_spectral");
	append_bits(f, 1, 1, 0);
	append_bits(f, 3, 4, 0);
	for (int i = 0; i < 3 * SOLID_VERTICES; i++)
		append_real(f, 1, 0, 0);
	append_string(f, "face_heat");
	append_bits(f, 0, 1, 0);
	append_bits(f, 1, 4, 0);
	for (int i = 0; i < SOLID_TRIANGLES; i++)
		append_real(f, SOLID_COLOUR(i), 0, 0);
}

void mesh_file_make_serialized(struct mesh_file *f, int version, int doubles, uint32_t flags, int meshes)
{
	static struct mesh_file mesh;
	uint64_t offset[16];
	f->size = 0;
	for (int k = 0; k < meshes; k++) {
		offset[k] = f->size;
		append_bits(f, 0x041c, 2, 0);
		append_bits(f, (uint64_t)version, 2, 0);
		mesh.size = 0;
		if (version == 5) {
			mesh_file_make_stream_5(&mesh, flags, k + 1);
			append_compressed(f, &mesh);
			continue;
		}
		append_bits(&mesh, flags | (doubles ? 0x2000 : 0x1000), 4, 0);
		if (version == 4)
			append_bytes(&mesh, "a solid", sizeof "a solid");
		append_bits(&mesh, SOLID_VERTICES, 8, 0);
		append_bits(&mesh, SOLID_TRIANGLES, 8, 0);
		for (int i = 0; i < SOLID_VERTICES; i++)
			for (int c = 0; c < 3; c++)
				append_real(&mesh, (k + 1) * solid_position[i][c], doubles, 0);
		for (int i = 0; i < SOLID_VERTICES && (flags & 1); i++)
			for (int c = 0; c < 3; c++)
				append_real(&mesh, 5 * solid_position[i][c], doubles, 0);
		for (int i = 0; i < SOLID_VERTICES && (flags & 2); i++)
			for (int c = 0; c < 2; c++)
				append_real(&mesh, solid_uv[i][c], doubles, 0);
		for (int i = 0; i < SOLID_VERTICES && (flags & 8); i++)
			for (int c = 0; c < 3; c++)
				append_real(&mesh, SOLID_COLOUR(3 * i + c), doubles, 0);
		for (int i = 0; i < SOLID_TRIANGLES; i++)
			for (int c = 0; c < 3; c++)
				append_bits(&mesh, solid_index[i][c], 4, 0);
		append_compressed(f, &mesh);
	}
	for (int k = 0; k < meshes; k++)
		append_bits(f, offset[k], version == 3 ? 4 : 8, 0);
	append_bits(f, (uint64_t)meshes, 4, 0);
}

void mesh_file_from_stream_5(struct mesh_file *f, const struct mesh_file *stream)
{
	f->size = 0;
	append_bits(f, 0x041c, 2, 0);
	append_bits(f, 5, 2, 0);
	append_compressed(f, stream);
	append_bits(f, 0, 8, 0);
	append_bits(f, 1, 4, 0);
}
