/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which properties of a file make one attribute of a mesh, by the rules of Mitsuba 3: neighbours with one prefix and
 * endings _x _y _z _w, _r _g _b _a, _0 _1 _2 _3 or _1 _2 _3 _4; and r g b (a), or red green blue (alpha), wherever they
 * stand, which are `color`. Any other property is an attribute of one channel.
 */
#ifndef WORKER_RENDER_SHAPE_ATTRIBUTE_NAMES_H
#define WORKER_RENDER_SHAPE_ATTRIBUTE_NAMES_H

#include "worker/render/math/attribute.h"

enum { ATTRIBUTE_GROUPS_MAX = 64 };

struct attribute_group {
	char name[ATTRIBUTE_NAME_MAX]; /* with `vertex_` or `face_` before it, once */
	uint32_t channels;	       /* bits of those that are there */
};

struct attribute_groups {
	const char *kind; /* "vertex_" or "face_" */
	uint32_t count;
	int scheme; /* of the endings of the last group, if it may go on; -1 */
	struct attribute_group of[ATTRIBUTE_GROUPS_MAX];
};

struct attribute_groups attribute_groups_none(const char *kind);

/* Adds a property, and says of which attribute it is which channel. False: there are too many. */
bool attribute_groups_add(struct attribute_groups *g, const char *property, uint32_t *group, uint32_t *channel);

/* The number of channels; 0: the group is none, as colours of less than three are. */
uint32_t attribute_group_channels(const struct attribute_group *g);

#endif
