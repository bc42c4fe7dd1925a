/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which properties of a file form one attribute of a mesh, by the rules of Mitsuba 3: adjacent ones with the same
 * prefix and the endings _x _y _z _w, _r _g _b _a, _0 _1 _2 _3 or _1 _2 _3 _4; and r g b (a), or red green blue
 * (alpha), anywhere, which are `color`. Any other property is an attribute with one channel.
 */
#ifndef WORKER_RENDER_SHAPE_ATTRIBUTE_NAMES_H
#define WORKER_RENDER_SHAPE_ATTRIBUTE_NAMES_H

#include "worker/render/math/attribute.h"

enum { ATTRIBUTE_GROUPS_MAX = 64 };

struct attribute_group {
	char name[ATTRIBUTE_NAME_MAX]; /* with `vertex_` or `face_` in front */
	uint32_t channels;	       /* bits of the channels found */
};

struct attribute_groups {
	const char *kind; /* "vertex_" or "face_" */
	uint32_t count;
	int scheme; /* of the last group's endings, if it may continue; -1 */
	struct attribute_group of[ATTRIBUTE_GROUPS_MAX];
};

struct attribute_groups attribute_groups_none(const char *kind);

/* Adds a property, and returns its attribute and channel. false: too many. */
bool attribute_groups_add(struct attribute_groups *g, const char *property, uint32_t *group, uint32_t *channel);

/* The number of channels; 0: not an attribute, such as colours with fewer than three channels. */
uint32_t attribute_group_channels(const struct attribute_group *g);

#endif
