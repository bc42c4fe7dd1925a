/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The effects of a scene and the options that a user may override, as displayed by programs. Filled in by world_check
 * and world_summary (build.h). Pure; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_WORLD_SUMMARY_H
#define WORKER_RENDER_WORLD_SUMMARY_H

#include "common/plan/plan.h"
#include "worker/render/scene/settings.h"

/* One effect, on or off, and the reason: "dispersion", false, "no dielectric has an index that varies with
 * wavelength". */
struct effect_line {
	const char *name;
	bool is_on;
	bool is_forced;	    /* overridden by the user */
	bool changes_scene; /* forced off, so the image shows a different scene */
	char reason[240];
	const char *savings; /* what omitting the effect saves */
};
enum { RENDER_EFFECTS_MAX = 26 };

/* The overrides of hslt-submit and hslt-render; all zero: as the scene requires. The texts are in the form of a
 * plan. */
struct render_options {
	uint32_t width, height;
	char accuracy[PLAN_ACCURACY_MAX], effects[PLAN_EFFECTS_MAX];
	uint32_t max_depth;
};

/* Notes about shapes with coinciding surfaces, one sentence for each pair. */
enum { COINCIDENCE_NOTES_MAX = 8 };
struct coincidence_notes {
	char text[COINCIDENCE_NOTES_MAX][400];
	size_t count, pair_count; /* number of sentences; number of pairs */
	bool is_incomplete;	  /* the search reached its bound */
};

/* Notes about the scene, made while shapes were read and placed and afterwards; "" if there is nothing to say. */
struct world_notes {
	char small_shape[512];	    /* a shape that is too small relative to another one, by name */
	char flat_triangles[384];   /* how many triangles without area were left out */
	char bad_normals[256];	    /* how many normals of meshes are not finite */
	char near_camera[256];	    /* a shape that is too near to the camera */
	char empty_meshes[256];	    /* how many meshes have no triangles at all */
	char tiny_shapes[256];	    /* how many shapes are too small for the scene */
	char unread_materials[384]; /* how many shape files name materials that are not read */
	char nothing_visible[192];  /* that the camera sees no shape */
	char negative_pixels[384];  /* how many pixels of an image are negative where none may be */
	char no_light[128];	    /* that the emitters give no light */
	char black_backs[192];	    /* that the camera sees backs that are black */
	char endless_medium[256];   /* that the camera stands in a medium that no light from infinity gets through */
};

struct render_summary {
	struct scene_settings settings; /* includes the overrides of the options */
	/* Edges of the longest path that can carry light, at most what was requested. */
	uint32_t useful_depth;
	struct effect_line effect_lines[RENDER_EFFECTS_MAX];
	size_t effect_line_count;
	uint64_t shapes, triangles; /* including all that instances show */
	uint64_t instances;	    /* number of instances in the scene */
	/* Number of shapes that share meshes, number of meshes that they share, and number of triangles in memory. */
	uint64_t sharing_shapes, shared_meshes, stored_triangles;
	uint64_t segments; /* number of round cones of curves */
	/* Approximate size of the world in bytes; Embree's part is estimated per triangle. */
	uint64_t memory_bytes;
	double brightness_bound;  /* see world_brightness_bound() */
	bool has_beam;		  /* see world_has_beam() */
	bool has_rolling_shutter; /* see world_has_rolling_shutter() */
	struct coincidence_notes coincidence_notes;
	struct world_notes notes;
};

/* Size of the camera's text, one line of name=value pairs with the scene language's names: fov in degrees along
 * fov_axis, to_world by rows (x left on the image, y up, z forward). It goes into the image's header. */
enum { RENDER_CAMERA_TEXT_MAX = 768 };

#endif
