/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The materials of Wavefront .mtl files, as the scene elements that Mitsuba 0.6 makes from them: `illum` selects a
 * diffuse, phong, dielectric or conductor BSDF, inside a bumpmap and a mask if the material has them. One thread;
 * everything is allocated in the given arena.
 */
#ifndef WORKER_RENDER_SCENE_MTL_H
#define WORKER_RENDER_SCENE_MTL_H

#include "common/base/arena.h"
#include "worker/render/asset/asset.h"
#include "worker/render/xml/element.h"

struct mtl_value {
	int line;	  /* line in the .mtl file; 0: not given */
	const char *text; /* as written; for a file, its name relative to the scene's folder */
};

struct mtl_material {
	const char *name;
	int line;
	struct mtl_value diffuse, specular, exponent, model, opacity;
	struct mtl_value diffuse_map, specular_map, opacity_map, bump;
	const struct mtl_material *previous;
};

struct mtl {
	const char *file;
	bool file_exists; /* the file can be opened */
	const struct mtl_material *last_material;
	struct mtl_value unsupported; /* the first keyword that would change the image but is not supported */
};

enum { MTL_MATERIALS_MAX = 4096 };

/* Reads a file. `file` is a canonical name (asset_name.h). A file that cannot be opened has no materials. Returns 0,
 * -E2BIG or -ENOMEM. */
int mtl_read(struct mtl *m, const struct asset_source *assets, const char *file, struct arena *arena, struct error *e);

/* Returns the last material of that name, or NULL. */
const struct mtl_material *mtl_find(const struct mtl *m, const char *name);

/* Adds the material's <bsdf> to `shape`. Returns the number of elements made, or -ENOMEM. */
int mtl_add_bsdf(const struct mtl *m, const struct mtl_material *material, struct xml_element *shape,
		 struct arena *arena);

/* Returns the canonical name of `name` in the folder of `beside`. If `name` has folders and there is no such file,
 * the folders are dropped. NULL if out of memory. */
const char *mtl_resolve_file(const struct asset_source *assets, const char *beside, const char *name, size_t length,
			     struct arena *arena);

#endif
