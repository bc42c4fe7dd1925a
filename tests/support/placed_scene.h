/* SPDX-License-Identifier: Apache-2.0 */
/* A scene in any units and at any position: a ball and a cube on a floor, under a ball that emits. */
#ifndef TESTS_SUPPORT_PLACED_SCENE_H
#define TESTS_SUPPORT_PLACED_SCENE_H

#include "worker/render/world/world.h"

enum { PLACED_SCENE_SIDE = 32 }; /* pixels of a side of its film */

/* Returns the scene, scaled by s, then moved by m along all axes. ball, cube: their <bsdf>, or "". */
struct world *placed_scene_make(double s, double m, const char *ball, const char *cube);

#endif
