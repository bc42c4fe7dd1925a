/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a scene calls for, and what a user may override of it, as the programs say it. Filled by render_check and
 * world_summary (build.h). Pure; any thread; nothing allocates.
 */
#ifndef WORKER_RENDER_WORLD_SUMMARY_H
#define WORKER_RENDER_WORLD_SUMMARY_H

#include "common/plan/plan.h"
#include "worker/render/scene/settings.h"

/* One effect, on or off, and why: "dispersion", false, "no dielectric has an index that varies with wavelength". */
struct effect_line {
	const char *name;
	bool on;
	bool forced;	  /* the user wants it other than the scene calls for */
	bool other_scene; /* forced off: the image is another one */
	char why[160];
	const char *saves; /* what leaving it out saves */
};
enum { RENDER_EFFECTS_MAX = 24 };

/* What hslt-submit and hslt-render let the user override; all zero: as the scene says. The texts are those of a plan.
 */
struct render_options {
	uint32_t width, height;
	char accuracy[PLAN_ACCURACY_MAX], effects[PLAN_EFFECTS_MAX];
	uint32_t max_depth;
};

/* Shapes of which surfaces coincide, a sentence each with the names of two. */
enum { RENDER_COINCIDENT_MAX = 8 };
struct render_coincident {
	char text[RENDER_COINCIDENT_MAX][400];
	size_t count, total; /* sentences; of how many */
	bool incomplete;     /* there are more than were looked for */
};

/* What was met while the shapes were read; "" where nothing was. */
struct world_notes {
	char scales[256];    /* a shape that is too small beside another, by name */
	char flat[256];	     /* how many triangles without an area were left out */
	char materials[256]; /* how many files of shapes have materials that are not read */
};

struct render_summary {
	struct scene_settings settings; /* with the overrides of the options */
	uint32_t useful_depth;		/* edges of the longest path that can carry light, at most what was asked for */
	struct effect_line lines[RENDER_EFFECTS_MAX];
	size_t line_count;
	uint64_t shapes, triangles;			     /* instances with all that they show */
	uint64_t instances, shared_meshes, stored_triangles; /* shapes that share meshes; how many; kept in memory */
	uint64_t memory;  /* bytes of the world, about; Embree's part is estimated from what it takes a triangle */
	double brightest; /* see world_brightest */
	struct render_coincident coincident;
	struct world_notes notes;
};

/* The camera in one line of name=value pairs, as the scene language has them: fov in degrees along fov_axis, to_world
 * by rows (x left on the image, y up, z forward). For the image's header. */
enum { RENDER_CAMERA_TEXT = 768 };

#endif
