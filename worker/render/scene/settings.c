/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds the selected sensor, its film and filter, and the integrator, and translates each into numbers of struct
 * scene_settings, with Mitsuba's defaults.
 *
 * Failures have the object's place: a second integrator, a crop window outside the film, a camera that to_world
 * flattens, invalid angles.
 */
#include "worker/render/scene/settings.h"
#include "worker/render/scene/fov.h"

#include "common/base/mem.h"
#include "common/plan/plan.h"
#include "worker/render/scene/depth.h"
#include "worker/render/scene/film.h"
#include "worker/render/scene/integrators.h"
#include "worker/render/text/number.h"

#include <stdio.h>
#include <string.h>

enum { FILM_PIXELS_MAX = PLAN_FILM_PIXELS_MAX, RADIUS_MAX = 64 };
enum { ROULETTE_DEPTH = 5 }; /* as in Mitsuba */
#define KC_MAX 1e6

#define RANGE(types, min, max) types, PARAM_UNDERSTOOD, min, max, NULL

/* Times matter if something moves. The duration matters only with a rolling shutter, and is checked there. */
#define SHUTTER_PARAMS                                                                                         \
	{"shutter_open", RANGE(VALUE_FLOAT, -1e30, 1e30)}, {"shutter_close", RANGE(VALUE_FLOAT, -1e30, 1e30)}, \
		{"rolling_shutter_type", VALUE_STRING, PARAM_UNDERSTOOD, 0, 0, "none|top|bottom|left|right"},  \
	{                                                                                                      \
		"rolling_shutter_duration", RANGE(VALUE_FLOAT, -1e30, 1e30)                                    \
	}
/* For the perspective cameras. Whatever jitter and cone_scale say, samples are spread over the whole pixel and
 * textures are not filtered. */
#define CAMERA_PARAMS                                                                                     \
	{"to_world", UNDERSTOOD(VALUE_TRANSFORM_OR_ANIMATION)}, {"fov", RANGE(VALUE_FLOAT, 1e-4, 179.9)}, \
		{"fov_axis", VALUE_STRING, PARAM_UNDERSTOOD, 0, 0, "x|y|diagonal|smaller|larger"},        \
		{"focal_length", UNDERSTOOD(VALUE_STRING)}, {"near_clip", RANGE(VALUE_FLOAT, 0, 1e30)},   \
		{"far_clip", RANGE(VALUE_FLOAT, 0, 1e30)}, SHUTTER_PARAMS,                                \
		{"principal_point_offset_x", RANGE(VALUE_FLOAT, -10, 10)},                                \
		{"principal_point_offset_y", RANGE(VALUE_FLOAT, -10, 10)}, {"jitter", IGNORED},           \
		{"cone_scale", IGNORED},                                                                  \
	{                                                                                                 \
		"srf", REFUSED                                                                            \
	}

/* For the orthographic cameras. */
#define ORTHOGRAPHIC_PARAMS                                                                     \
	{"to_world", UNDERSTOOD(VALUE_TRANSFORM)}, {"near_clip", RANGE(VALUE_FLOAT, 0, 1e30)},  \
		{"far_clip", RANGE(VALUE_FLOAT, 0, 1e30)}, SHUTTER_PARAMS, {"jitter", IGNORED}, \
		{"cone_scale", IGNORED},                                                        \
	{                                                                                       \
		"srf", REFUSED                                                                  \
	}

static const struct param film_params[] = {
	{"width", RANGE(VALUE_INT, 1, PLAN_SIDE_MAX)},
	{"height", RANGE(VALUE_INT, 1, PLAN_SIDE_MAX)},
	{"crop_offset_x", RANGE(VALUE_INT, 0, PLAN_SIDE_MAX)},
	{"crop_offset_y", RANGE(VALUE_INT, 0, PLAN_SIDE_MAX)},
	{"crop_width", RANGE(VALUE_INT, 1, PLAN_SIDE_MAX)},
	{"crop_height", RANGE(VALUE_INT, 1, PLAN_SIDE_MAX)},
	{"size", REFUSED},
	{"filename", IGNORED},
	{"file_format", IGNORED},
	{"pixel_format", IGNORED},
	{"component_format", IGNORED},
	{"channel_names", IGNORED},
	{"banner", IGNORED},
	{"gamma", IGNORED},
	{"exposure", IGNORED},
	{"tonemap_method", IGNORED},
	{"key", IGNORED},
	{"burn", IGNORED},
	{"attach_log", IGNORED},
	{"variable", IGNORED},
	{"digits", IGNORED},
	{"high_quality_edges", IGNORED},
	{"sample_border", IGNORED},
	{"compensate", IGNORED},
	{NULL, 0, 0, 0, 0, NULL},
};

#define HOLDS(cls) (1u << (cls))
#define CAMERA_HOLDS (HOLDS(PLUGIN_FILM) | HOLDS(PLUGIN_SAMPLER) | HOLDS(PLUGIN_MEDIUM))

const struct plugin_decl setting_decls[] = {
	{PLUGIN_SENSOR, "perspective",
	 /* A pinhole has no focus, but exporters write one. thinlens has an aperture. */
	 PARAMS(CAMERA_PARAMS, {"focus_distance", IGNORED}, {"aperture_radius", REFUSED}), CAMERA_HOLDS,
	 PARAM_UNDERSTOOD},
	{PLUGIN_SENSOR, "thinlens",
	 PARAMS(CAMERA_PARAMS, {"focus_distance", RANGE(VALUE_FLOAT, 1e-30, 1e30)},
		{"aperture_radius", RANGE(VALUE_FLOAT, 0, 1e30)}),
	 CAMERA_HOLDS, PARAM_UNDERSTOOD},
	{PLUGIN_SENSOR, "orthographic", PARAMS(ORTHOGRAPHIC_PARAMS, {"focus_distance", IGNORED}), CAMERA_HOLDS,
	 PARAM_UNDERSTOOD},
	{PLUGIN_SENSOR, "telecentric",
	 PARAMS(ORTHOGRAPHIC_PARAMS, {"focus_distance", RANGE(VALUE_FLOAT, 1e-30, 1e30)},
		{"aperture_radius", RANGE(VALUE_FLOAT, 0, 1e30)}),
	 CAMERA_HOLDS, PARAM_UNDERSTOOD},
	/* Exporters write clipping planes and a focus for all cameras; this one has neither. */
	{PLUGIN_SENSOR, "spherical",
	 PARAMS({"to_world", UNDERSTOOD(VALUE_TRANSFORM_OR_ANIMATION)}, {"near_clip", IGNORED}, {"far_clip", IGNORED},
		{"focus_distance", IGNORED}, SHUTTER_PARAMS, {"srf", REFUSED}),
	 CAMERA_HOLDS, PARAM_UNDERSTOOD},
	{PLUGIN_SENSOR, "perspective_rdist",
	 PARAMS(CAMERA_PARAMS, {"focus_distance", IGNORED}, {"aperture_radius", REFUSED},
		{"kc", UNDERSTOOD(VALUE_STRING)}),
	 CAMERA_HOLDS, PARAM_UNDERSTOOD},
	/* Its sensors have shutters of their own. */
	{PLUGIN_SENSOR, "batch",
	 PARAMS({"shutter_open", IGNORED}, {"shutter_close", IGNORED}, {"rolling_shutter_type", IGNORED},
		{"rolling_shutter_duration", IGNORED}, {"srf", REFUSED}),
	 CAMERA_HOLDS | HOLDS(PLUGIN_SENSOR), PARAM_UNDERSTOOD},
	{PLUGIN_FILM, "hdrfilm", film_params, HOLDS(PLUGIN_RFILTER), PARAM_UNDERSTOOD},
	{PLUGIN_FILM, "mfilm", film_params, HOLDS(PLUGIN_RFILTER), PARAM_UNDERSTOOD},
	{PLUGIN_FILM, "tiledhdrfilm", film_params, HOLDS(PLUGIN_RFILTER), PARAM_UNDERSTOOD},
	{PLUGIN_FILM, "ldrfilm", film_params, HOLDS(PLUGIN_RFILTER), PARAM_UNDERSTOOD},
	/* Mitsuba has no `radius` of `gaussian`, nor in 3.x of `box`. */
	PLUGIN(RFILTER, "box", {"radius", RANGE(VALUE_FLOAT, 0.25, RADIUS_MAX)}),
	PLUGIN(RFILTER, "tent", {"radius", RANGE(VALUE_FLOAT | VALUE_DIALECT_3_ONLY, 0.25, RADIUS_MAX)}),
	PLUGIN(RFILTER, "gaussian", {"stddev", RANGE(VALUE_FLOAT, 0.01, RADIUS_MAX / 4)},
	       {"radius", RANGE(VALUE_FLOAT | VALUE_DIALECT_3_ONLY, 0.25, RADIUS_MAX)}),
	PLUGIN(RFILTER, "mitchell", {"b", RANGE(VALUE_FLOAT, -1, 1)}, {"B", RANGE(VALUE_FLOAT, -1, 1)},
	       {"c", RANGE(VALUE_FLOAT, -1, 1)}, {"C", RANGE(VALUE_FLOAT, -1, 1)}),
	{PLUGIN_RFILTER, "catmullrom", NULL, 0, PARAM_UNDERSTOOD},
	PLUGIN(RFILTER, "lanczos", {"lobes", RANGE(VALUE_INT, 1, 16)}),
	{PLUGIN_SAMPLER, "*", PARAMS({"sample_count", RANGE(VALUE_INT, 1, 1 << 30)}, {"*", IGNORED}), 0, PARAM_IGNORED},
	/* irrcache, adaptive, aov and others contain the integrator that states the depth; multichannel and aov may
	   contain several. */
	{PLUGIN_INTEGRATOR, "*",
	 PARAMS({"max_depth", RANGE(VALUE_INT, -1, 1 << 30)}, {"rr_depth", RANGE(VALUE_INT, 1, 1 << 30)},
		{"hide_emitters", UNDERSTOOD(VALUE_BOOL)}, {"*", IGNORED}),
	 HOLDS(PLUGIN_INTEGRATOR), PARAM_IGNORED},
	{0, NULL, NULL, 0, 0},
};

/* Returns the n-th object of its class, from 1 on, or NULL; *count: their total number. */
static const struct scene_node *find_object(const struct scene *s, enum plugin_class cls, uint32_t n, uint32_t *count)
{
	const struct scene_node *found = NULL;
	*count = 0;
	for (uint32_t i = 0; i < s->object_count; i++)
		if (s->objects[i]->cls == cls && ++*count == n)
			found = s->objects[i];
	return found;
}

/* Reads the crop window. One that covers the whole film counts as none. */
static int read_crop(const struct scene_node *film, struct scene_settings *out, struct error *e)
{
	uint64_t x = (uint64_t)node_int(film, "crop_offset_x", 0), y = (uint64_t)node_int(film, "crop_offset_y", 0);
	uint64_t w = (uint64_t)node_int(film, "crop_width", out->width),
		 h = (uint64_t)node_int(film, "crop_height", out->height);
	if (x + w > out->width || y + h > out->height)
		return node_error(film, e, ERANGE,
				  "the crop window of %llu x %llu pixels at %llu, %llu exceeds the film of %u x %u",
				  (unsigned long long)w, (unsigned long long)h, (unsigned long long)x,
				  (unsigned long long)y, out->width, out->height);
	if (w == out->width && h == out->height)
		return 0;
	out->crop_x = (uint32_t)x;
	out->crop_y = (uint32_t)y;
	out->crop_width = (uint32_t)w;
	out->crop_height = (uint32_t)h;
	return 0;
}

/* Mitsuba 0.6's film for experiments: by default it has one pixel and a box filter. */
static bool is_mfilm(const struct scene_node *film)
{
	return film && strcmp(film->type, "mfilm") == 0;
}

static int read_film(const struct scene_node *sensor, uint32_t width, uint32_t height, struct scene_settings *out,
		     struct error *e)
{
	const struct scene_node *film = node_child(sensor, PLUGIN_FILM, 0);
	bool is_one_pixel = is_mfilm(film);
	out->width = film ? (uint32_t)node_int(film, "width", is_one_pixel ? 1 : SCENE_FILM_WIDTH) : SCENE_FILM_WIDTH;
	out->height =
		film ? (uint32_t)node_int(film, "height", is_one_pixel ? 1 : SCENE_FILM_HEIGHT) : SCENE_FILM_HEIGHT;
	if (width && !height) /* keeps the film's aspect ratio */
		out->height = (uint32_t)fmin(fmax(floor((double)width * out->height / out->width + 0.5), 1),
					     PLAN_SIDE_MAX + 1.0);
	if (width)
		out->width = width;
	if (height)
		out->height = height;
	if (out->width > PLAN_SIDE_MAX || out->height > PLAN_SIDE_MAX ||
	    (uint64_t)out->width * out->height > FILM_PIXELS_MAX)
		return node_error(film ? film : sensor, e, ERANGE,
				  "a film of %u x %u pixels; at most %d a side and %d in all, %d of them in one render",
				  out->width, out->height, PLAN_SIDE_MAX, FILM_PIXELS_MAX, PLAN_PIXELS_MAX);
	return film && !width && !height ? read_crop(film, out, e) : 0;
}

static int read_filter(const struct scene_node *sensor, struct scene_settings *out, struct error *e)
{
	const struct scene_node *film = node_child(sensor, PLUGIN_FILM, 0);
	const struct scene_node *filter = film ? node_child(film, PLUGIN_RFILTER, 0) : NULL;
	out->filter = FILTER_GAUSSIAN;
	out->filter_stddev = 0.5;
	if (filter ? strcmp(filter->type, "box") == 0 : is_mfilm(film)) {
		out->filter = FILTER_BOX;
		out->filter_radius = filter ? node_float(filter, "radius", 0.5) : 0.5;
	} else if (filter && strcmp(filter->type, "tent") == 0) {
		out->filter = FILTER_TENT;
		out->filter_radius = node_float(filter, "radius", 1.0);
	} else if (filter && (strcmp(filter->type, "mitchell") == 0 || strcmp(filter->type, "catmullrom") == 0)) {
		bool mitchell = strcmp(filter->type, "mitchell") == 0;
		out->filter = FILTER_CUBIC;
		out->filter_radius = 2;
		out->filter_b = mitchell ? node_float(filter, "B", node_float(filter, "b", 1.0 / 3)) : 0;
		out->filter_c = mitchell ? node_float(filter, "C", node_float(filter, "c", 1.0 / 3)) : 0.5;
	} else if (filter && strcmp(filter->type, "lanczos") == 0) {
		out->filter = FILTER_LANCZOS;
		out->filter_radius = (double)node_int(filter, "lobes", 3);
	} else {
		out->filter_stddev = filter ? node_float(filter, "stddev", 0.5) : 0.5;
		out->filter_radius =
			filter ? node_float(filter, "radius", 4 * out->filter_stddev) : 4 * out->filter_stddev;
		if (filter && !(out->filter_radius > out->filter_stddev))
			return node_error(filter, e, ERANGE, "a radius of %g pixels cuts off a Gaussian of stddev %g",
					  out->filter_radius, out->filter_stddev);
	}
	out->border = out->filter_radius > 0.5 ? (uint32_t)ceil(out->filter_radius - 0.5) : 0;
	return 0;
}

/* Reads the depths. As in Mitsuba, the innermost integrator determines them; `direct` shows light scattered once. */
static int read_depth(const struct scene *s, struct scene_settings *out, struct error *e)
{
	uint32_t count;
	const struct scene_node *integrator = find_object(s, PLUGIN_INTEGRATOR, 1, &count);
	out->max_depth = SCENE_DEPTH_MAX;
	out->roulette_depth = ROULETTE_DEPTH;
	if (!integrator)
		return 0;
	if (count > 1)
		return node_error(integrator, e, EINVAL, "a second integrator in the scene");
	snprintf(out->integrator, sizeof out->integrator, "%s", integrator->type);
	int64_t depth = integrator_depth(integrator), roulette = ROULETTE_DEPTH;
	for (const struct scene_node *n = integrator; n; n = integrator_inner(n))
		roulette = node_int(n, "rr_depth", roulette);
	for (const struct scene_node *n = integrator; n; n = integrator_inner(n))
		out->hides_emitters |= node_bool(n, "hide_emitters", false);
	if (depth == 0)
		return node_error(integrator, e, ERANGE,
				  "a depth of 0 shows nothing; 1 shows emitters seen directly, -1 is no limit");
	if (depth > 0 && depth < SCENE_DEPTH_MAX)
		out->max_depth = (uint32_t)depth;
	out->roulette_depth = (uint32_t)roulette;
	return 0;
}

/* Reads the size of an orthographic film: it is as wide as the line from -1 to 1 is after to_world. */
static int read_film_scale(const struct scene_node *sensor, struct scene_settings *out, struct error *e)
{
	mat4 m = node_transform(sensor, "to_world");
	double x = vec3_length((vec3){m.m[0][0], m.m[1][0], m.m[2][0]}),
	       y = vec3_length((vec3){m.m[0][1], m.m[1][1], m.m[2][1]});
	if (!(fabs(x - y) <= 1e-3 * x) || !(x > 0) || !isfinite(x))
		return node_error(sensor, e, ENOTSUP,
				  "to_world scales the film by %g and %g: only square pixels are supported", x, y);
	out->half_width = x;
	return 0;
}

static int read_fov(const struct scene_node *sensor, struct scene_settings *out, struct error *e)
{
	bool is_orthographic = strcmp(sensor->type, "orthographic") == 0 || strcmp(sensor->type, "telecentric") == 0;
	if (is_orthographic || out->projection == PROJECTION_SPHERE)
		snprintf(out->fov_axis, sizeof out->fov_axis, "x");
	if (is_orthographic)
		return read_film_scale(sensor, out, e);
	return out->projection == PROJECTION_SPHERE ? 0 : fov_read(sensor, &out->fov, out->fov_axis, e);
}

static int read_projection(const struct scene_node *sensor, struct scene_settings *out, struct error *e)
{
	if (strcmp(sensor->type, "spherical") == 0)
		out->projection = PROJECTION_SPHERE;
	if (strcmp(sensor->type, "perspective_rdist") != 0)
		return 0;
	const char *kc = node_string(sensor, "kc", "");
	int count = number_parse_list(kc, out->distortion, 2);
	if (count != 0 && count != 2)
		return node_error(sensor, e, EINVAL, "kc=\"%.64s\" is not two numbers", kc);
	for (int i = 0; i < count; i++)
		if (!(fabs(out->distortion[i]) <= KC_MAX))
			return node_error(sensor, e, ERANGE, "kc=\"%.64s\" is outside [-%g, %g]", kc, KC_MAX, KC_MAX);
	if (out->distortion[0] != 0 || out->distortion[1] != 0)
		out->projection = PROJECTION_DISTORTED;
	return 0;
}

bool scene_settings_orthonormalize(mat4 m, mat4 *out)
{
	vec3 x = {m.m[0][0], m.m[1][0], m.m[2][0]}, y = {m.m[0][1], m.m[1][1], m.m[2][1]},
	     z = {m.m[0][2], m.m[1][2], m.m[2][2]};
	x = vec3_normalize(x);
	y = vec3_normalize(y);
	z = vec3_normalize(z);
	double skew = fmax(fabs(vec3_dot(x, y)), fmax(fabs(vec3_dot(y, z)), fabs(vec3_dot(z, x))));
	if (!vec3_is_finite(x) || !vec3_is_finite(y) || !vec3_is_finite(z) || !(skew < 1e-3))
		return false;
	double handedness = vec3_dot(vec3_cross(x, y), z) < 0 ? -1 : 1;
	x = vec3_normalize(vec3_madd(x, -vec3_dot(x, z), z));
	y = vec3_scale(handedness, vec3_cross(z, x));
	*out = (mat4){
		{{x.x, y.x, z.x, m.m[0][3]}, {x.y, y.y, z.y, m.m[1][3]}, {x.z, y.z, z.z, m.m[2][3]}, {0, 0, 0, 1}}};
	return true;
}

/* Determines where the camera is when the shutter opens. */
static int read_to_world(const struct scene_node *sensor, struct scene_settings *out, struct error *e)
{
	const struct animation *a = node_animation(sensor);
	mat4 m = node_transform(sensor, "to_world");
	if (a) {
		struct motion motion;
		struct motion_key *keys = mem_alloc(a->count, sizeof *keys);
		if (!keys)
			return error_set(e, ENOMEM, "out of memory");
		out->is_moving = motion_make(&motion, a, out->shutter_open, out->shutter_close, keys);
		m = motion_transform_at(&motion, 0);
		mem_free(keys);
	}
	return scene_settings_orthonormalize(m, &out->to_world)
		       ? 0
		       : node_error(sensor, e, EINVAL,
				    "to_world may only rotate, translate, mirror and scale a camera");
}

static int read_rolling_shutter(const struct scene_node *sensor, struct scene_settings *out, struct error *e)
{
	static const char *const types[] = {[ROLL_NONE] = "none",
					    [ROLL_TOP] = "top",
					    [ROLL_BOTTOM] = "bottom",
					    [ROLL_LEFT] = "left",
					    [ROLL_RIGHT] = "right"};
	const char *type = node_string(sensor, "rolling_shutter_type", types[ROLL_NONE]);
	out->rolling_shutter = ROLL_NONE;
	while (strcmp(types[out->rolling_shutter], type) != 0)
		out->rolling_shutter++;
	if (out->rolling_shutter == ROLL_NONE)
		return 0;
	if (!node_find_property(sensor, "rolling_shutter_duration"))
		return node_error(sensor, e, EINVAL, "a rolling shutter needs a rolling_shutter_duration");
	out->line_exposure = node_float(sensor, "rolling_shutter_duration", 0);
	return out->line_exposure >= 0 && out->line_exposure <= 1
		       ? 0
		       : node_error(sensor, e, ERANGE, "rolling_shutter_duration=%g is outside [0, 1]",
				    out->line_exposure);
}

static int read_camera(const struct scene_node *sensor, struct scene_settings *out, struct error *e)
{
	out->principal_x = node_float(sensor, "principal_point_offset_x", 0);
	out->principal_y = node_float(sensor, "principal_point_offset_y", 0);
	out->near_clip = node_float(sensor, "near_clip", 1e-2);
	out->far_clip = node_float(sensor, "far_clip", 1e4);
	out->shutter_open = node_float(sensor, "shutter_open", 0);
	out->shutter_close = node_float(sensor, "shutter_close", 0);
	if (!(out->shutter_open <= out->shutter_close))
		return node_error(sensor, e, EINVAL, "shutter_open=%g is after shutter_close=%g", out->shutter_open,
				  out->shutter_close);
	int r = read_rolling_shutter(sensor, out, e);
	if (!r)
		r = read_to_world(sensor, out, e);
	if (r)
		return r;
	if (!(out->near_clip < out->far_clip))
		return node_error(sensor, e, EINVAL, "near_clip=%g is not below far_clip=%g", out->near_clip,
				  out->far_clip);
	bool is_thinlens = strcmp(sensor->type, "thinlens") == 0;
	if (!is_thinlens && strcmp(sensor->type, "telecentric") != 0)
		return 0;
	if (is_thinlens && !node_find_property(sensor, "aperture_radius"))
		return node_error(sensor, e, EINVAL, "a thinlens needs an aperture_radius");
	out->aperture_radius = node_float(sensor, "aperture_radius", 0);
	out->focus_distance = node_float(sensor, "focus_distance", out->far_clip);
	return 0;
}

#define DEFAULT_SENSOR_FOV 45.0

/* The sensor of a scene that has none; scene_settings_place_sensor() gives its position. */
static const struct property default_sensor_properties[] = {
	{"fov", 0, {.type = VALUE_FLOAT, .as.number = DEFAULT_SENSOR_FOV}}};
static const struct scene_node default_sensor = {.cls = PLUGIN_SENSOR,
						 .type = "perspective",
						 .file = "no sensor in the file",
						 .decl = setting_decls,
						 .property_count = 1,
						 .properties = default_sensor_properties};

int scene_settings_place_sensor(struct scene_settings *s, const char *file, vec3 low, vec3 high, struct error *e)
{
	double size = fmax(high.x - low.x, fmax(high.y - low.y, high.z - low.z)),
	       distance = size / (2 * tan(DEFAULT_SENSOR_FOV / 2 / 57.295779513082320877));
	if (!(size > 0))
		return error_set(e, EINVAL,
				 "%.256s: has no <sensor>, and no shape to place one in front of; it looks like a file "
				 "that a scene includes",
				 file);
	s->near_clip = distance / 100;
	s->far_clip = 5 * size + distance;
	s->to_world =
		mat4_translate((vec3){low.x + (high.x - low.x) / 2, low.y + (high.y - low.y) / 2, low.z - distance});
	return 0;
}

const struct scene_node *scene_sensor(const struct scene *s, uint32_t number)
{
	uint32_t sensor_count;
	return find_object(s, PLUGIN_SENSOR, number, &sensor_count);
}

int scene_settings_read(const struct scene *s, uint32_t width, uint32_t height, uint32_t sensor_number,
			struct scene_settings *out, struct error *e)
{
	*out = (struct scene_settings){0};
	uint32_t sensor_count;
	const struct scene_node *sensor = find_object(s, PLUGIN_SENSOR, sensor_number, &sensor_count);
	if (!sensor && (sensor_count || sensor_number > 1))
		return error_set(e, EINVAL, "there is no sensor %u: the scene has %u", sensor_number, sensor_count);
	out->is_unplaced = !sensor;
	if (!sensor)
		sensor = &default_sensor;
	const struct scene_node *sampler = node_child(sensor, PLUGIN_SAMPLER, 0);
	out->spp = sampler ? (uint64_t)node_int(sampler, "sample_count", 0) : 0;
	int r = read_film(sensor, width, height, out, e);
	if (!r)
		r = read_filter(sensor, out, e);
	if (!r)
		r = read_depth(s, out, e);
	if (!r)
		r = read_projection(sensor, out, e);
	if (!r)
		r = read_fov(sensor, out, e);
	return r ? r : read_camera(sensor, out, e);
}
