/* SPDX-License-Identifier: Apache-2.0 */
/* Scenes of the benchmarks. Any failure ends the bench with the reader's sentence. */
#ifndef TESTS_BENCH_SCENES_H
#define TESTS_BENCH_SCENES_H

#include "worker/render/render.h"

/* A room of walls, a hilly floor (diffuse) and a dented ball (rough gold) of half a million triangles each, two lamps.
 */
struct world *bench_world_million(void);
/* The same as files: FOLDER/million.xml and its meshes. */
void bench_write_million(const char *folder);
void bench_write_file(const char *folder, const char *name, const void *bytes, size_t size);
/* Binary PLY of a wavy square of cells x cells x 2 triangles with normals and texture coordinates, as exporters write
 * them. The caller's mem_free. */
struct bench_file {
	unsigned char *bytes;
	size_t size;
};
struct bench_file bench_wavy_ply(uint32_t cells);
/* `cornell-box` from the folder that HSLT_SCENES names, else the box of tests/scenes. */
struct world *bench_world_box(const char **name);
/* Folder and file of that scene. */
const char *bench_box_file(void);
/* shipped: a scene of the project. Else one of the folder that HSLT_SCENES names; NULL: it is not set, or there is no
 * such file. o may be NULL. */
struct world *bench_world(const char *path, bool shipped, const struct render_options *o);
/* tests/scenes/displaced with a million triangles. */
struct world *bench_world_displaced(void);
/* That file of the assets. o may be NULL. */
struct world *bench_world_of(const struct asset_source *assets, const char *file, const struct render_options *o);

#endif
