/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Projected pictures: a projector is the inverse of a camera at its position, a plane across its axis is lit evenly by
 * a constant picture, and the texture of a spot light fills the square around its cone. Exact but for rounding; powers
 * are estimated with 200,000 directions of the sphere, to 5 %, about five standard errors.
 */
#include "worker/render/render.h"
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/pictures.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 4, HEIGHT = 2 };
static const struct wavelengths grey = {.is_grey = true};
static const double pixel_values[WIDTH * HEIGHT] = {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1};

/* clang-format off */
#define LOOK "<transform name='to_world'><lookat origin='1,2,3' target='9,1,-1' up='0,1,0.2'/></transform>"
#define PICTURE(name)                                                                                                           \
	"<texture type='bitmap' name='" name "'><string name='filename' value='p.hdr'/><boolean name='raw' value='true'/>"     \
	"<string name='filter_type' value='nearest'/></texture>"
/* clang-format on */

/* A sphere at (10, 0, 0) seen by a camera at LOOK, 40 degrees wide, with `emitters`; p.hdr is the picture. */
static struct world *make_world(const char *emitters)
{
	static char text[4096];
	double rgb[WIDTH * HEIGHT * 3];
	for (int i = 0; i < WIDTH * HEIGHT * 3; i++)
		rgb[i] = pixel_values[i / 3];
	struct pictures pictures = {.count = 0};
	pictures_add(&pictures, WIDTH, HEIGHT, rgb);
	snprintf(
		text, sizeof text,
		"<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='40'/>" LOOK
		"<film type='hdrfilm'><rfilter type='box'/></film></sensor>%s<shape type='sphere'><point name='center' x='10' "
		"y='0' z='0'/><float name='radius' value='4'/></shape></scene>",
		emitters);
	const struct memory_file files[] = {{"s.xml", text, strlen(text)},
					    {"p.hdr", pictures.file[0].bytes, pictures.file[0].size},
					    {NULL, NULL, 0}};
	struct world *w = world_from_files(64, 32, files);
	pictures_fini(&pictures);
	return w;
}

static double radiance(const struct world *w, int i, vec3 d)
{
	const struct emitter *em = &w->emitters[i];
	struct emitter_point x;
	double pdf;
	assert_true(em->is_delta && em->ops->sample_point(em, (double[]){0.5, 0.5}, &x, &pdf) && pdf == 1);
	return em->ops->radiance(em, &x, d, &grey).v[0] / (w->scale * w->scale);
}

/* The film of the camera has the shape of the picture, so that a film point sees the same point of the picture. */
static void test_projection_matches_the_camera(void **state)
{
	(void)state;
	struct world *w = make_world("<emitter type='projector'><float name='fov' value='40'/>" LOOK PICTURE(
		"irradiance") "<float name='scale' value='3'/></emitter>");
	const struct camera *c = &w->camera;
	struct dice dice = dice_for_test("projected_camera");
	vec3 axis = c->axes.n;
	int lit = 0;
	for (int i = 0; i < 20000; i++) {
		double film_x, film_y;
		vec3 d = vec3_normalize(vec3_madd(axis, 0.6, dice_direction(&dice)));
		double z = vec3_dot(d, axis), expected = 0;
		if (camera_project(c, c->position, d, 1, &film_x, &film_y) && film_x >= 0 && film_x < 64 &&
		    film_y >= 0 && film_y < 32)
			expected =
				M_PI * 3 * pixel_values[(int)(film_y / 16) * WIDTH + (int)(film_x / 16)] / (z * z * z);
		double got = radiance(w, 0, d);
		assert_true(fabs(got - expected) <= 1e-9 * expected);
		lit += got > 0;
	}
	assert_true(lit > 2000);
	world_free(w);
}

/* The irradiance of a plane at distance z is the intensity times the cosine over the square of the distance. */
static void test_irradiance_falls_off_with_the_square(void **state)
{
	(void)state;
	struct world *w = make_world("<emitter type='projector'><float name='fov' value='90'/>" LOOK
				     "<float name='irradiance' value='0.7'/></emitter>");
	struct dice dice = dice_for_test("projected_plane");
	const struct frame *f = &w->camera.axes;
	for (int i = 0; i < 1000; i++) {
		double z = dice_between(&dice, 0.1, 5);
		vec3 l = {z * dice_between(&dice, -1, 1), z * dice_between(&dice, -1, 1), z}, d;
		d = frame_to_world(f, l);
		double length = vec3_length(d);
		double got = radiance(w, 0, vec3_scale(1 / length, d)) * (z / length) / (length * length);
		assert_true(fabs(got - M_PI * 0.7 / (z * z)) < 1e-12 * got);
	}
	world_free(w);
}

/* Directions are sampled with their density, and carry all the light. */
static void test_directions_follow_their_density(void **state)
{
	(void)state;
	struct world *w = make_world("<emitter type='projector'><float name='fov' value='70'/>" LOOK PICTURE(
		"irradiance") "</emitter><emitter type='spot'>" LOOK PICTURE("texture") "</emitter>");
	struct dice dice = dice_for_test("projected_directions");
	enum { N = 200000 };
	for (int k = 0; k < 2; k++) {
		const struct emitter *em = &w->emitters[k];
		struct emitter_point x;
		double pdf, sum = 0, all = 0, mass = 0;
		assert_true(em->ops->sample_point(em, (double[]){0, 0}, &x, &pdf));
		for (int i = 0; i < N; i++) {
			double u[2] = {dice_uniform(&dice), dice_uniform(&dice)};
			vec3 d;
			assert_true(em->ops->sample_direction(em, &x, u, &d, &pdf));
			assert_true(fabs(vec3_length(d) - 1) < 1e-14);
			double again = em->ops->pdf_direction(em, &x, d);
			/* On the edge, the intensity may round to 0. */
			assert_true(fabs(again - pdf) < 1e-9 * pdf || again == 0);
			sum += radiance(w, k, d) / pdf / N;
			d = dice_direction(&dice);
			all += radiance(w, k, d) * 4 * M_PI / N;
			mass += em->ops->pdf_direction(em, &x, d) * 4 * M_PI / N;
		}
		print_message("%s: power %.4g, over the sphere %.4g, density %.4g\n", em->ops->decl.type, sum, all,
			      mass);
		assert_true(fabs(all / sum - 1) < 0.05 && fabs(mass - 1) < 0.05);
		assert_true(em->power >= sum * w->scale * w->scale *
						 color_mean(&(struct color){
							 .kind = COLOR_KIND_D65, .scale = 1, .is_times_d65 = true}));
		assert_true(em->is_textured && em->brightness_bound > 0);
	}
	world_free(w);
}

/* On a plane across the axis, the square of the texture touches the cone; the texture multiplies the intensity. */
static void test_spot_texture_touches_the_cone(void **state)
{
	(void)state;
	struct world *w = make_world("<emitter type='spot'>" LOOK PICTURE(
		"texture") "<float name='cutoff_angle' value='35'/></emitter>"
			   "<emitter type='spot'>" LOOK "<float name='cutoff_angle' value='35'/></emitter>"
			   "<emitter type='spot'>" LOOK
			   "<rgb name='texture' value='0.5'/><float name='cutoff_angle' value='35'/></emitter>");
	struct dice dice = dice_for_test("projected_spot");
	/* The camera's x and y point against those of to_world. */
	const struct frame *f = &w->camera.axes;
	double reach = tan(35 * M_PI / 180);
	for (int i = 0; i < 20000; i++) {
		double x = dice_between(&dice, -1, 1), y = dice_between(&dice, -1, 1);
		vec3 d = vec3_normalize(frame_to_world(f, (vec3){-reach * x, -reach * y, 1}));
		double plain = radiance(w, 1, d);
		double expected =
			plain * pixel_values[(int)(0.5 * (y + 1) * HEIGHT) * WIDTH + (int)(0.5 * (x + 1) * WIDTH)];
		assert_true(fabs(radiance(w, 0, d) - expected) <= 1e-9 * expected);
		assert_true(fabs(radiance(w, 2, d) - 0.5 * plain) <= 1e-9 * plain);
	}
	world_free(w);
}

static void test_invalid_projectors_are_refused(void **state)
{
	(void)state;
	world_check_refused(
		"<emitter type='spot'><texture type='checkerboard' name='texture'/><float name='cutoff_angle' value='90'/></emitter>",
		"at most 89 degrees");
	world_check_refused(
		"<emitter type='projector'><float name='fov' value='30'/><string name='focal_length' value='30mm'/></emitter>",
		"are both given");
	world_check_refused(
		"<emitter type='projector'><transform name='to_world'><scale x='1' y='1' z='0'/></transform></emitter>",
		"singular");
	world_check_refused("<emitter type='projector'><float name='fov' value='180'/></emitter>", "fov");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_projection_matches_the_camera),
		cmocka_unit_test(test_irradiance_falls_off_with_the_square),
		cmocka_unit_test(test_directions_follow_their_density),
		cmocka_unit_test(test_spot_texture_touches_the_cone),
		cmocka_unit_test(test_invalid_projectors_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
