/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Small worlds that between them have what paths can meet, for tests of the methods that move paths: a room or an open
 * floor with one thing of interest in it. Films of 32 x 32 with a box filter. Each call builds; free with world_free.
 */
#ifndef TESTS_SUPPORT_ROOMS_H
#define TESTS_SUPPORT_ROOMS_H

#include "worker/render/world/world.h"

struct room {
	const char *name;
	struct world *(*build)(void);
};

enum { ROOMS_MOST = 24 };		 /* of the list, with a test or two about all of them */
extern const struct room rooms[];	 /* ends with a NULL name */
struct world *room_of(const char *name); /* fails the test when there is none */

#endif
