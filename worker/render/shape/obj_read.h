/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The contents of a Wavefront OBJ file: v (with colours), vt, vn, f and usemtl. Everything else (groups, lines) is
 * skipped. Each index is checked where it is read, so that an error has a line. One thread.
 */
#ifndef WORKER_RENDER_SHAPE_OBJ_READ_H
#define WORKER_RENDER_SHAPE_OBJ_READ_H

#include "common/base/list.h"
#include "worker/render/shape/mesh.h"

struct obj_corner {
	uint32_t v, vt, vn; /* from 1; 0: none */
	uint32_t at;	    /* index into the list of corners */
};

/* The faces from this one to the next run have one material. */
struct obj_run {
	size_t name, name_length; /* in `names` */
	size_t corner, triangle;
};

struct obj_file {
	struct list positions, uvs, normals; /* double[3], double[2], double[3] */
	struct list colours;		     /* double[3], linear: of the positions, or of a part of them */
	struct list corners;		     /* struct obj_corner, one for each corner of each polygon */
	struct list triangles;		     /* uint32_t[3] into corners */
	struct list runs;		     /* struct obj_run; the first, without a name, is always there */
	struct list names;		     /* char */
};

/* The file read last, kept if a shape took one material of it, because the next shape usually takes another. */
struct obj_cache {
	char *name; /* NULL: nothing is kept */
	struct obj_file file;
};
/* The file that the node names, kept in c until another one is requested. */
int obj_cache_read(struct obj_cache *c, const struct scene_node *n, const struct asset_source *assets, struct error *e);
void obj_cache_fini(struct obj_cache *c);

#endif
