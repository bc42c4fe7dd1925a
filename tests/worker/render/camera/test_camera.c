/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The pinhole and the thin lens. Projection and direction are inverse to each other, derivatives agree with central
 * differences, fov_axis and principal_point_offset have Mitsuba's meaning, near and far clip along the axis, rays
 * through the lens meet in the plane of focus, and a lens with radius 0 is the pinhole bit for bit.
 */
#include "tests/support/dice.h"
#include "worker/render/camera/camera.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static struct camera make_camera(uint32_t width, uint32_t height, double fov, const char *axis, vec3 origin,
				 vec3 target)
{
	struct scene_settings s = {.width = width, .height = height, .fov = fov, .near_clip = 1e-3, .far_clip = 1e4};
	strcpy(s.fov_axis, axis);
	s.to_world = mat4_look_at(origin, target, (vec3){0, 1, 0});
	struct camera c;
	struct error e = {""};
	if (camera_init(&c, &s, (vec3){0, 0, 0}, 1, &e))
		fail_msg("%s", e.text);
	return c;
}

static void test_projection_inverts_ray_directions(void **state)
{
	(void)state;
	struct dice d = dice_for_test("project direction");
	const double fovs[] = {1e-3, 20, 90, 150, 179};
	for (int i = 0; i < 20000; i++) {
		vec3 o = vec3_scale(3, dice_direction(&d)), t = dice_direction(&d);
		struct camera c = make_camera(320, 200, fovs[i % 5], "x", o, t);
		double x = dice_between(&d, -20, 340), y = dice_between(&d, -20, 220), px, py;
		vec3 w = camera_direction(&c, c.position, x, y);
		assert_true(fabs(vec3_length(w) - 1) < 1e-15);
		assert_true(camera_project(&c, c.position, w, 1, &px, &py));
		/* Rounding of the direction amounts to `pixels_per_slope` / cos^2 pixels. */
		double slack = 8e-16 * (c.pixels_per_slope / pow(vec3_dot(c.axes.n, w), 2) + 400);
		assert_true(fabs(px - x) < slack && fabs(py - y) < slack);
		assert_false(camera_project(&c, c.position, vec3_neg(w), 1, &px, &py));
	}
}

/* Mitsuba 3: the film point (x, y) sees what (x + offset_x width, y + offset_y height) would see without an offset. */
static void test_principal_point_shifts_the_film(void **state)
{
	(void)state;
	struct scene_settings s = {
		.width = 320, .height = 200, .fov = 50, .fov_axis = "x", .near_clip = 1e-3, .far_clip = 1e4};
	s.to_world = mat4_identity();
	struct camera plain, moved;
	struct error e;
	assert_int_equal(camera_init(&plain, &s, (vec3){0, 0, 0}, 1, &e), 0);
	s.principal_x = 0.25;
	s.principal_y = -0.5;
	assert_int_equal(camera_init(&moved, &s, (vec3){0, 0, 0}, 1, &e), 0);
	vec3 a = camera_direction(&moved, moved.position, 30, 170),
	     b = camera_direction(&plain, plain.position, 30 + 80, 170 - 100);
	assert_true(vec3_length(vec3_sub(a, b)) < 1e-15);
	double x, y;
	assert_true(camera_project(&moved, moved.position, a, 1, &x, &y));
	assert_true(fabs(x - 30) < 1e-12 && fabs(y - 170) < 1e-12);
}

/* The solid angle of a small square of the film, from its two tangents. */
static void test_solid_angle_matches_the_tangents(void **state)
{
	(void)state;
	struct dice d = dice_for_test("camera jacobian");
	for (int i = 0; i < 5000; i++) {
		struct camera c = make_camera(64, 48, dice_between(&d, 5, 150), "smaller",
					      vec3_scale(3, dice_direction(&d)), (vec3){0, 0, 0});
		double x = dice_between(&d, 0, 64), y = dice_between(&d, 0, 48), h = 1e-4;
		vec3 dx = vec3_sub(camera_direction(&c, c.position, x + h, y),
				   camera_direction(&c, c.position, x - h, y));
		vec3 dy = vec3_sub(camera_direction(&c, c.position, x, y + h),
				   camera_direction(&c, c.position, x, y - h));
		double solid_from_film = vec3_length(vec3_cross(dx, dy)) / (4 * h * h);
		/* Central differences of step h, with errors h^2 and eps / h. */
		assert_true(
			fabs(camera_jac_film_from_solid(&c, camera_direction(&c, c.position, x, y)) * solid_from_film -
			     1) < 1e-6);
	}
}

/* The angle between the outermost film points along the side that fov_axis names. */
static void test_fov_applies_to_its_axis(void **state)
{
	(void)state;
	static const struct {
		const char *axis;
		uint32_t width, height;
		double x0, y0, x1, y1;
	} cases[] = {
		{"x", 300, 100, 0, 50, 300, 50},	 {"y", 300, 100, 150, 0, 150, 100},
		{"diagonal", 300, 100, 0, 0, 300, 100},	 {"smaller", 300, 100, 150, 0, 150, 100},
		{"smaller", 100, 300, 0, 150, 100, 150}, {"larger", 300, 100, 0, 50, 300, 50},
		{"larger", 100, 300, 50, 0, 50, 300},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
		for (double fov = 10; fov < 180; fov += 30) {
			struct camera c = make_camera(cases[i].width, cases[i].height, fov, cases[i].axis,
						      (vec3){1, 2, 3}, (vec3){0, 0, 0});
			vec3 a = camera_direction(&c, c.position, cases[i].x0, cases[i].y0),
			     b = camera_direction(&c, c.position, cases[i].x1, cases[i].y1);
			assert_true(fabs(acos(vec3_dot(a, b)) * 180 / M_PI - fov) < 1e-6);
		}
}

/* Mitsuba's camera looks along +z, with +x to the LEFT of the image; rows are counted from the top. */
static void test_camera_looks_along_z_with_x_left(void **state)
{
	(void)state;
	struct scene_settings s = {.width = 100,
				   .height = 100,
				   .fov = 90,
				   .near_clip = 0.01,
				   .far_clip = 100,
				   .fov_axis = "x",
				   .to_world = mat4_identity()};
	struct camera c;
	assert_int_equal(camera_init(&c, &s, (vec3){0, 0, 0}, 1, NULL), 0);
	double x, y;
	assert_true(camera_project(&c, c.position, vec3_normalize((vec3){0.5, 0, 1}), 1, &x, &y));
	assert_true(fabs(x - 25) < 1e-12 && fabs(y - 50) < 1e-12);
	assert_true(camera_project(&c, c.position, vec3_normalize((vec3){0, 0.5, 1}), 1, &x, &y));
	assert_true(fabs(x - 50) < 1e-12 && fabs(y - 25) < 1e-12);
	/* From +z towards the origin, y up: world +x is on the right. */
	c = make_camera(100, 100, 90, "x", (vec3){0, 0, 5}, (vec3){0, 0, 0});
	assert_true(camera_project(&c, c.position, vec3_normalize((vec3){1, 1, -5}), sqrt(27), &x, &y));
	assert_true(fabs(x - 60) < 1e-12 && fabs(y - 40) < 1e-12);
	/* A mirrored transform mirrors the picture. */
	s.to_world = mat4_scale((vec3){-1, 1, 1});
	assert_int_equal(camera_init(&c, &s, (vec3){0, 0, 0}, 1, NULL), 0);
	assert_true(camera_project(&c, c.position, vec3_normalize((vec3){0.5, 0, 1}), 1, &x, &y));
	assert_true(fabs(x - 75) < 1e-12);
}

/* Near and far are planes across the axis, in scene units, whatever the scale of the world. */
static void test_clip_planes_are_in_scene_units(void **state)
{
	(void)state;
	struct scene_settings s = {.width = 100,
				   .height = 100,
				   .fov = 90,
				   .near_clip = 2,
				   .far_clip = 8,
				   .fov_axis = "x",
				   .to_world = mat4_identity()};
	struct camera c;
	assert_int_equal(camera_init(&c, &s, (vec3){1, 1, 1}, 0.25, NULL), 0);
	assert_true(c.position.x == -0.25 && c.position.y == -0.25 && c.position.z == -0.25);
	vec3 w = camera_direction(&c, c.position, 0, 100);
	double t0, t1, x, y;
	camera_clip_range(&c, w, &t0, &t1);
	assert_true(fabs(t0 * vec3_dot(w, c.axes.n) - 0.5) < 1e-15 && fabs(t1 * vec3_dot(w, c.axes.n) - 2) < 1e-15);
	assert_true(camera_project(&c, c.position, w, t0 * (1 + 1e-12), &x, &y) &&
		    camera_project(&c, c.position, w, t1 * (1 - 1e-12), &x, &y));
	assert_false(camera_project(&c, c.position, w, t0 * (1 - 1e-12), &x, &y) ||
		     camera_project(&c, c.position, w, t1 * (1 + 1e-12), &x, &y));
}

/* A lens of random radius and focus, and a point of its aperture. */
static struct camera make_lens(struct dice *d, vec3 *x_k)
{
	struct scene_settings s = {.width = 64,
				   .height = 48,
				   .fov = dice_between(d, 5, 150),
				   .fov_axis = "x",
				   .near_clip = 1e-3,
				   .far_clip = 1e4,
				   .aperture_radius = pow(10, dice_between(d, -4, 0)),
				   .focus_distance = pow(10, dice_between(d, -1, 2))};
	s.to_world = mat4_look_at(vec3_scale(3, dice_direction(d)), dice_direction(d), (vec3){0, 1, 0});
	struct camera c;
	struct error e = {""};
	if (camera_init(&c, &s, dice_direction(d), dice_between(d, 0.1, 1), &e))
		fail_msg("%s", e.text);
	assert_true(camera_has_aperture(&c));
	*x_k = camera_sample_point(&c, (double[]){dice_uniform(d), dice_uniform(d)});
	return c;
}

static void test_aperture_is_sampled_evenly(void **state)
{
	(void)state;
	struct dice d = dice_for_test("aperture");
	for (int i = 0; i < 20000; i++) {
		vec3 p;
		struct camera c = make_lens(&d, &p);
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, back[2], h = 1e-5;
		/* Not near the diagonals, where the map has a crease. */
		if (fabs(fabs(u[0] - 0.5) - fabs(u[1] - 0.5)) < 2 * h)
			continue;
		p = camera_sample_point(&c, u);
		vec3 offset = vec3_sub(p, c.position);
		assert_true(vec3_length(offset) <= c.aperture_radius * (1 + 1e-11) &&
			    fabs(vec3_dot(offset, c.axes.n)) < 1e-14);
		camera_point_inverse(&c, p, back);
		assert_true(fabs(back[0] - u[0]) < 1e-15 / c.aperture_radius + 1e-14 &&
			    fabs(back[1] - u[1]) < 1e-15 / c.aperture_radius + 1e-14);
		vec3 du = vec3_sub(camera_sample_point(&c, (double[]){u[0] + h, u[1]}),
				   camera_sample_point(&c, (double[]){u[0] - h, u[1]}));
		vec3 dv = vec3_sub(camera_sample_point(&c, (double[]){u[0], u[1] + h}),
				   camera_sample_point(&c, (double[]){u[0], u[1] - h}));
		double area = vec3_length(vec3_cross(du, dv)) / (4 * h * h);
		assert_true(fabs(area / (M_PI * c.aperture_radius * c.aperture_radius) - 1) < 1e-4);
	}
	/* Corners and centre stay within [0,1). */
	vec3 p;
	struct camera c = make_lens(&d, &p);
	const double ends[] = {0, 0.5, 1 - 0x1p-53};
	for (int i = 0; i < 9; i++) {
		double u[2];
		camera_point_inverse(&c, camera_sample_point(&c, (double[]){ends[i % 3], ends[i / 3]}), u);
		assert_true(u[0] >= 0 && u[0] < 1 && u[1] >= 0 && u[1] < 1);
		assert_true(fabs(u[0] - ends[i % 3]) < 1e-9 && fabs(u[1] - ends[i / 3]) < 1e-9);
	}
}

/* The rays of a film point meet in the plane of focus, and the rays of a point in that plane are projected to one film
 * point. */
static void test_rays_meet_in_the_plane_of_focus(void **state)
{
	(void)state;
	struct dice d = dice_for_test("lens");
	for (int i = 0; i < 20000; i++) {
		vec3 x_k;
		struct camera c = make_lens(&d, &x_k);
		double x = dice_between(&d, -5, 70), y = dice_between(&d, -5, 50), px, py, h = 1e-4;
		vec3 w = camera_direction(&c, x_k, x, y), through = camera_direction(&c, c.position, x, y);
		assert_true(fabs(vec3_length(w) - 1) < 1e-15 && vec3_dot(w, c.axes.n) > 0);
		vec3 a = vec3_madd(x_k, c.focus_distance / vec3_dot(w, c.axes.n), w);
		vec3 b = vec3_madd(c.position, c.focus_distance / vec3_dot(through, c.axes.n), through);
		assert_true(vec3_length(vec3_sub(a, b)) <
			    1e-12 * (c.focus_distance + c.aperture_radius) /
				    fmin(vec3_dot(through, c.axes.n), vec3_dot(w, c.axes.n)));
		double slack = 1e-14 * (c.pixels_per_slope / pow(vec3_dot(c.axes.n, w), 2) + 400 +
					c.pixels_per_slope * c.aperture_radius / c.focus_distance);
		assert_true(camera_project(&c, x_k, w, 1, &px, &py));
		assert_true(fabs(px - x) < slack && fabs(py - y) < slack);
		if (vec3_dot(w, c.axes.n) < 0.05)
			continue;
		vec3 dx = vec3_sub(camera_direction(&c, x_k, x + h, y), camera_direction(&c, x_k, x - h, y));
		vec3 dy = vec3_sub(camera_direction(&c, x_k, x, y + h), camera_direction(&c, x_k, x, y - h));
		double solid_from_film = vec3_length(vec3_cross(dx, dy)) / (4 * h * h);
		assert_true(fabs(camera_jac_film_from_solid(&c, w) * solid_from_film - 1) < 1e-5);
	}
}

/* A lens with radius 0 is the pinhole, bit for bit, wherever it is focused. */
static void test_closed_lens_equals_a_pinhole(void **state)
{
	(void)state;
	struct scene_settings s = {
		.width = 64, .height = 48, .fov = 50, .fov_axis = "x", .near_clip = 1e-3, .far_clip = 1e4};
	s.to_world = mat4_look_at((vec3){1, 2, 3}, (vec3){0, 0.5, 0}, (vec3){0, 1, 0});
	struct camera pinhole, lens;
	assert_int_equal(camera_init(&pinhole, &s, (vec3){0.3, 0, 0}, 0.5, NULL), 0);
	s.focus_distance = 0.7;
	assert_int_equal(camera_init(&lens, &s, (vec3){0.3, 0, 0}, 0.5, NULL), 0);
	assert_false(camera_has_aperture(&lens));
	struct dice d = dice_for_test("closed lens");
	for (int i = 0; i < 1000; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, x = dice_between(&d, 0, 64),
		       y = dice_between(&d, 0, 48), p[2], q[2];
		vec3 x_k = camera_sample_point(&lens, u), v = camera_direction(&pinhole, pinhole.position, x, y),
		     w = camera_direction(&lens, x_k, x, y);
		assert_true(x_k.x == pinhole.position.x && x_k.y == pinhole.position.y && x_k.z == pinhole.position.z);
		assert_true(v.x == w.x && v.y == w.y && v.z == w.z);
		assert_true(camera_project(&pinhole, x_k, v, 1, &p[0], &p[1]) &&
			    camera_project(&lens, x_k, v, 1, &q[0], &q[1]));
		assert_true(p[0] == q[0] && p[1] == q[1]);
		camera_point_inverse(&lens, x_k, u);
		assert_true(u[0] == 0.5 && u[1] == 0.5);
	}
}

static void test_invalid_cameras_are_refused(void **state)
{
	(void)state;
	struct scene_settings s = {
		.width = 8, .height = 8, .fov = 40, .fov_axis = "x", .to_world = mat4_scale((vec3){1, 0, 1})};
	struct camera c;
	struct error e;
	assert_int_equal(camera_init(&c, &s, (vec3){0, 0, 0}, 1, &e), -EINVAL);
	s.to_world = mat4_identity();
	const double bad[] = {0, -1, 180, NAN, INFINITY};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		s.fov = bad[i];
		assert_int_equal(camera_init(&c, &s, (vec3){0, 0, 0}, 1, &e), -EINVAL);
	}
	s.fov = 40;
	s.aperture_radius = 0.1;
	assert_int_equal(camera_init(&c, &s, (vec3){0, 0, 0}, 1, &e), -EINVAL);
	s.focus_distance = 1;
	assert_int_equal(camera_init(&c, &s, (vec3){0, 0, 0}, 1, &e), 0);
	s.aperture_radius = -0.1;
	assert_int_equal(camera_init(&c, &s, (vec3){0, 0, 0}, 1, &e), -EINVAL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_projection_inverts_ray_directions),
		cmocka_unit_test(test_principal_point_shifts_the_film),
		cmocka_unit_test(test_solid_angle_matches_the_tangents),
		cmocka_unit_test(test_fov_applies_to_its_axis),
		cmocka_unit_test(test_camera_looks_along_z_with_x_left),
		cmocka_unit_test(test_clip_planes_are_in_scene_units),
		cmocka_unit_test(test_invalid_cameras_are_refused),
		cmocka_unit_test(test_aperture_is_sampled_evenly),
		cmocka_unit_test(test_rays_meet_in_the_plane_of_focus),
		cmocka_unit_test(test_closed_lens_equals_a_pinhole),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
