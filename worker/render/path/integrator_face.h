/* SPDX-License-Identifier: Apache-2.0 */
/* The properties of an integrator that the programs know. Pure; any thread. */
#ifndef WORKER_RENDER_PATH_INTEGRATOR_FACE_H
#define WORKER_RENDER_PATH_INTEGRATOR_FACE_H

#include "common/plan/plan.h"

struct render_integrator {
	const char *name;
	enum plan_kind kind;
	uint32_t max_depth; /* edges its state holds */
	bool has_mutations; /* its chains draw proposals from a mixture of strategies */
	bool from_camera;   /* it has no light sub-paths: no light of beams, and only it knows when a shutter rolls */
	bool to_emitters;   /* its paths end on emitters: no light of media */
};
/* The error for an integrator that is from_camera in a scene with a beam; the argument is its name. */
#define RENDER_NO_BEAMS                                                                                                \
	"the integrator %s finds no light of `collimated`, a beam without width: paths must begin there, as those of " \
	"bdpt, erpt, pssmlt and hslt do"

/* The error for one that is not from_camera in a scene with a rolling shutter. */
#define RENDER_NO_ROLL                                                                                                \
	"the integrator %s cannot render a rolling shutter while something moves: the time of a path depends on its " \
	"place on the film, which only path draws first"

/* And one that is to_emitters, a medium that shines. */
#define RENDER_NO_GLOW                                                                                            \
	"the integrator %s finds no light of `volumelight`, that of media: its chains move the ends of paths on " \
	"surfaces; path, bdpt, bdpt8, erpt, erpt4 and pssmlt find it"

#endif
