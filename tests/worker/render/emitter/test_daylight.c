/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Daylight: figures that are known from elsewhere (where the sun stands, how bright noon is), the picture against the
 * model, and what is refused.
 */
#include "tests/support/nodes.h"
#include "worker/render/emitter/daylight.h"
#include "worker/render/emitter/emitter.h"
#include "worker/render/math/cie.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

static double luminance(const double rgb[3])
{
	return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

/* Solstices and equinoxes: noon stands at 90 - latitude +- 23.4 degrees, in the south; days begin in the east. */
static void test_where_the_sun_stands(void **state)
{
	(void)state;
	static const struct {
		int month, day;
		double declination;
	} days[] = {{6, 21, 23.44}, {12, 21, -23.44}, {3, 20, 0}};
	for (size_t i = 0; i < 3; i++) {
		struct daylight_time t = {.latitude = 50,
					  .longitude = 0,
					  .zone = 0,
					  .hour = 12,
					  .year = 2023,
					  .month = days[i].month,
					  .day = days[i].day};
		vec3 noon = daylight_position(&t);
		assert_true(fabs(vec3_length(noon) - 1) < 1e-12);
		assert_true(fabs(asin(noon.y) * 180 / PI - (40 + days[i].declination)) < 1);
		assert_true(noon.z > 0.4 && fabs(noon.x) < 0.08);
		t.hour = 9;
		assert_true(daylight_position(&t).x > 0.4);
		t.hour = 15;
		assert_true(daylight_position(&t).x < -0.4);
	}
	/* Tokyo, 139.7 degrees east: noon is 19 minutes before the clock's, less the equation of time. */
	struct daylight_time t = {.latitude = 35.7,
				  .longitude = 139.7,
				  .zone = 9,
				  .hour = 11 + 46.0 / 60,
				  .year = 2010,
				  .month = 7,
				  .day = 10};
	assert_true(fabs(daylight_position(&t).x) < 0.02);
}

/* In the open, from the sun and from the sky. */
static void test_how_bright_it_is(void **state)
{
	(void)state;
	double rgb[3], sun = 30 * PI / 180;
	daylight_sun(3, sun, rgb);
	double solid = PI * DAYLIGHT_SUN_RADIUS * DAYLIGHT_SUN_RADIUS, lux = 683 * CIE_Y_SUM;
	double direct = luminance(rgb) * lux * solid;
	/* A clear noon has 70 to 110 klx from the sun, and 10 to 25 from the sky, which the model makes brighter. */
	assert_true(direct > 7e4 && direct < 1.1e5);
	struct daylight d = daylight_of(3, sun);
	double sky = 0;
	enum { N = 200 };
	for (int i = 0; i < N; i++)
		for (int k = 0; k < N; k++) {
			double theta = 0.5 * PI * (i + 0.5) / N, phi = 2 * PI * (k + 0.5) / N;
			double gamma = acos(cos(theta) * cos(sun) + sin(theta) * sin(sun) * cos(phi));
			daylight_sky(&d, theta, gamma, rgb);
			sky += luminance(rgb) * lux * cos(theta) * sin(theta) * (0.5 * PI / N) * (2 * PI / N);
		}
	print_message("sun %.0f lx, sky %.0f lx\n", direct, sky);
	assert_true(sky > 8e3 && sky < 4e4);
	/* Blue far from the sun; the zenith is what the model says it is; below the horizon nothing. */
	daylight_sky(&d, 60 * PI / 180, 90 * PI / 180, rgb);
	assert_true(rgb[2] > 1.3 * rgb[0]);
	daylight_sky(&d, 0, sun, rgb);
	double chi = (4.0 / 9 - 3.0 / 120) * (PI - 2 * sun),
	       zenith = (4.0453 * 3 - 4.9710) * tan(chi) - 0.2155 * 3 + 2.4192;
	assert_true(fabs(luminance(rgb) * lux / 1000 / zenith - 1) < 1e-3);
	daylight_sky(&d, 1.6, 1, rgb);
	assert_true(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
	/* A red sun low in the haze. */
	daylight_sun(8, 85 * PI / 180, rgb);
	assert_true(rgb[0] > 3 * rgb[2]);
}

static int make_emitter(struct arena *a, const char *text, bool dialect_3, struct emitter *em, struct error *e)
{
	struct scene_node *n = node_make(a, PLUGIN_EMITTER, text);
	const struct emitter_build build = {.arena = a, .dialect_3 = dialect_3, .scale = 1};
	return emitter_create(em, n, &build, e);
}

/* The sun's light is all there, whatever the size of its disk, and comes from where it stands. */
static void test_picture(void **state)
{
	(void)state;
	static const char *const texts[] = {"sun", "sun sun_radius_scale=4", "sun sun_scale=2 scale=0.5"};
	const struct wavelengths grey = {.grey = true};
	double expected[3];
	struct daylight_time t = {35.6894, 139.6917, 9, 15, 2010, 7, 10};
	vec3 at = daylight_position(&t);
	daylight_sun(3, acos(at.y), expected);
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
		struct arena a = {0};
		struct emitter em;
		struct error e = {""};
		assert_int_equal(make_emitter(&a, texts[i], false, &em, &e), 0);
		double sum = 0;
		vec3 mean = {0, 0, 0};
		enum { N = 200 };
		for (int k = 0; k < N * N; k++) {
			double u[2] = {(k % N + 0.5) / N, (k / N + 0.5) / N}, pdf;
			struct emitter_point x;
			if (!em.ops->sample_point(&em, u, &x, &pdf))
				continue;
			double l = em.ops->radiance(&em, &x, vec3_neg(x.p), &grey).v[0] / pdf / (N * N);
			sum += l;
			mean = vec3_madd(mean, l, x.p);
		}
		/* Grey is the largest of the three by its upsampled colour: within the colour's own tenth. */
		double most = fmax(expected[0], fmax(expected[1], expected[2])) * PI * DAYLIGHT_SUN_RADIUS *
			      DAYLIGHT_SUN_RADIUS;
		print_message("%s: %.3g of the sun\n", texts[i], sum / most);
		assert_true(sum > 0.75 * most && sum < 1.05 * most);
		assert_true(vec3_length(vec3_cross(vec3_normalize(mean), at)) < 2e-3);
		arena_fini(&a);
	}
}

static double seen(const struct emitter *em, double angle, double azimuth)
{
	const struct wavelengths grey = {.grey = true};
	vec3 d = {sin(angle) * sin(azimuth), cos(angle), sin(angle) * cos(azimuth)};
	const struct emitter_point x = {.p = d, .infinite = true};
	return em->ops->radiance(em, &x, vec3_neg(d), &grey).v[0];
}

/* `stretch` moves the sky down, `extend` fades it out below the horizon: both by the formula at some angles, which the
 * map interpolates. */
static void test_below_the_horizon(void **state)
{
	(void)state;
	struct arena a = {0};
	struct emitter plain, defaults, stretched, extended;
	struct error e = {""};
	assert_int_equal(make_emitter(&a, "sky", false, &plain, &e), 0);
	assert_int_equal(make_emitter(&a, "sky stretch=1 extend=false", false, &defaults, &e), 0);
	assert_int_equal(make_emitter(&a, "sky stretch=1.5", false, &stretched, &e), 0);
	assert_int_equal(make_emitter(&a, "sky extend=true", false, &extended, &e), 0);
	for (double azimuth = 0; azimuth < 6; azimuth += 0.7) {
		for (double angle = 0.05; angle < 3.1; angle += 0.1) {
			double l = seen(&plain, angle, azimuth), s = seen(&stretched, angle, azimuth);
			double above = seen(&plain, angle / 1.5, azimuth), fade = 2 - 2 * angle / PI;
			assert_true(seen(&defaults, angle, azimuth) == l);
			assert_true((l > 0) == (angle < 0.5 * PI));
			if (fabs(angle - 0.75 * PI) > 0.05) /* its edge */
				assert_true(fabs(s - above) <= 0.02 * above);
			double below = seen(&plain, 0.5 * PI - 0.01, azimuth) * fade * fade * (3 - 2 * fade);
			double x = seen(&extended, angle, azimuth), due = angle < 0.5 * PI ? l : below;
			assert_true(fabs(x - due) <= 0.05 * due + 1e-4 * seen(&plain, 1.5, azimuth));
		}
	}
	arena_fini(&a);
}

static void test_refused(void **state)
{
	(void)state;
	static const struct {
		const char *text, *word;
	} bad[] = {
		{"sky hour=2", "not above the horizon"},
		{"sky month=2 day=30", "has no day 30"},
	};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		struct arena a = {0};
		struct emitter em;
		struct error e = {""};
		if (make_emitter(&a, bad[i].text, true, &em, &e) >= 0 || !strstr(e.text, bad[i].word))
			fail_msg("%s: %s", bad[i].text, e.text);
		arena_fini(&a);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_where_the_sun_stands),
		cmocka_unit_test(test_how_bright_it_is),
		cmocka_unit_test(test_picture),
		cmocka_unit_test(test_below_the_horizon),
		cmocka_unit_test(test_refused),
	};
	return cmocka_run_group_tests_name("daylight", tests, NULL, NULL);
}
