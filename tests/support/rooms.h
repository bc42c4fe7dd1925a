/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Small worlds that together contain whatever paths can meet, for tests of mutations: a room or an open floor with one
 * particular feature. Films of 32 x 32 with a box filter. Each call builds a world; free it with world_free.
 */
#ifndef TESTS_SUPPORT_ROOMS_H
#define TESTS_SUPPORT_ROOMS_H

#include "worker/render/world/world.h"

struct room {
	const char *name;
	struct world *(*build)(void);
};

enum { ROOMS_MAX = 24 };			  /* limit for the list, which a test or two run through completely */
extern const struct room rooms[];		  /* ends with a NULL name */
struct world *room_build_named(const char *name); /* fails the test if there is none */

#endif
