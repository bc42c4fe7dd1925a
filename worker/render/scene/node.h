/* SPDX-License-Identifier: Apache-2.0 */
/* A node of the scene description and its properties: typed values that conform to the plug-in's table. */
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
	const struct animation *animation; /* the motion of a VALUE_TRANSFORM, which starts there; NULL: none */
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
	bool emits_light; /* an emitter, or a shape that contains one at any depth */
	bool is_flawed;	  /* something inside it was refused: any other problem of the node may be only a consequence */
	uint32_t property_count, child_count;
	const struct property *properties;
	const struct scene_node *const *children; /* nested objects without a name */
};

/* Look-ups; the caller gives the default. A property that exists has the type and range stated in its table. */
const struct property *node_find_property(const struct scene_node *n, const char *name);
double node_float(const struct scene_node *n, const char *name, double fallback); /* converts integers */
int64_t node_int(const struct scene_node *n, const char *name, int64_t fallback);
bool node_bool(const struct scene_node *n, const char *name, bool fallback);
const char *node_string(const struct scene_node *n, const char *name, const char *fallback);
mat4 node_transform(const struct scene_node *n, const char *name);  /* identity if absent; first of an animation */
const struct animation *node_animation(const struct scene_node *n); /* of to_world; NULL: no motion */
const struct scene_node *node_child(const struct scene_node *n, enum plugin_class cls, uint32_t index); /* NULL: none */
const struct scene_node *node_ref(const struct scene_node *n, const char *name); /* the object, or NULL */

/* Returns a copy of n in which the property has this value, whether or not n has the property. NULL if out of
 * memory. */
const struct scene_node *node_copy_with_property(const struct scene_node *n, const char *name, struct value v,
						 struct arena *arena);

/* Returns whether both nodes have the same type, parameters and contents, regardless of where they stand in the
 * file. False if that takes comparing more than NODE_EQUALS_OBJECTS_MAX objects. */
enum { NODE_EQUALS_OBJECTS_MAX = 1000 };
bool node_equals(const struct scene_node *a, const struct scene_node *b);

/* Writes "room.xml:3", with only the end of a long file name. Returns text. */
enum { NODE_PLACE_MAX = 64 };
const char *node_place(const struct scene_node *n, char text[NODE_PLACE_MAX]);

/* Writes "`lamp` (room.xml:3)" for a node that has an id, and otherwise "the obj in room.xml:3", followed by the
 * material of a shape that states one. Returns text. */
enum { NODE_TITLE_MAX = 160 };
const char *node_title(const struct scene_node *n, char text[NODE_TITLE_MAX]);

/* Like error_set(), with "file:line: <element>: " before the text. */
__attribute__((format(printf, 4, 5))) int node_error(const struct scene_node *n, struct error *e, int errno_value,
						     const char *format, ...);

#endif
