/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `spherical` of 0.5/0.6: a panorama of all directions, by longitude and latitude. With u and v from 0 to 1 over the
 * film, phi = 2 pi u and theta = pi v, a film point sees the direction (sin phi sin theta, cos theta, -cos phi sin
 * theta) in Mitsuba's axes (left, up, forward), as `envmap` has it: to_world's +z is in the middle. W H pixels for 2
 * pi^2 of phi and theta are W H / (2 pi^2 sin theta) pixels per solid angle.
 *
 * Film points beyond an edge see no direction, since each direction would have a second film point otherwise. Filters
 * wrap around at the edges instead (worker/render/film/sums.h).
 */
#include "worker/render/camera/camera.h"
#include "worker/render/camera/projection.h"

static bool direction(const struct camera *c, double film_x, double film_y, vec3 *l)
{
	double phi = 2 * M_PI * film_x / c->width, theta = M_PI * film_y / c->height;
	if (!(film_x >= 0 && film_x < c->width && film_y > 0 && film_y < c->height))
		return false;
	*l = (vec3){-sin(theta) * sin(phi), -cos(theta), -sin(theta) * cos(phi)};
	return true;
}

static bool project(const struct camera *c, vec3 l, double *film_x, double *film_y)
{
	double sine = hypot(l.x, l.z), longitude = atan2(-l.x, -l.z) / (2 * M_PI);
	if (!(sine > 0))
		return false;
	double x = (longitude < 0 ? longitude + 1 : longitude) * c->width, y = atan2(sine, -l.y) / M_PI * c->height;
	*film_x = x;
	*film_y = y;
	return x < c->width && y > 0 && y < c->height;
}

static double jac_film_from_solid(const struct camera *c, vec3 l)
{
	return c->width * c->height / (2 * M_PI * M_PI * hypot(l.x, l.z));
}

static void pixel_footprint(const struct camera *c, vec3 l, vec3 tangent[2], double rate[2])
{
	double sine = hypot(l.x, l.z);
	tangent[0] = (vec3){l.z / sine, 0, -l.x / sine};
	tangent[1] = (vec3){-l.y * l.x / sine, sine, -l.y * l.z / sine};
	rate[0] = 2 * M_PI * sine / c->width;
	rate[1] = M_PI / c->height;
}

const struct camera_projection camera_projection_spherical = {
	.sees_all_directions = true,
	.direction = direction,
	.project = project,
	.jac_film_from_solid = jac_film_from_solid,
	.pixel_footprint = pixel_footprint,
};
