/* SPDX-License-Identifier: Apache-2.0 */
/* A node of a scene's description and its properties: typed values that match their tables. */
#ifndef WORKER_RENDER_SCENE_NODE_H
#define WORKER_RENDER_SCENE_NODE_H

#include "common/base/error.h"
#include "worker/render/math/motion.h"
#include "worker/render/plugin/param.h"

#include <stdbool.h>
#include <stdint.h>

struct arena;
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
	const struct animation *animation; /* VALUE_TRANSFORM: how it moves on from there; NULL: it is still */
};

struct property {
	const char *name; /* 3.x spelling */
	int line;
	struct value value;
};

struct scene_node {
	enum plugin_class cls;
	const char *type; /* "roughconductor" */
	const char *id;	  /* NULL: none */
	const char *file; /* as the user named it */
	int line;
	const struct plugin_decl *decl;
	bool shines; /* an emitter, or a shape that holds one, however deep */
	bool flawed; /* it lacks what was refused: what else is wrong with it may only follow from that */
	uint32_t property_count, child_count;
	const struct property *properties;
	const struct scene_node *const *children; /* nested objects without a name */
};

/* Look-ups, with defaults by the caller. An existing property has the type and range of its table. */
const struct property *node_find(const struct scene_node *n, const char *name);
double node_float(const struct scene_node *n, const char *name, double fallback); /* ints convert */
int64_t node_int(const struct scene_node *n, const char *name, int64_t fallback);
bool node_bool(const struct scene_node *n, const char *name, bool fallback);
const char *node_string(const struct scene_node *n, const char *name, const char *fallback);
mat4 node_transform(const struct scene_node *n, const char *name);  /* identity if absent; the first if it moves */
const struct animation *node_animation(const struct scene_node *n); /* of its to_world; NULL: it is still */
const struct scene_node *node_child(const struct scene_node *n, enum plugin_class cls, uint32_t index); /* NULL: none */
const struct scene_node *node_ref(const struct scene_node *n, const char *name); /* VALUE_NODE or NULL */

/* A copy in which the property has this value, whether n has it or not. NULL: no memory. */
const struct scene_node *node_with(const struct scene_node *n, const char *name, struct value v, struct arena *arena);

/* Whether both say the same: type, parameters and what they hold, wherever they stand. Of more than NODE_SAME_MOST
 * objects it is not found out: false. */
enum { NODE_SAME_MOST = 1000 };
bool node_same(const struct scene_node *a, const struct scene_node *b);

/* "room.xml:3"; of a long file name the end. Returns text. */
enum { NODE_PLACE_MAX = 64 };
const char *node_place(const struct scene_node *n, char text[NODE_PLACE_MAX]);

/* "`lamp` (room.xml:3)" for a node that has an id, otherwise "the obj in room.xml:3", with the material whose faces it
 * has. Returns text. */
enum { NODE_TITLE_MAX = 160 };
const char *node_title(const struct scene_node *n, char text[NODE_TITLE_MAX]);

/* error_set with "file:line: <element>: " before the text. */
__attribute__((format(printf, 4, 5))) int node_error(const struct scene_node *n, struct error *e, int errno_value,
						     const char *format, ...);

#endif
