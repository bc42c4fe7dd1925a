/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The other cameras of 0.6, each compared with its definition: the axes and the density of the panorama, the polynomial
 * of the distorted pinhole, the cones of the telecentric lens. Exact but for rounding; derivatives by central
 * differences, solid angles by quadrature.
 */
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"
#include "worker/render/camera/camera.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 64, HEIGHT = 40 };

static struct scene_settings make_settings(enum scene_projection projection, double k0, double k1)
{
	return (struct scene_settings){.width = WIDTH,
				       .height = HEIGHT,
				       .border = 2,
				       .fov = 70,
				       .fov_axis = "x",
				       .near_clip = 1e-3,
				       .far_clip = 1e4,
				       .projection = projection,
				       .distortion = {k0, k1},
				       .to_world = mat4_identity()};
}

static struct camera make_camera(const struct scene_settings *s)
{
	struct camera c;
	struct error e = {""};
	if (camera_init(&c, s, (vec3){0.1, 0, 0}, 0.5, &e))
		fail_msg("%s", e.text);
	return c;
}

static vec3 film_direction(const struct camera *c, double x, double y)
{
	return camera_direction(c, c->position, x, y);
}

/* The map between film points and directions is one-to-one; the density is that of small squares of the film. */
static void check_film_map(const struct camera *c, const char *name)
{
	struct dice d = dice_for_test(name);
	for (int i = 0; i < 5000; i++) {
		double x = dice_between(&d, 0.01, WIDTH - 0.01), y = dice_between(&d, 0.01, HEIGHT - 0.01), px, py,
		       h = 1e-5;
		vec3 w = film_direction(c, x, y);
		assert_true(camera_film_point_is_valid(c, x, y) && camera_sees_direction(c, w) &&
			    fabs(vec3_length(w) - 1) < 1e-15);
		assert_true(camera_project(c, c->position, w, 1, &px, &py));
		double slack = 1e-14 * (1 + camera_jac_film_from_solid(c, w));
		if (!(fabs(px - x) < slack && fabs(py - y) < slack))
			fail_msg("%s: (%.17g, %.17g) becomes (%.17g, %.17g)", name, x, y, px, py);
		vec3 dx = vec3_sub(film_direction(c, x + h, y), film_direction(c, x - h, y)),
		     dy = vec3_sub(film_direction(c, x, y + h), film_direction(c, x, y - h));
		double solid = vec3_length(vec3_cross(dx, dy)) / (4 * h * h);
		assert_true(fabs(camera_jac_film_from_solid(c, w) * solid - 1) < 1e-5);
	}
}

/* Returns the sum of the solid angles of all pixels. */
static double film_solid_angle(const struct camera *c)
{
	enum { FINE = 20 };
	double sum = 0;
	for (int i = 0; i < WIDTH * FINE * HEIGHT * FINE; i++)
		sum += 1 / (FINE * FINE *
			    camera_jac_film_from_solid(c, film_direction(c, (i % (WIDTH * FINE) + 0.5) / FINE,
									 (i / (WIDTH * FINE) + 0.5) / FINE)));
	return sum;
}

static void assert_direction(const struct camera *c, double x, double y, vec3 d)
{
	if (!(vec3_length(vec3_sub(film_direction(c, x, y), d)) < 1e-14))
		fail_msg("(%g, %g) looks along %g %g %g", x, y, film_direction(c, x, y).x, film_direction(c, x, y).y,
			 film_direction(c, x, y).z);
}

/* +z is in the middle, +x (left) a quarter from the left, +y (up) at the top. */
static void test_panorama_has_its_orientation(void **state)
{
	(void)state;
	struct scene_settings s = make_settings(PROJECTION_SPHERE, 0, 0);
	struct camera c = make_camera(&s);
	assert_direction(&c, 0.5 * WIDTH, 0.5 * HEIGHT, (vec3){0, 0, 1});
	assert_direction(&c, 0.25 * WIDTH, 0.5 * HEIGHT, (vec3){1, 0, 0});
	assert_direction(&c, 0, 0.5 * HEIGHT, (vec3){0, 0, -1});
	assert_direction(&c, 0.5 * WIDTH, 0.25 * HEIGHT, (vec3){0, sqrt(0.5), sqrt(0.5)});
	s.to_world = mat4_look_at((vec3){0, 0, 0}, (vec3){1, 0, 0}, (vec3){0, 0, 1});
	struct camera turned = make_camera(&s);
	assert_direction(&turned, 0.5 * WIDTH, 0.5 * HEIGHT, (vec3){1, 0, 0});
	assert_direction(&turned, 0.75 * WIDTH, 0.5 * HEIGHT, (vec3){0, -1, 0});
	check_film_map(&c, "panorama");
	check_film_map(&turned, "panorama, turned");
	assert_true(fabs(film_solid_angle(&c) / (4 * M_PI) - 1) < 1e-5);
	assert_false(camera_film_point_is_valid(&c, -0.1, 3) || camera_film_point_is_valid(&c, WIDTH, 3) ||
		     camera_film_point_is_valid(&c, 3, -0.1) || camera_film_point_is_valid(&c, 3, HEIGHT));
	/* There are no clipping planes. */
	double low, high, x = 0, y = 0;
	camera_clip_range(&c, (vec3){0, 0, -1}, &low, &high);
	assert_true(low == 0 && high == INFINITY && camera_project(&c, c.position, (vec3){0, 0.6, -0.8}, 1e-9, &x, &y));
	assert_true(x == 0 && y > 0 && y < 0.5 * HEIGHT);
}

/* The motion of the point seen at a distance as the film point changes; only its component across the ray matters. */
static void test_film_tangents_match_motion(void **state)
{
	(void)state;
	struct scene_settings s = make_settings(PROJECTION_SPHERE, 0, 0), plane = make_settings(PROJECTION_PLANE, 0, 0);
	const struct camera cameras[] = {make_camera(&s), make_camera(&plane)};
	struct dice d = dice_for_test("pixels");
	for (int i = 0; i < 4000; i++) {
		const struct camera *c = &cameras[i % 2];
		double x = dice_between(&d, 1, WIDTH - 1), y = dice_between(&d, 1, HEIGHT - 1), h = 1e-4, length[2];
		vec3 w = film_direction(c, x, y), axis[2];
		camera_pixel_footprint(c, w, 3, axis, length);
		const vec3 is[2] = {vec3_sub(film_direction(c, x + h, y), film_direction(c, x - h, y)),
				    vec3_sub(film_direction(c, x, y + h), film_direction(c, x, y - h))};
		for (int k = 0; k < 2; k++) {
			vec3 want = vec3_scale(3 / (2 * h), is[k]),
			     across = vec3_scale(length[k], vec3_madd(axis[k], -vec3_dot(axis[k], w), w));
			assert_true(fabs(vec3_length(axis[k]) - 1) < 1e-12);
			if (!(vec3_length(vec3_sub(want, across)) < 1e-5 * vec3_length(want)))
				fail_msg("%d, axis %d: %g for %g", i % 2, k, vec3_length(across), vec3_length(want));
		}
	}
}

/* A point that a plain pinhole images at the slope r from the axis is imaged at r (1 + a r^2 + b r^4), for barrel and
 * pincushion distortion. */
static void test_distortion_moves_film_points(void **state)
{
	(void)state;
	static const double kc[][2] = {{0.3, 0}, {0.1, 0.2}, {-0.15, 0.01}, {-0.1, -0.02}, {0, -0.05}, {-0.3, 0.2}};
	struct scene_settings s = make_settings(PROJECTION_PLANE, 0, 0);
	struct camera plain = make_camera(&s);
	for (size_t k = 0; k < sizeof kc / sizeof *kc; k++) {
		struct dice d = dice_for_test("distortion");
		s = make_settings(PROJECTION_DISTORTED, kc[k][0], kc[k][1]);
		s.principal_x = 0.05;
		struct camera c = make_camera(&s);
		check_film_map(&c, "distortion");
		for (int i = 0; i < 2000; i++) {
			double r = dice_between(&d, 0, 0.8), turn = dice_between(&d, 0, 7), px, py;
			vec3 w = vec3_normalize((vec3){r * cos(turn), r * sin(turn), 1});
			double at = r * (1 + kc[k][0] * r * r + kc[k][1] * r * r * r * r) * plain.pixels_per_slope;
			assert_true(camera_project(&c, c.position, w, 1, &px, &py));
			assert_true(fabs(px - (0.45 * WIDTH - at * cos(turn))) < 1e-12 * WIDTH &&
				    fabs(py - (0.5 * HEIGHT - at * sin(turn))) < 1e-12 * WIDTH);
		}
	}
	/* With the factor 1 - r^2 / 3, the image ends at r = 1, which must be outside the film. */
	s = make_settings(PROJECTION_DISTORTED, -1.0 / 3, 0);
	s.fov = 40;
	struct camera c = make_camera(&s);
	double x, y;
	assert_true(camera_project(&c, c.position, vec3_normalize((vec3){0.999, 0, 1}), 1, &x, &y));
	assert_false(camera_project(&c, c.position, vec3_normalize((vec3){1.001, 0, 1}), 1, &x, &y));
	s.fov = 80;
	struct error e;
	assert_int_equal(camera_init(&c, &s, (vec3){0, 0, 0}, 1, &e), -EINVAL);
	assert_non_null(strstr(e.text, "kc folds the image over at the slope 0.66"));
}

/* At the distance z from the lens, the rays of one film point are distributed evenly over a disk of radius R |1 - z /
 * f|: second moments are compared with R^2 / 4, and the largest distance with R. */
static void test_telecentric_rays_fill_their_disk(void **state)
{
	(void)state;
	enum { RAYS = 40000 };
	struct scene_settings s = make_settings(PROJECTION_PLANE, 0, 0);
	s.half_width = 2;
	s.aperture_radius = 0.3;
	s.focus_distance = 4;
	struct camera c = make_camera(&s);
	const double unit = 0.5, at[] = {0, 1.5, 4, 7};
	assert_true(camera_has_aperture(&c));
	for (int k = 0; k < 4; k++) {
		struct dice d = dice_for_test("telecentric");
		double x = 13, y = 29, radius = 0.3 * fabs(1 - at[k] / 4), moments[3] = {0}, most = 0;
		/* +x is to the left in the image; the film is 4 units wide. */
		vec3 middle = {2 - 4 * x / WIDTH, 4 * (0.5 * HEIGHT - y) / WIDTH, at[k]};
		for (int i = 0; i < RAYS; i++) {
			vec3 p = camera_sample_point(&c, (double[]){dice_uniform(&d), dice_uniform(&d)});
			vec3 w = camera_direction(&c, p, x, y);
			double t = (at[k] * unit - p.z) / w.z;
			vec3 q = vec3_scale(1 / unit, vec3_madd(p, t, w));
			q.x += 0.1; /* offset of the centre of the world */
			vec3 off = vec3_sub(q, middle);
			moments[0] += off.x * off.x / RAYS;
			moments[1] += off.y * off.y / RAYS;
			moments[2] += off.x * off.y / RAYS;
			most = fmax(most, hypot(off.x, off.y));
			double px, py;
			assert_true(camera_project(&c, p, w, t, &px, &py) || at[k] == 0);
			assert_true(at[k] == 0 || (fabs(px - x) < 1e-6 && fabs(py - y) < 1e-6));
		}
		/* The point is 7 units nearer to a pinhole at a distance of 2^20 units. */
		double slack = 1e-5, quarter = radius * radius / 4;
		assert_true(most < radius + slack && most > 0.99 * radius - slack);
		assert_true(fabs(moments[0] - quarter) < 0.02 * quarter + slack * slack &&
			    fabs(moments[1] - quarter) < 0.02 * quarter + slack * slack &&
			    fabs(moments[2]) < 0.02 * quarter + slack * slack);
	}
	/* Pixels per solid angle are those of the plane of focus, seen from the lens. */
	vec3 axis = {0, 0, 1};
	double distance = c.focus_distance, per_area = camera_jac_film_from_solid(&c, axis) / (distance * distance);
	assert_true(fabs(per_area * 4 * 4 * unit * unit / (WIDTH * WIDTH) - 1) < 1e-5);
}

static void expect_refused(const char *body, const char *sentence)
{
	char xml[1024];
	int n = snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", body);
	world_check_files_refused((const struct memory_file[]){{"s.xml", xml, (size_t)n}, {NULL, NULL, 0}}, sentence);
}

static void test_invalid_projections_are_refused(void **state)
{
	(void)state;
#define SENSOR_OF(type, inner) \
	"<emitter type='constant'/><shape type='cube'/><sensor type='" type "'>" inner "</sensor>"
	static const struct {
		const char *sensor, *sentence;
	} cases[] = {
		{SENSOR_OF("perspective_rdist", "<string name='kc' value='0.1'/>"), "is not two numbers"},
		{SENSOR_OF("perspective_rdist", "<string name='kc' value='0.1, 0.2, 0.3'/>"), "is not two numbers"},
		{SENSOR_OF("perspective_rdist", "<string name='kc' value='a, b'/>"), "is not two numbers"},
		{SENSOR_OF("perspective_rdist", "<string name='kc' value='-9, 0'/>"), "folds the image over"},
		{SENSOR_OF("perspective_rdist", "<string name='kc' value='1e7, 0'/>"), "is outside"},
		{SENSOR_OF("telecentric", "<float name='aperture_radius' value='-1'/>"), "aperture_radius"},
		{SENSOR_OF("telecentric", "<float name='focus_distance' value='0'/>"), "focus_distance"},
		{SENSOR_OF("telecentric", "<transform name='to_world'><scale x='2'/></transform>"), "square pixels"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		expect_refused(cases[i].sensor, cases[i].sentence);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_panorama_has_its_orientation),
		cmocka_unit_test(test_film_tangents_match_motion),
		cmocka_unit_test(test_distortion_moves_film_points),
		cmocka_unit_test(test_telecentric_rays_fill_their_disk),
		cmocka_unit_test(test_invalid_projections_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
