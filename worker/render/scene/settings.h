/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Sensor, film, filter, sampler and integrator of a scene as plain numbers, for hslt-submit, hslt-render and the world.
 * Needs no Embree and opens no files.
 */
#ifndef WORKER_RENDER_SCENE_SETTINGS_H
#define WORKER_RENDER_SCENE_SETTINGS_H

#include "worker/render/scene/scene.h"

enum filter_kind { FILTER_BOX, FILTER_TENT, FILTER_GAUSSIAN, FILTER_CUBIC, FILTER_LANCZOS };

/* How directions are mapped to film points: projected on a plane, by longitude and latitude, or on a plane with lens
 * distortion. */
enum scene_projection { PROJECTION_PLANE, PROJECTION_SPHERE, PROJECTION_DISTORTED };

/* The side at which a rolling shutter begins; it exposes rows or columns of the film one after the other. */
enum scene_rolling_shutter { ROLL_NONE, ROLL_TOP, ROLL_BOTTOM, ROLL_LEFT, ROLL_RIGHT };

struct scene_settings {
	uint32_t width, height; /* the film's, 1..PLAN_SIDE_MAX each */
	enum filter_kind filter;
	double filter_radius, filter_stddev; /* in pixels; Mitsuba's defaults: radius 0.5 for box, 1 for tent; gaussian:
						stddev 0.5, radius 4 stddev */
	double filter_b, filter_c;	     /* FILTER_CUBIC: B and C of Mitchell and Netravali */
	uint32_t border; /* whole pixels by which the kernel extends beyond a pixel: ceil(radius - 0.5) */
	uint32_t crop_x, crop_y, crop_width, crop_height; /* the film's crop window; width 0: none */
	uint64_t spp;					  /* sample_count; 0: none given */
	uint32_t max_depth;	 /* edges of the longest path, 1..128 (-1 and larger values become 128); default 128 */
	uint32_t roulette_depth; /* scattering events before Russian roulette begins (rr_depth), from 1 on; default 5 */
	bool hides_emitters;	 /* hides paths of one edge, which show emitters directly */
	char integrator[32]; /* type of the scene's own integrator ("": none), which is ignored except for its depths
				and media */
	mat4 to_world;	     /* camera, as the shutter opens: +z forward, +x LEFT on the image, +y up; no scale */
	bool is_moving;	     /* while the shutter is open */
	double half_width;   /* above 0: half of the film's width in scene units (orthographic, telecentric) */
	double fov;	     /* degrees, along fov_axis */
	char fov_axis[16];   /* x, y, diagonal, smaller, larger: resolved by the camera, which knows the film's size */
	double principal_x, principal_y; /* offset of the principal point from the centre, relative to the film's size,
					    as in Mitsuba 3 */
	enum scene_projection projection;
	double distortion[2]; /* PROJECTION_DISTORTED: the two coefficients of `kc` */
	double near_clip, far_clip;
	double shutter_open, shutter_close; /* if they are equal, nothing moves */
	enum scene_rolling_shutter rolling_shutter;
	double line_exposure; /* exposure of a line, as a fraction of the time from the start of the first to the end of
				 the last */
	double aperture_radius, focus_distance; /* thinlens, telecentric; radius 0: a pinhole, whatever the distance */
	bool is_unplaced; /* the scene has no sensor: scene_settings_place_sensor() gives the camera's position
			   */
};

/* Size of the rendered image: that of the crop window, or else of the film. */
static inline uint32_t scene_settings_width(const struct scene_settings *s)
{
	return s->crop_width ? s->crop_width : s->width;
}

static inline uint32_t scene_settings_height(const struct scene_settings *s)
{
	return s->crop_width ? s->crop_height : s->height;
}

/* Reads the settings. width, height: replace the film's size and drop its crop window (0: keep). sensor_number: of the
 * sensor to use, from 1 on. */
int scene_settings_read(const struct scene *s, uint32_t width, uint32_t height, uint32_t sensor_number,
			struct scene_settings *out, struct error *e);

/* Makes the columns of a camera's transform orthonormal, keeping the view direction; a mirrored transform stays
 * mirrored. Returns false if it does more than rotate, translate, mirror and scale. */
bool scene_settings_orthonormalize(mat4 m, mat4 *out);

/* Returns the sensor of that number, from 1 on, or NULL. */
const struct scene_node *scene_sensor(const struct scene *s, uint32_t number);

/* For a scene without a sensor, whose shapes lie between low and high: places the camera that both versions of
 * Mitsuba supply. file: name of the scene file, for the error if there is no shape. */
int scene_settings_place_sensor(struct scene_settings *s, const char *file, vec3 low, vec3 high, struct error *e);

/* Declarations of all sensors, films, reconstruction filters, samplers and integrators; ends with a NULL type. */
extern const struct plugin_decl setting_decls[];

#endif
