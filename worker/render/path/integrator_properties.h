/* SPDX-License-Identifier: Apache-2.0 */
/* The properties of an integrator that the programs know without the renderer. Pure; any thread. */
#ifndef WORKER_RENDER_PATH_INTEGRATOR_PROPERTIES_H
#define WORKER_RENDER_PATH_INTEGRATOR_PROPERTIES_H

#include "common/plan/plan.h"

struct integrator_properties {
	const char *name;
	enum plan_kind kind;
	uint32_t max_depth; /* maximum number of edges that its state can hold */
	bool has_mutations; /* its chains draw proposals from a mixture of mutation strategies */
	/* It has no light sub-paths, so it finds no light of beams; but it draws the film point first, so it can
	 * render a rolling shutter. */
	bool is_camera_only;
	bool must_end_on_emitter; /* its paths end on emitters, so it finds no light of media */
};
/* Error for an integrator with is_camera_only in a scene with a beam. Argument: the integrator's name. */
#define RENDER_NO_BEAMS                                                                                              \
	"the integrator %s cannot find the light of `collimated`, a beam without width: paths must start at it, as " \
	"those of bdpt, erpt, pssmlt and hslt do"

/* Error for an integrator without is_camera_only in a scene with a rolling shutter. Argument: the integrator's name.
 */
#define RENDER_NO_ROLLING_SHUTTER                                                                                     \
	"the integrator %s cannot render a rolling shutter while something moves: the time of a path depends on its " \
	"place on the film, which only path draws first"

/* Error for an integrator with must_end_on_emitter in a scene with a medium that emits. Argument: the integrator's
 * name.
 */
#define RENDER_NO_MEDIUM_LIGHT                                                                                    \
	"the integrator %s cannot find the light of media (`volumelight`): its chains move the ends of paths on " \
	"surfaces; path, bdpt, bdpt8, erpt, erpt4 and pssmlt find it"

#endif
