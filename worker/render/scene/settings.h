/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Sensor, film, filter, sampler and integrator of a scene as plain numbers: for hslt-submit, hslt-render and the world.
 * Needs no Embree and opens no files.
 */
#ifndef WORKER_RENDER_SCENE_SETTINGS_H
#define WORKER_RENDER_SCENE_SETTINGS_H

#include "worker/render/scene/scene.h"

enum filter_kind { FILTER_BOX, FILTER_TENT, FILTER_GAUSSIAN, FILTER_CUBIC, FILTER_LANCZOS };

/* How directions become film points: by a plane, by longitude and latitude, by a plane that kc distorts. */
enum scene_projection { PROJECTION_PLANE, PROJECTION_SPHERE, PROJECTION_DISTORTED };

/* A rolling shutter exposes rows or columns of the film one after the other, beginning at this side. */
enum scene_roll { ROLL_NONE, ROLL_TOP, ROLL_BOTTOM, ROLL_LEFT, ROLL_RIGHT };

struct scene_settings {
	uint32_t width, height; /* film, 1..PLAN_MAX_SIZE each */
	enum filter_kind filter;
	double filter_radius,
		filter_stddev;	   /* pixels; Mitsuba's defaults: box 0.5, tent 1, gaussian 0.5 and 4 x that */
	double filter_b, filter_c; /* of FILTER_CUBIC: Mitchell and Netravali's B and C */
	uint32_t border;	   /* whole pixels by which the kernel extends beyond a pixel: ceil(radius - 0.5) */
	uint32_t crop_x, crop_y, crop_width, crop_height; /* the crop window of the scene's film; width 0: all of it */
	uint64_t spp;					  /* sampleCount; 0: none given */
	uint32_t max_depth;				  /* edges, 1..128 (-1 and more become 128); default 128 */
	uint32_t roulette_depth; /* scattering events before Russian roulette begins, rr_depth; from 1 on, default 5 */
	bool hide_emitters;	 /* hides paths of one edge, emitters seen directly */
	char integrator[32];	 /* the scene's own ("": none): ignored except for its depths and media */
	mat4 to_world;	   /* camera: +z forward, +x LEFT on the image, +y up; without scale. When the shutter opens */
	bool moves;	   /* the camera, while the shutter is open */
	double half_width; /* above 0: orthographic or telecentric, half of the film's width in scene units */
	double fov;	   /* degrees, along fov_axis */
	char fov_axis[16]; /* x, y, diagonal, smaller, larger: the camera resolves it by the film's size */
	double principal_x, principal_y; /* offset of the principal point from the middle, relative to the film's size,
					    as in Mitsuba 3 */
	enum scene_projection projection;
	double kc[2]; /* of PROJECTION_DISTORTED */
	double near_clip, far_clip;
	double shutter_open, shutter_close; /* if both are equal, nothing moves */
	enum scene_roll roll;
	double roll_exposure; /* of a line, as a share of the time from the first's beginning to the last's end */
	double aperture_radius, focus_distance; /* thinlens, telecentric; radius 0: a pinhole, whatever the distance */
	bool unplaced; /* the scene has no sensor: scene_settings_place says where the camera is */
};

/* The size of what is rendered: the crop window, or the film. */
static inline uint32_t scene_settings_width(const struct scene_settings *s)
{
	return s->crop_width ? s->crop_width : s->width;
}

static inline uint32_t scene_settings_height(const struct scene_settings *s)
{
	return s->crop_width ? s->crop_height : s->height;
}

/* width, height: override the film's size (0: keep) and its crop window. sensor: which of several, from 1 on. */
int scene_settings_read(const struct scene *s, uint32_t width, uint32_t height, uint32_t sensor,
			struct scene_settings *out, struct error *e);

/* A camera's transform with its columns orthonormal around the view; mirrored ones stay mirrored. false: it does more
 * than rotate, translate, mirror and scale. */
bool scene_settings_upright(mat4 m, mat4 *out);

/* The sensor of that number; NULL: there is none. */
const struct scene_node *scene_sensor(const struct scene *s, uint32_t which);

/* For a scene without a sensor, whose shapes lie between low and high: places the camera that both Mitsubas supply.
 * file: the scene's, for the message where there is no shape. */
int scene_settings_place(struct scene_settings *s, const char *file, vec3 low, vec3 high, struct error *e);

/* Declarations of perspective, thinlens, hdrfilm, ldrfilm, box, tent, gaussian, all samplers, all integrators; NULL
 * type ends. */
extern const struct plugin_decl setting_decls[];

#endif
