/* SPDX-License-Identifier: Apache-2.0 */
/* Scenes of the benchmarks. If one cannot be loaded, the bench ends with the reader's error. */
#ifndef TESTS_BENCH_SCENES_H
#define TESTS_BENCH_SCENES_H

#include "worker/render/render.h"

/* Returns a room with walls, a hilly floor (diffuse) and a dented ball (rough gold) of half a million triangles each,
 * and two lamps. */
struct world *bench_world_million(void);
/* Writes the same scene as files: FOLDER/million.xml and its meshes. */
void bench_write_million(const char *folder);
void bench_write_file(const char *folder, const char *name, const void *bytes, size_t size);
/* Binary PLY of a wavy square of cells x cells x 2 triangles with normals and texture coordinates, as exporters write
 * it. The caller frees it with mem_free. */
struct bench_file {
	unsigned char *bytes;
	size_t size;
};
struct bench_file bench_make_wavy_ply(uint32_t cells);
/* Returns `cornell-box` from the folder that HSLT_SCENES names, else the box of tests/scenes. */
struct world *bench_world_box(const char **name);
/* Returns folder and file of that scene. */
const char *bench_box_path(void);
/* Returns a scene of the project if `shipped`, else of the folder that HSLT_SCENES names; NULL: HSLT_SCENES is not set,
 * or there is no such file. o may be NULL. */
struct world *bench_world(const char *path, bool shipped, const struct render_options *o);
/* Returns tests/scenes/displaced with a million triangles. */
struct world *bench_world_displaced(void);
/* Returns the world of one file among the assets. o may be NULL. */
struct world *bench_world_from_assets(const struct asset_source *assets, const char *file,
				      const struct render_options *o);

#endif
