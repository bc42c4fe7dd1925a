/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Cameras, and lights of KHR_lights_punctual. Both look along -z with y up; the sensors and spots of the scene language
 * look along z, with x to the left. Candela and lux are used as radiant intensity and irradiance, and emission, which
 * the format has in nits, as radiance. Blender's exporter writes emission unchanged but multiplies the watts of lamps
 * by 683 lumens per watt. In its files lamps are divided by that number: otherwise they would be 683 times too bright
 * compared with emission. Missing objects are supplied with a note: a camera that sees the whole scene, an environment
 * of radiance 1.
 */
#include "worker/render/gltf/gltf_light.h"

#include <string.h>

enum { FILM_WIDTH = 768 };
static const double degrees_per_radian = 180 / M_PI;

/* Returns the transform turned to look along z, with axes of unit length: a camera or light has no size. */
static mat4 turn_to_look_along_z(const mat4 *to_world)
{
	mat4 m = *to_world;
	for (int j = 0; j < 3; j++) {
		double length = sqrt(m.m[0][j] * m.m[0][j] + m.m[1][j] * m.m[1][j] + m.m[2][j] * m.m[2][j]);
		double scale = (j == 1 ? 1 : -1) / (length > 0 ? length : 1);
		for (int i = 0; i < 3; i++)
			m.m[i][j] *= scale;
	}
	return m;
}

static void put_film(struct gltf *g, struct xml_element *sensor, const struct gltf_entry *entry, double aspect)
{
	struct xml_element *film = gltf_add_plugin(g, sensor, entry, "film", "hdrfilm", NULL);
	gltf_put_integer(g, film, entry, "width", FILM_WIDTH);
	gltf_put_integer(g, film, entry, "height",
			 (uint64_t)fmin(fmax(round(FILM_WIDTH / aspect), 1), 16 * FILM_WIDTH));
}

static void put_perspective(struct gltf *g, const struct gltf_entry *entry, const mat4 *to_world, double fov,
			    double aspect)
{
	struct xml_element *sensor = gltf_add_plugin(g, g->scene, entry, "sensor", "perspective", NULL);
	mat4 m = turn_to_look_along_z(to_world);
	gltf_put_number(g, sensor, entry, "fov", fov * degrees_per_radian);
	gltf_put_string(g, sensor, entry, "fov_axis", "y");
	gltf_put_matrix(g, sensor, entry, "to_world", &m);
	put_film(g, sensor, entry, aspect);
	g->has_camera = true;
}

void gltf_add_camera(struct gltf *g, const struct gltf_entry *camera, const mat4 *to_world)
{
	const json_t *perspective = gltf_object(g, camera, camera->json, "perspective"),
		     *orthographic = gltf_object(g, camera, camera->json, "orthographic");
	if (perspective) {
		double aspect = gltf_number(g, camera, perspective, "aspectRatio", 16.0 / 9);
		put_perspective(g, camera, to_world, gltf_number(g, camera, perspective, "yfov", 1),
				aspect > 0 ? aspect : 1);
		return;
	}
	if (!orthographic) {
		gltf_fail(g, camera, EINVAL, "a camera that is neither perspective nor orthographic");
		return;
	}
	double xmag = gltf_number(g, camera, orthographic, "xmag", 1),
	       ymag = gltf_number(g, camera, orthographic, "ymag", 1), x = fabs(xmag), y = fabs(ymag);
	if (!(x > 0 && y > 0)) {
		gltf_fail(g, camera, EINVAL, "xmag and ymag must not be 0");
		return;
	}
	if (xmag < 0 || ymag < 0)
		gltf_note(g, "the signs of xmag and ymag are ignored: cameras do not mirror the image");
	struct xml_element *sensor = gltf_add_plugin(g, g->scene, camera, "sensor", "orthographic", NULL);
	mat4 m = mat4_mul(turn_to_look_along_z(to_world), mat4_scale((vec3){x, x, 1}));
	gltf_put_matrix(g, sensor, camera, "to_world", &m);
	put_film(g, sensor, camera, x / y);
	g->has_camera = true;
}

void gltf_add_light(struct gltf *g, const struct gltf_entry *light, const mat4 *to_world)
{
	double rgb[3] = {1, 1, 1}, intensity = gltf_number(g, light, light->json, "intensity", 1);
	const char *type = gltf_string(g, light, light->json, "type", "");
	gltf_numbers(g, light, light->json, "color", rgb, 3);
	for (int k = 0; k < 3; k++)
		rgb[k] *= intensity * g->lamp_scale;
	mat4 m = turn_to_look_along_z(to_world);
	g->has_light = true;
	if (g->lamp_scale != 1)
		gltf_note(
			g,
			"lamps are divided by 683, by which Blender multiplies them in its lighting mode \"Standard\"; "
			"files that it writes in another mode are too dark");
	if (json_object_get(light->json, "range"))
		gltf_note(g, "ranges of lights are ignored: intensity falls off with the square of the distance");
	bool is_directional = strcmp(type, "directional") == 0, is_spot = strcmp(type, "spot") == 0;
	if (!is_directional && !is_spot && strcmp(type, "point") != 0) {
		gltf_fail(g, light, EINVAL, "a light of type \"%.32s\"", type);
		return;
	}
	const json_t *cone = is_spot ? gltf_object(g, light, light->json, "spot") : NULL;
	struct xml_element *el = gltf_add_plugin(g, g->scene, light, "emitter", type, NULL);
	gltf_put_rgb(g, el, light, is_directional ? "irradiance" : "intensity", rgb);
	gltf_put_matrix(g, el, light, "to_world", &m);
	if (is_spot) {
		gltf_put_number(g, el, light, "beam_width",
				degrees_per_radian * gltf_number(g, light, cone, "innerConeAngle", 0));
		gltf_put_number(g, el, light, "cutoff_angle",
				degrees_per_radian * gltf_number(g, light, cone, "outerConeAngle", M_PI / 4));
	}
}

void gltf_add_default_camera(struct gltf *g)
{
	static const double fov = 40 / (180 / M_PI);
	vec3 center = vec3_scale(0.5, vec3_add(g->box_min, g->box_max));
	double radius = 0.5 * vec3_length(vec3_sub(g->box_max, g->box_min));
	if (!(g->box_min.x <= g->box_max.x)) {
		gltf_fail(g, NULL, EINVAL, "there is no mesh of triangles in its scene");
		return;
	}
	if (!vec3_is_finite(center) || !(radius > 0))
		return; /* The accessors do not tell its size: scene_settings_place_sensor() places a sensor. */
	vec3 direction = vec3_normalize((vec3){0.5, 0.4, 1});
	mat4 look = mat4_look_at(vec3_madd(center, radius / sin(fov / 2), direction), center, (vec3){0, 1, 0});
	mat4 half_turn = mat4_scale((vec3){-1, 1, -1}), m = mat4_mul(look, half_turn);
	gltf_note(g, "it has no camera: one that sees everything is used");
	put_perspective(g, NULL, &m, fov, 4.0 / 3);
}

void gltf_add_default_light(struct gltf *g)
{
	struct xml_element *el = gltf_add_plugin(g, g->scene, NULL, "emitter", "constant", NULL);
	gltf_put_number(g, el, NULL, "radiance", 1);
	gltf_note(g, "it has no light, or none brighter than 1: a constant environment of radiance 1 is used");
}
