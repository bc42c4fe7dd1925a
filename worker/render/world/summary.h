/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The effects of a scene and what a user may override, as displayed by programs. Filled in by render_check and
 * world_summary (build.h). Pure; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_WORLD_SUMMARY_H
#define WORKER_RENDER_WORLD_SUMMARY_H

#include "common/plan/plan.h"
#include "worker/render/scene/settings.h"

/* One effect, on or off, and why: "dispersion", false, "no dielectric has an index that varies with wavelength". */
struct effect_line {
	const char *name;
	bool on;
	bool forced;	  /* overridden by the user */
	bool other_scene; /* forced off: the image is that of another scene */
	char why[240];
	const char *saves; /* what omitting it saves */
};
enum { RENDER_EFFECTS_MAX = 26 };

/* The overrides of hslt-submit and hslt-render; all zero: as the scene requires. The texts are those of a plan. */
struct render_options {
	uint32_t width, height;
	char accuracy[PLAN_ACCURACY_MAX], effects[PLAN_EFFECTS_MAX];
	uint32_t max_depth;
};

/* Shapes with coinciding surfaces, a sentence for each pair. */
enum { RENDER_COINCIDENT_MAX = 8 };
struct render_coincident {
	char text[RENDER_COINCIDENT_MAX][400];
	size_t count, total; /* sentences; the number of pairs */
	bool incomplete;     /* the search was incomplete */
};

/* What was noticed while shapes were read and placed; "" if nothing was. */
struct world_notes {
	char scales[512];    /* a shape that is too small relative to another, by name */
	char flat[384];	     /* how many triangles without area were left out */
	char without[256];   /* how many meshes have none */
	char gone[256];	     /* how many shapes are too small for the scene */
	char materials[384]; /* how many files of shapes have materials that are not read */
	char unseen[192];    /* that the camera sees no shape */
	char dark[128];	     /* that the emitters give no light */
	char backs[192];     /* that it sees backs that are black */
	char endless[256];   /* that it stands in a medium that no light from infinity gets through */
};

struct render_summary {
	struct scene_settings settings; /* with the overrides of the options */
	uint32_t useful_depth;		/* edges of the longest path that can carry light, at most what was requested */
	struct effect_line lines[RENDER_EFFECTS_MAX];
	size_t line_count;
	uint64_t shapes, triangles; /* instances, with everything they show */
	uint64_t instances;	    /* objects of the scene that show a group of shapes somewhere */
	uint64_t sharing, shared_meshes, stored_triangles; /* shapes that share meshes, as those of large groups do;
							      number of these meshes; memory */
	uint64_t segments;				   /* round cones of curves */
	uint64_t memory;  /* bytes of the world, approximately; Embree's part is estimated per triangle */
	double brightest; /* see world_brightest */
	bool beams;	  /* see world_has_beam */
	bool rolls;	  /* see world_rolls */
	struct render_coincident coincident;
	struct world_notes notes;
};

/* The camera in one line of name=value pairs with the scene language's names: fov in degrees along fov_axis,
 * to_world by rows (x left on the image, y up, z forward). For the image's header. */
enum { RENDER_CAMERA_TEXT = 768 };

#endif
