/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The contents of a Wavefront OBJ file: v (with colours), vt, vn, f, g and usemtl. Everything else (objects, lines) is
 * skipped. Indices are checked when they are read, so that errors can name the line. One thread.
 */
#ifndef WORKER_RENDER_SHAPE_OBJ_READ_H
#define WORKER_RENDER_SHAPE_OBJ_READ_H

#include "common/base/list.h"
#include "worker/render/shape/mesh.h"

struct obj_corner {
	uint32_t v, vt, vn; /* indices, from 1; 0: none */
	uint32_t index;	    /* position in the list of corners */
};

/* The beginning of a run of faces with one material, which ends where the next run begins. */
struct obj_run {
	size_t name_offset, name_length;     /* of the material, in `names` */
	size_t first_corner, first_triangle; /* the first ones of the run */
};

/* The beginning of a mesh, which ends where the next one begins: the faces between two lines with `g` or `usemtl`,
 * which therefore have one material. `o` does not begin a mesh, as in Mitsuba 0.6. */
struct obj_mesh {
	size_t run;			     /* index in `runs` */
	size_t first_corner, first_triangle; /* the first ones of the mesh */
};

struct obj_file {
	struct list positions, uvs, normals; /* double[3], double[2], double[3] */
	struct list colours;		     /* double[3], linear; of all positions, or only of some */
	struct list corners;		     /* struct obj_corner, one for each corner of each polygon */
	struct list triangles;		     /* uint32_t[3] into corners */
	struct list runs;		     /* struct obj_run, at least one; the first may have no name */
	struct list names;		     /* char */
	struct list meshes;		     /* struct obj_mesh, each with faces */
};

/* The file read last. It is kept if a shape took only a part of it, because the next shape usually takes another. */
struct obj_cache {
	char *name; /* NULL: the cache is empty */
	struct obj_file file;
};
/* Reads the file that the node names into c->file, unless it is there already. It is kept until another file is
 * requested or obj_cache_fini is called. Returns 0 or a negative error code. */
int obj_cache_read(struct obj_cache *c, const struct scene_node *n, const struct asset_source *assets, struct error *e);
void obj_cache_fini(struct obj_cache *c);

#endif
