/* SPDX-License-Identifier: Apache-2.0 */
/* Mesh files made in memory, for tests of the readers of meshes. */
#ifndef TESTS_SUPPORT_MESH_FILES_H
#define TESTS_SUPPORT_MESH_FILES_H

#include <stddef.h>
#include <stdint.h>

/* An octahedron: six vertices with normals and texture coordinates, and eight triangles that face outwards. */
enum { SOLID_VERTICES = 6, SOLID_TRIANGLES = 8 };
extern const double solid_position[SOLID_VERTICES][3], solid_uv[SOLID_VERTICES][2];
extern const uint32_t solid_index[SOLID_TRIANGLES][3];

/* The k-th number of the colours in serialized files, three per vertex: exact in float. */
#define SOLID_COLOUR(k) ((k) / 32.0)

struct mesh_file {
	unsigned char bytes[1 << 16];
	size_t size;
};

enum ply_kind { PLY_ASCII, PLY_LITTLE, PLY_BIG, PLY_KINDS };

/* Makes a PLY file with float positions and double normals, and with colours and an element `edge` in between that
 * have no meaning. */
void mesh_file_make_ply(struct mesh_file *f, enum ply_kind kind);
/* Makes a file of `meshes` octahedra, the k-th scaled by k + 1. */
void mesh_file_make_serialized(struct mesh_file *f, int version, int doubles, uint32_t flags, int meshes);
/* mesh_file_make_stream_5() makes the contents of a mesh of version 5, mesh_file_from_stream_5() a file with it. Flags
 * are those of version 4. Both maps exist, and after the colours there are an attribute of the triangles and one that a
 * spectral variant writes. */
void mesh_file_make_stream_5(struct mesh_file *f, uint32_t flags, int scale);
void mesh_file_from_stream_5(struct mesh_file *f, const struct mesh_file *stream);

#endif
