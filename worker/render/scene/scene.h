/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The scene description: Mitsuba's XML (0.5/0.6 and 3.x dialects) or glTF 2.0 as a tree of typed, checked nodes. Knows
 * no physics. docs/design.md, rules 5. The whole description lives in one arena.
 */
#ifndef WORKER_RENDER_SCENE_SCENE_H
#define WORKER_RENDER_SCENE_SCENE_H

#include "common/base/arena.h"
#include "common/base/error.h"
#include "worker/render/math/mat4.h"
#include "worker/render/scene/asset.h"
#include "worker/render/scene/param.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct scene_node;

struct value {
	enum value_type type;
	union {
		bool boolean;
		int64_t integer;
		double number;
		const char *string;
		vec3 point;
		double rgb[3]; /* linear Rec. 709 */
		struct {
			uint32_t count; /* 1: a constant (nm unused) */
			const double *nm, *value;
		} spectrum;
		mat4 transform;
		const struct scene_node *node;
	} as;
};

struct property {
	const char *name; /* 3.x spelling */
	int line;
	struct value value;
};

struct scene_node {
	enum plugin_class cls;
	const char *type; /* "roughconductor" */
	const char *id;	  /* NULL when it has none */
	const char *file; /* as the user named it */
	int line;
	const struct plugin_decl *decl;
	uint32_t property_count, child_count;
	const struct property *properties;
	const struct scene_node *const *children; /* nested objects without a name */
};

struct scene {
	struct arena arena;
	bool dialect_3; /* version >= 2: Mitsuba 3 rules */
	uint32_t object_count;
	const struct scene_node *const *objects; /* top level, in file order */
	uint32_t asset_count;
	const char *const
		*assets; /* names of all files that the description refers to, without the scene file, each once */
	uint32_t problem_count; /* 0 but after scene_read_all */
	const char *const
		*problems; /* "scene.xml:12: <bsdf>: ..." all that is wrong or not supported, in the file's order */
	uint32_t note_count;
	const char *const *notes; /* "scene.xml:12: ignored ..." once each, for the log */
};

struct scene_define {
	const char *name, *value; /* -D name=value */
};

/* Reads `name` through `assets`. decls ends with a NULL type. On failure the error names file, line and element and
 * *s is empty. One thread; allocates in the scene's arena only. */
int scene_read(struct scene *s, const struct asset_source *assets, const char *name, const struct plugin_decl *decls,
	       const struct scene_define *defines, size_t define_count, struct error *e);
void scene_fini(struct scene *s);

/* The same, but what is not supported is left out or replaced by what is nearest (lenient.h), with a note each. */
int scene_read_lenient(struct scene *s, const struct asset_source *assets, const char *name,
		       const struct plugin_decl *decls, const struct scene_define *defines, size_t define_count,
		       struct error *e);

/* The same, but a scene with something wrong in it is no failure: it is as far as it could be read, and s->problems
 * says all that is wrong. Not for rendering where there is any. -ENOMEM. */
int scene_read_all(struct scene *s, const struct asset_source *assets, const char *name,
		   const struct plugin_decl *decls, const struct scene_define *defines, size_t define_count,
		   bool lenient, struct error *e);

/* Look-ups; defaults are the caller's. A property that is there has passed its table's type and range. */
const struct property *node_find(const struct scene_node *n, const char *name);
double node_float(const struct scene_node *n, const char *name, double fallback); /* ints convert */
int64_t node_int(const struct scene_node *n, const char *name, int64_t fallback);
bool node_bool(const struct scene_node *n, const char *name, bool fallback);
const char *node_string(const struct scene_node *n, const char *name, const char *fallback);
mat4 node_transform(const struct scene_node *n, const char *name); /* identity when absent */
const struct scene_node *node_child(const struct scene_node *n, enum plugin_class cls, uint32_t index); /* NULL: none */
const struct scene_node *node_ref(const struct scene_node *n, const char *name); /* VALUE_NODE or NULL */

/* error_set with "file:line: <element>: " before the text. */
__attribute__((format(printf, 4, 5))) int node_error(const struct scene_node *n, struct error *e, int errno_value,
						     const char *format, ...);

#endif
