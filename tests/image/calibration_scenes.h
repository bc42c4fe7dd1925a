/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scenes by which stated errors are compared with true ones: those of the tree, the public ones (HSLT_SCENES), and
 * small hard ones made for it, in which light comes rarely, in clumps, or into dark surroundings.
 */
#ifndef TESTS_IMAGE_CALIBRATION_SCENES_H
#define TESTS_IMAGE_CALIBRATION_SCENES_H

#include "worker/render/world/world.h"

struct calibration_scene {
	const char *kind, *name;   /* kind: tree, public, made */
	const char *folder, *file; /* NULL: `text` */
	const char *text;
	const char *reference; /* the integrator that makes its reference */
	double seconds;	       /* of processor that a reference takes, about */
};

extern const struct calibration_scene calibration_scenes[]; /* ends with a NULL name */

/* NULL: it is a public one, and HSLT_SCENES is not set. The caller frees it. */
struct world *calibration_world(const struct calibration_scene *s, uint32_t width, uint32_t height);

#endif
