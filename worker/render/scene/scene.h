/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The scene description: Mitsuba's XML (0.5/0.6 and 3.x dialects) or glTF 2.0 as a tree of typed, checked nodes,
 * without any physics (docs/design.md, rules 5). The whole description is in one arena.
 */
#ifndef WORKER_RENDER_SCENE_SCENE_H
#define WORKER_RENDER_SCENE_SCENE_H

#include "common/base/arena.h"
#include "common/base/error.h"
#include "worker/render/asset/asset.h"
#include "worker/render/xml/define.h"
#include "worker/render/scene/node.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct scene {
	struct arena arena;
	const char *file;     /* as it was opened */
	bool is_dialect_3;    /* version >= 2: Mitsuba 3 rules */
	bool has_black_backs; /* backs of opaque one-sided materials are black; the setting `backs` overrides it */
	bool lacks_media;     /* Mitsuba's image has no media; the setting `media` overrides it */
	uint32_t object_count;
	const struct scene_node *const *objects; /* top-level objects, in file order */
	uint32_t asset_count;
	const char *const *assets; /* names of all files that the description refers to, each once, without the scene
				      file itself */
	const char *const *asset_places; /* "scene.xml:12: <shape type=\"obj\">", the first place naming it; or "" */
	uint32_t problem_count;		 /* 0 except after scene_read_all */
	const char *const *problems;	 /* "scene.xml:12: <bsdf>: ...", in file order */
	uint32_t flawed_count;
	const struct scene_node *const *flawed; /* the nodes with is_flawed, at any depth */
	uint32_t note_count;
	const char *const *notes; /* "scene.xml:12: ignored ...", each once, for the log */
};

/* Reads the scene file `name` through `assets`. decls ends with a NULL type. On failure the error names file, line
 * and element, and *s is empty. One thread; allocates only in the scene's arena. */
int scene_read(struct scene *s, const struct asset_source *assets, const char *name, const struct plugin_decl *decls,
	       const struct scene_define *defines, size_t define_count, struct error *e);
void scene_fini(struct scene *s);

/* Like scene_read(), but what is not supported is left out or replaced (lenient.h), with a note each. */
int scene_read_lenient(struct scene *s, const struct asset_source *assets, const char *name,
		       const struct plugin_decl *decls, const struct scene_define *defines, size_t define_count,
		       struct error *e);

/* Returns code, the failure of building a scene that was read. If it is -ENOENT, for a missing file, adds to *e how
 * many others cannot be opened either. */
int scene_append_missing_count(const struct scene *s, const struct asset_source *assets, int code, struct error *e);

/* Like scene_read(), or with `lenient` like scene_read_lenient(), but errors in the scene are not a failure: it is
 * read as far as possible, and s->problems lists them all. If there are any, the scene must not be rendered. Returns 0
 * or -ENOMEM. */
int scene_read_all(struct scene *s, const struct asset_source *assets, const char *name,
		   const struct plugin_decl *decls, const struct scene_define *defines, size_t define_count,
		   bool lenient, struct error *e);

#endif
