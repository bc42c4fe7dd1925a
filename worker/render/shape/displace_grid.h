/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numbers the points that result from cutting each edge of a mesh into `parts_per_edge`. A vertex is shared by the
 * triangles that share the vertex or the edge in the base mesh; a place is shared by all vertices at one position, even
 * if their normals differ. Points inside a triangle are vertices without a place. One thread.
 */
#ifndef WORKER_RENDER_SHAPE_DISPLACE_GRID_H
#define WORKER_RENDER_SHAPE_DISPLACE_GRID_H

#include "common/base/arena.h"
#include "worker/render/shape/shape.h"

struct displace_side {
	uint32_t vertex_edge, place_edge; /* number of the edge among those of vertices, and of places */
	bool is_reversed;		  /* the edge runs from the end of the side to its start */
};

struct displace_grid {
	uint32_t parts_per_edge, base_vertex_count, base_place_count;
	uint32_t vertex_edge_count, place_edge_count;
	uint32_t *place;	    /* place of each base vertex */
	struct displace_side *side; /* 3 per triangle, side k from corner k to the next; NULL if parts_per_edge is 1 */
	const uint32_t (*index)[3]; /* of the base mesh */
	uint64_t border_vertex_count; /* vertices below this number have a place, the others do not */
	uint64_t vertex_count, place_count;
};

struct displace_point {
	uint32_t vertex, place;
	bool is_interior; /* inside a triangle: no place */
};

/* Initialises g. parts is at most 2^13, triangles * parts^2 at most MESH_TRIANGLES_MAX. Returns false if out of
 * memory. */
bool displace_grid_init(struct displace_grid *g, const struct mesh *base, uint32_t parts, struct arena *arena);

/* Returns the point with the barycentric coordinates (i, j) / parts in a triangle of the base mesh. */
struct displace_point displace_grid_point(const struct displace_grid *g, uint32_t triangle, uint32_t i, uint32_t j);

#endif
