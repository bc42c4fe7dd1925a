/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scenes for comparing stated errors with true ones: those of the project, the public ones (HSLT_SCENES), and small
 * hard ones made for this purpose, in which light is rare, comes in clumps, or falls on dark surroundings.
 */
#ifndef TESTS_IMAGE_CALIBRATION_SCENES_H
#define TESTS_IMAGE_CALIBRATION_SCENES_H

#include "worker/render/world/world.h"

struct calibration_scene {
	const char *kind, *name;   /* kind: tree, public, made */
	const char *folder, *file; /* NULL: the scene is `xml` */
	const char *xml;
	const char *reference_integrator;
	double reference_seconds; /* approximate processor time */
};

extern const struct calibration_scene calibration_scenes[]; /* ends with a NULL name */

/* Returns NULL if the scene is a public one and HSLT_SCENES is not set. The caller frees the world. */
struct world *calibration_world(const struct calibration_scene *s, uint32_t width, uint32_t height);

#endif
