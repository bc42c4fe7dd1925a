/* SPDX-License-Identifier: Apache-2.0 */
/* Files of meshes, made in memory: what readers of meshes are tested with. */
#ifndef TESTS_SUPPORT_MESH_FILES_H
#define TESTS_SUPPORT_MESH_FILES_H

#include <stddef.h>
#include <stdint.h>

/* An octahedron's six vertices with normals and texture coordinates, and eight triangles that face outwards. */
enum { SOLID_VERTICES = 6, SOLID_TRIANGLES = 8 };
extern const double solid_position[SOLID_VERTICES][3], solid_uv[SOLID_VERTICES][2];
extern const uint32_t solid_index[SOLID_TRIANGLES][3];

/* Number k of the colours that serialized files have, three a vertex: exact in float. */
#define SOLID_COLOUR(k) ((k) / 32.0)

struct mesh_file {
	unsigned char bytes[1 << 16];
	size_t size;
};

enum ply_kind { PLY_ASCII, PLY_LITTLE, PLY_BIG, PLY_KINDS };

/* As PLY: floats for positions, doubles for normals, colours and an element `edge` in between that mean nothing. */
void mesh_file_ply(struct mesh_file *f, enum ply_kind kind);
/* `meshes` octahedra in one file, the k-th scaled by k + 1. */
void mesh_file_serialized(struct mesh_file *f, int version, int doubles, uint32_t flags, int meshes);
/* What a mesh of version 5 has inside, and the file of one. Flags are those of version 4. Both maps are there, and
 * behind the colours an attribute of the triangles, and one that a spectral variant wrote. */
void mesh_stream_5(struct mesh_file *f, uint32_t flags, int scale);
void mesh_file_of_stream_5(struct mesh_file *f, const struct mesh_file *stream);

#endif
