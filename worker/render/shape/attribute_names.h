/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Groups the properties of a file into attributes of a mesh, by the rules of Mitsuba 3. Adjacent properties with the
 * same prefix and the endings _x _y _z _w, _r _g _b _a, _0 _1 _2 _3 or _1 _2 _3 _4 form one attribute; so do r g b (a),
 * or red green blue (alpha), wherever they are, which become `color`. Any other property is an attribute with one
 * channel.
 */
#ifndef WORKER_RENDER_SHAPE_ATTRIBUTE_NAMES_H
#define WORKER_RENDER_SHAPE_ATTRIBUTE_NAMES_H

#include "worker/render/math/attribute.h"

enum { ATTRIBUTE_GROUPS_MAX = 64 };

struct attribute_group {
	char name[ATTRIBUTE_NAME_MAX]; /* begins with `vertex_` or `face_` */
	uint32_t channel_mask;	       /* bit k: channel k has been found */
};

struct attribute_groups {
	const char *prefix; /* "vertex_" or "face_" */
	uint32_t count;
	int suffix_scheme; /* scheme of the last group's endings if the group may continue, otherwise -1 */
	struct attribute_group groups[ATTRIBUTE_GROUPS_MAX];
};

/* Returns an empty set of groups. prefix: "vertex_" or "face_". */
struct attribute_groups attribute_groups_make(const char *prefix);

/* Adds a property; *group: the attribute that it belongs to; *channel: its channel of the attribute. Returns false if
 * there are too many groups. */
bool attribute_groups_add(struct attribute_groups *g, const char *property, uint32_t *group, uint32_t *channel);

/* Returns the number of channels, or 0 if the group is not an attribute, such as a colour with two channels. */
uint32_t attribute_group_channel_count(const struct attribute_group *g);

#endif
