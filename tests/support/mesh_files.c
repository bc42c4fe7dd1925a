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

static void append(struct mesh_file *f, const void *bytes, size_t size)
{
	assert(f->size + size <= sizeof f->bytes);
	memcpy(f->bytes + f->size, bytes, size);
	f->size += size;
}

__attribute__((format(printf, 2, 3))) static void say(struct mesh_file *f, const char *format, ...)
{
	char text[1024];
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(text, sizeof text, format, ap);
	va_end(ap);
	append(f, text, (size_t)n);
}

static void put_bits(struct mesh_file *f, uint64_t bits, int size, int big)
{
	unsigned char raw[8];
	for (int i = 0; i < size; i++)
		raw[big ? size - 1 - i : i] = (unsigned char)(bits >> 8 * i);
	append(f, raw, (size_t)size);
}

static void put_real(struct mesh_file *f, double x, int doubles, int big)
{
	uint64_t bits;
	uint32_t low;
	float narrow = (float)x;
	memcpy(&bits, &x, sizeof bits);
	memcpy(&low, &narrow, sizeof low);
	put_bits(f, doubles ? bits : low, doubles ? 8 : 4, big);
}

static void put_vertex(struct mesh_file *f, enum ply_kind kind, int i)
{
	const double *p = solid_position[i], *uv = solid_uv[i];
	if (kind == PLY_ASCII) {
		say(f, "%g %g %g 255 %g %g %g\n%g %g\n", p[0], p[1], p[2], 3 * p[0], 3 * p[1], 3 * p[2], uv[0], uv[1]);
		return;
	}
	int big = kind == PLY_BIG;
	for (int k = 0; k < 3; k++)
		put_real(f, p[k], 0, big);
	put_bits(f, 255, 1, big);
	for (int k = 0; k < 3; k++)
		put_real(f, 3 * p[k], 1, big);
	for (int k = 0; k < 2; k++)
		put_real(f, uv[k], 0, big);
}

void mesh_file_ply(struct mesh_file *f, enum ply_kind kind)
{
	static const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
	f->size = 0;
	say(f,
	    "ply\nformat %s 1.0\ncomment by a test\nelement vertex 6\nproperty float x\nproperty float y\nproperty float32 z\n"
	    "property uchar red\nproperty double nx\nproperty double ny\nproperty float64 nz\nproperty float s\n"
	    "property float t\nelement edge 2\nproperty list uchar short ends\nelement face 8\n"
	    "property int material\nproperty list uchar uint vertex_indices\nend_header\n",
	    formats[kind]);
	for (int i = 0; i < SOLID_VERTICES; i++)
		put_vertex(f, kind, i);
	int big = kind == PLY_BIG;
	for (int i = 0; i < 2; i++) {
		if (kind == PLY_ASCII) {
			say(f, "%d%s\n", 2 * i, i ? " -1 1" : "");
			continue;
		}
		put_bits(f, (uint64_t)(2 * i), 1, big);
		for (int k = 0; k < 2 * i; k++)
			put_bits(f, 1, 2, big);
	}
	for (int i = 0; i < SOLID_TRIANGLES; i++) {
		const uint32_t *t = solid_index[i];
		if (kind == PLY_ASCII) {
			say(f, "%d 3 %u %u %u\n", i, t[0], t[1], t[2]);
			continue;
		}
		put_bits(f, (uint64_t)i, 4, big);
		put_bits(f, 3, 1, big);
		for (int k = 0; k < 3; k++)
			put_bits(f, t[k], 4, big);
	}
}

static void put_compressed(struct mesh_file *f, const struct mesh_file *from)
{
	uLongf size = sizeof f->bytes - f->size;
	int code = compress(f->bytes + f->size, &size, from->bytes, from->size);
	assert(code == Z_OK);
	f->size += size;
}

static void put_text(struct mesh_file *f, const char *text)
{
	put_bits(f, strlen(text), 4, 0);
	append(f, text, strlen(text));
}

/* Flags are those of version 4. Both maps exist, and after the colours there are an attribute of the triangles and
 * one that a spectral variant writes. */
void mesh_stream_5(struct mesh_file *f, uint32_t flags, int scale)
{
	f->size = 0;
	put_bits(f, (flags & 1) | (flags & 2) << 1 | (flags & 16) | 0x1000, 4, 0);
	put_text(f, "a solid");
	put_bits(f, SOLID_VERTICES, 8, 0);
	put_bits(f, SOLID_TRIANGLES, 8, 0);
	put_bits(f, SOLID_VERTICES, 8, 0);
	put_bits(f, 1, 8, 0);
	for (int i = 0; i < SOLID_VERTICES; i++) {
		for (int c = 0; c < 3; c++)
			put_real(f, scale * solid_position[i][c], 0, 0);
		for (int c = 0; c < 3; c++)
			put_real(f, flags & 1 ? 5 * solid_position[i][c] : 0, 0, 0);
		for (int c = 0; c < 2; c++)
			put_real(f, flags & 2 ? solid_uv[i][c] : 0, 0, 0);
	}
	for (int i = 0; i < SOLID_TRIANGLES; i++)
		for (int c = 0; c < 4; c++)
			put_bits(f, c < 3 ? solid_index[i][c] : 0, 4, 0);
	for (int i = 0; i < SOLID_VERTICES; i++)
		put_bits(f, (uint64_t)i, 4, 0);
	for (int i = 0; i < SOLID_VERTICES; i++)
		put_bits(f, 0, 4, 0);
	put_bits(f, flags & 8 ? 3 : 0, 4, 0);
	if (!(flags & 8))
		return;
	put_text(f, "vertex_color");
	put_bits(f, 0, 1, 0);
	put_bits(f, 3, 4, 0);
	for (int i = 0; i < 3 * SOLID_VERTICES; i++)
		put_real(f, SOLID_COLOUR(i), 0, 0);
	put_text(f, "vertex_spectral");
	put_bits(f, 1, 1, 0);
	put_bits(f, 3, 4, 0);
	for (int i = 0; i < 3 * SOLID_VERTICES; i++)
		put_real(f, 1, 0, 0);
	put_text(f, "face_heat");
	put_bits(f, 0, 1, 0);
	put_bits(f, 1, 4, 0);
	for (int i = 0; i < SOLID_TRIANGLES; i++)
		put_real(f, SOLID_COLOUR(i), 0, 0);
}

void mesh_file_serialized(struct mesh_file *f, int version, int doubles, uint32_t flags, int meshes)
{
	static struct mesh_file one;
	uint64_t offset[16];
	f->size = 0;
	for (int k = 0; k < meshes; k++) {
		offset[k] = f->size;
		put_bits(f, 0x041c, 2, 0);
		put_bits(f, (uint64_t)version, 2, 0);
		one.size = 0;
		if (version == 5) {
			mesh_stream_5(&one, flags, k + 1);
			put_compressed(f, &one);
			continue;
		}
		put_bits(&one, flags | (doubles ? 0x2000 : 0x1000), 4, 0);
		if (version == 4)
			append(&one, "a solid", sizeof "a solid");
		put_bits(&one, SOLID_VERTICES, 8, 0);
		put_bits(&one, SOLID_TRIANGLES, 8, 0);
		for (int i = 0; i < SOLID_VERTICES; i++)
			for (int c = 0; c < 3; c++)
				put_real(&one, (k + 1) * solid_position[i][c], doubles, 0);
		for (int i = 0; i < SOLID_VERTICES && (flags & 1); i++)
			for (int c = 0; c < 3; c++)
				put_real(&one, 5 * solid_position[i][c], doubles, 0);
		for (int i = 0; i < SOLID_VERTICES && (flags & 2); i++)
			for (int c = 0; c < 2; c++)
				put_real(&one, solid_uv[i][c], doubles, 0);
		for (int i = 0; i < SOLID_VERTICES && (flags & 8); i++)
			for (int c = 0; c < 3; c++)
				put_real(&one, SOLID_COLOUR(3 * i + c), doubles, 0);
		for (int i = 0; i < SOLID_TRIANGLES; i++)
			for (int c = 0; c < 3; c++)
				put_bits(&one, solid_index[i][c], 4, 0);
		put_compressed(f, &one);
	}
	for (int k = 0; k < meshes; k++)
		put_bits(f, offset[k], version == 3 ? 4 : 8, 0);
	put_bits(f, (uint64_t)meshes, 4, 0);
}

void mesh_file_of_stream_5(struct mesh_file *f, const struct mesh_file *stream)
{
	f->size = 0;
	put_bits(f, 0x041c, 2, 0);
	put_bits(f, 5, 2, 0);
	put_compressed(f, stream);
	put_bits(f, 0, 8, 0);
	put_bits(f, 1, 4, 0);
}
