/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The points that result from cutting each edge of a mesh into `parts`, and who shares them. A vertex is shared by
 * triangles that share it in the base mesh (or its edge); a place is shared by everything at that position, whatever
 * the normals. Points inside a triangle are vertices without a place. One thread.
 */
#ifndef WORKER_RENDER_SHAPE_DISPLACE_GRID_H
#define WORKER_RENDER_SHAPE_DISPLACE_GRID_H

#include "common/base/arena.h"
#include "worker/render/shape/shape.h"

struct displace_side {
	uint32_t vertices, places; /* the edge's number among those of vertices, and of places */
	bool backwards;		   /* the edge runs from the side's end to its start */
};

struct displace_grid {
	uint32_t parts, base_vertices, base_places;
	uint32_t vertex_edges, place_edges;
	uint32_t *place;	    /* of each base vertex */
	struct displace_side *side; /* 3 per triangle, from corner k to the next; NULL if parts is 1 */
	const uint32_t (*index)[3]; /* of the base mesh */
	uint64_t border;	    /* only vertices below this have a place */
	uint64_t vertices, places;
};

struct displace_point {
	uint32_t vertex, place;
	bool inside; /* no place */
};

/* false: out of memory. parts is at most 2^13, triangles * parts^2 at most MESH_TRIANGLES_MAX. */
bool displace_grid_init(struct displace_grid *g, const struct mesh *base, uint32_t parts, struct arena *arena);

/* The point with barycentrics (i, j) / parts in a triangle of the base mesh. */
struct displace_point displace_grid_at(const struct displace_grid *g, uint32_t triangle, uint32_t i, uint32_t j);

#endif
