/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Daylight: figures known from elsewhere (the position of the sun, the brightness of noon), the image compared with the
 * model, and errors.
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

/* Solstices and equinoxes: at noon the sun is at an elevation of 90 - latitude +- 23.4 degrees, in the south; it rises
 * in the east. */
static void test_sun_position_follows_the_seasons(void **state)
{
	(void)state;
	static const struct {
		int month, day;
		double declination;
	} days[] = {{6, 21, 23.44}, {12, 21, -23.44}, {3, 20, 0}};
	for (size_t i = 0; i < 3; i++) {
		struct daylight_time t = {.latitude = 50,
					  .longitude = 0,
					  .utc_offset = 0,
					  .hour = 12,
					  .year = 2023,
					  .month = days[i].month,
					  .day = days[i].day};
		vec3 noon = daylight_sun_direction(&t);
		assert_true(fabs(vec3_length(noon) - 1) < 1e-12);
		assert_true(fabs(asin(noon.y) * 180 / PI - (40 + days[i].declination)) < 1);
		assert_true(noon.z > 0.4 && fabs(noon.x) < 0.08);
		t.hour = 9;
		assert_true(daylight_sun_direction(&t).x > 0.4);
		t.hour = 15;
		assert_true(daylight_sun_direction(&t).x < -0.4);
	}
	/* Tokyo, 139.7 degrees east: noon is 19 minutes before 12 o'clock, minus the equation of time. */
	struct daylight_time t = {.latitude = 35.7,
				  .longitude = 139.7,
				  .utc_offset = 9,
				  .hour = 11 + 46.0 / 60,
				  .year = 2010,
				  .month = 7,
				  .day = 10};
	assert_true(fabs(daylight_sun_direction(&t).x) < 0.02);
}

/* By the Astronomical Almanac's approximate formulas (section C, "Low precision formulas for the Sun"), whose
 * coefficients differ: hour angle from mean longitude, anomaly and Greenwich sidereal time, all in degrees. */
static vec3 almanac_sun_direction(const struct daylight_time *t, double days)
{
	double d = days + (t->hour - t->utc_offset) / 24, r = PI / 180;
	double g = (357.529 + 0.98560028 * d) * r, q = 280.459 + 0.98564736 * d;
	double along = (q + 1.915 * sin(g) + 0.020 * sin(2 * g)) * r, tilt = (23.439 - 0.00000036 * d) * r;
	double ascension = atan2(cos(tilt) * sin(along), cos(along)), declination = asin(sin(tilt) * sin(along));
	double turn = (15 * (18.697374558 + 24.06570982441908 * d) + t->longitude) * r - ascension, l = t->latitude * r;
	/* Components of the direction to the east, up and to the south, by rotating about the earth's axis. */
	return (vec3){-cos(declination) * sin(turn), sin(declination) * sin(l) + cos(declination) * cos(l) * cos(turn),
		      cos(declination) * sin(l) * cos(turn) - sin(declination) * cos(l)};
}

static void test_sun_position_matches_the_almanac(void **state)
{
	(void)state;
	static const struct {
		struct daylight_time t;
		int days; /* since January 1, 2000 */
	} cases[] = {
		{{35.6894, 139.6917, 9, 15, 2010, 7, 10}, 3843}, {{50, 0, 0, 9.5, 2000, 1, 1}, 0},
		{{-33.9, 151.2, 10, 8, 2023, 12, 21}, 8755},	 {{69.6, 18.9, 1, 23, 2024, 6, 21}, 8938},
		{{0, -78.5, -5, 17, 2004, 2, 29}, 1520},	 {{-54.8, -68.3, -3, 12.25, 2049, 3, 1}, 17957},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		vec3 here = daylight_sun_direction(&cases[i].t),
		     there = almanac_sun_direction(&cases[i].t, cases[i].days - 0.5);
		double off = vec3_length(vec3_sub(here, there)) * 180 / PI;
		print_message("row %zu: %.4f degrees apart, %.1f above the horizon\n", i, off, asin(here.y) * 180 / PI);
		assert_true(off < 0.02);
	}
}

/* Illuminance of open ground by the sun and by the sky. */
static void test_illuminance_is_realistic(void **state)
{
	(void)state;
	double rgb[3], sun = 30 * PI / 180;
	daylight_sun_radiance(3, sun, rgb);
	double solid = PI * DAYLIGHT_SUN_RADIUS * DAYLIGHT_SUN_RADIUS, lux = 683 * CIE_Y_SUM;
	double direct = luminance(rgb) * lux * solid;
	/* At noon on a clear day, the sun gives 70 to 110 klx, and the sky 10 to 25, more in the model. */
	assert_true(direct > 7e4 && direct < 1.1e5);
	struct daylight d = daylight_make(3, (const double[3]){0.2, 0.2, 0.2}, sun);
	double sky = 0;
	enum { N = 200 };
	for (int i = 0; i < N; i++)
		for (int k = 0; k < N; k++) {
			double theta = 0.5 * PI * (i + 0.5) / N, phi = 2 * PI * (k + 0.5) / N;
			double gamma = acos(cos(theta) * cos(sun) + sin(theta) * sin(sun) * cos(phi));
			daylight_sky_radiance(&d, theta, gamma, rgb);
			sky += luminance(rgb) * lux * cos(theta) * sin(theta) * (0.5 * PI / N) * (2 * PI / N);
		}
	print_message("sun %.0f lx, sky %.0f lx\n", direct, sky);
	assert_true(sky > 8e3 && sky < 4e4);
	/* Far from the sun the sky is blue; below the horizon it is black. */
	daylight_sky_radiance(&d, 60 * PI / 180, 90 * PI / 180, rgb);
	assert_true(rgb[2] > 1.3 * rgb[0]);
	daylight_sky_radiance(&d, 1.6, 1, rgb);
	assert_true(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
	/* A low sun in haze is red. */
	daylight_sun_radiance(8, 85 * PI / 180, rgb);
	assert_true(rgb[0] > 3 * rgb[2]);
}

/* X, Y and Z in W / (m^2 sr), as computed by the program of the model's authors. */
static void test_sky_matches_the_published_model(void **state)
{
	(void)state;
	static const struct {
		double turbidity, albedo, sun, angle, gamma, xyz[3]; /* degrees */
	} known[] = {
		{1, 0, 89.98, 0, 89.98, {0.460808527, 0.472004726, 0.60890716}},
		{1, 0, 89.98, 30, 20, {0.849739368, 0.876193566, 1.03511884}},
		{1, 0, 89.98, 75, 110, {1.73336382, 1.84602352, 1.45589929}},
		{1, 0, 89.98, 89.5, 0.48, {4.87413801, 4.76328722, 1.85417168}},
		{2.3, 0.2, 80, 0, 80, {1.62348512, 1.68961492, 3.25163517}},
		{2.3, 0.2, 80, 30, 20, {3.76443276, 3.9095927, 5.58282788}},
		{2.3, 0.2, 80, 75, 110, {5.92550099, 6.57640816, 8.96693448}},
		{2.3, 0.2, 80, 89.5, 9.5, {37.3000137, 38.9256923, 20.9755741}},
		{3, 0.3, 55, 0, 55, {3.53008302, 3.63098306, 7.54572657}},
		{3, 0.3, 55, 30, 20, {8.05935723, 8.44116268, 13.281678}},
		{3, 0.3, 55, 75, 110, {9.96026152, 10.7478143, 18.4516038}},
		{3, 0.3, 55, 89.5, 34.5, {31.278191, 33.8943268, 33.8735252}},
		{7.75, 0.65, 30, 0, 30, {15.7485973, 16.6452744, 22.5882306}},
		{7.75, 0.65, 30, 30, 20, {32.1916792, 34.2607164, 39.6158452}},
		{7.75, 0.65, 30, 75, 110, {16.8800196, 17.9819131, 26.7439119}},
		{7.75, 0.65, 30, 89.5, 59.5, {33.4506246, 35.3576759, 36.0411933}},
		{10, 1, 1, 0, 1, {115.752617, 122.379096, 114.547686}},
		{10, 1, 1, 30, 20, {52.1085098, 54.8959478, 57.4176542}},
		{10, 1, 1, 75, 110, {19.4684489, 20.0582904, 26.0189694}},
		{10, 1, 1, 89.5, 88.5, {27.7474789, 28.4249511, 28.3164276}},
	};
	static const double to_xyz[3][3] = {{0.4124564, 0.3575761, 0.1804375},
					    {0.2126729, 0.7151522, 0.0721750},
					    {0.0193339, 0.1191920, 0.9503041}};
	for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
		double ground = known[i].albedo, rgb[3];
		struct daylight d = daylight_make(known[i].turbidity, (const double[3]){ground, ground, ground},
						  known[i].sun * PI / 180);
		daylight_sky_radiance(&d, known[i].angle * PI / 180, known[i].gamma * PI / 180, rgb);
		for (int k = 0; k < 3; k++) {
			double x = 0;
			for (int c = 0; c < 3; c++)
				x += to_xyz[k][c] * rgb[c] * CIE_Y_SUM;
			if (!(fabs(x - known[i].xyz[k]) <= 1e-5 * known[i].xyz[k]))
				fail_msg("row %zu: %c is %.9g, not %.9g", i, "XYZ"[k], x, known[i].xyz[k]);
		}
	}
}

static int make_emitter(struct arena *a, const char *text, bool dialect_3, struct emitter *em, struct error *e)
{
	struct scene_node *n = node_make(a, PLUGIN_EMITTER, text);
	const struct emitter_build build = {.arena = a, .is_dialect_3 = dialect_3, .world_scale = 1};
	return emitter_create(em, n, &build, e);
}

/* The image contains all light of the sun, whatever the size of its disk, in the right direction. */
static void test_map_contains_all_sunlight(void **state)
{
	(void)state;
	static const char *const texts[] = {"sun", "sun sun_radius_scale=4", "sun sun_radius_scale=0",
					    "sunsky sun_scale=1 sky_scale=0 scale=7"};
	const struct wavelengths grey = {.is_grey = true};
	double expected[3];
	struct daylight_time t = {35.6894, 139.6917, 9, 15, 2010, 7, 10};
	vec3 at = daylight_sun_direction(&t);
	daylight_sun_radiance(3, acos(at.y), expected);
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
		/* Compares the largest component; the upsampled colour may differ by a tenth of it. */
		double most = fmax(expected[0], fmax(expected[1], expected[2])) * PI * DAYLIGHT_SUN_RADIUS *
			      DAYLIGHT_SUN_RADIUS;
		print_message("%s: %.3g of the sun\n", texts[i], sum / most);
		assert_true(sum > 0.75 * most && sum < 1.05 * most);
		assert_true(vec3_length(vec3_cross(vec3_normalize(mean), at)) < 2e-3);
		arena_fini(&a);
	}
}

static double radiance_spectrum_at(const struct emitter *em, double angle, double azimuth, const struct wavelengths *w)
{
	vec3 d = {sin(angle) * sin(azimuth), cos(angle), sin(angle) * cos(azimuth)};
	const struct emitter_point x = {.p = d, .is_infinite = true};
	return em->ops->radiance(em, &x, vec3_neg(d), w).v[0];
}

static double luminance_at(const struct emitter *em, double angle, double azimuth)
{
	return radiance_spectrum_at(em, angle, azimuth, &(struct wavelengths){.is_grey = true});
}

/* A brighter ground makes the sky brighter, and a green one its green; the defaults of the dialects differ. */
static void test_ground_albedo_colours_the_sky(void **state)
{
	(void)state;
	struct arena a = {0};
	struct error e = {""};
	struct emitter old, recent, dark, grey[2], green;
	assert_int_equal(make_emitter(&a, "sky", false, &old, &e), 0);
	assert_int_equal(make_emitter(&a, "sky", true, &recent, &e), 0);
	assert_int_equal(make_emitter(&a, "sky albedo=0", false, &dark, &e), 0);
	assert_int_equal(make_emitter(&a, "sky albedo=0.2", false, &grey[0], &e), 0);
	assert_int_equal(make_emitter(&a, "sky albedo=0.3", true, &grey[1], &e), 0);
	double by[2] = {luminance_at(&old, 1, 2) / luminance_at(&dark, 1, 2), recent.power / dark.power};
	print_message("brighter by %.3f and %.3f\n", by[0], by[1]);
	assert_true(by[0] > 1.02 && by[1] > 1.5 * by[0] - 0.5 && by[1] < 1.3);
	assert_true(luminance_at(&old, 1, 2) == luminance_at(&grey[0], 1, 2) && recent.power == grey[1].power);
	const struct wavelengths w[2] = {{.nm = {540, 540, 540, 540}}, {.nm = {440, 440, 440, 440}}};
	assert_int_equal(make_emitter(&a, "sky albedo=rgb(0,0.9,0)", false, &green, &e), 0);
	for (int i = 0; i < 2; i++)
		by[i] = radiance_spectrum_at(&green, 1, 2, &w[i]) / radiance_spectrum_at(&dark, 1, 2, &w[i]);
	print_message("a green ground: green by %.3f, blue by %.3f\n", by[0], by[1]);
	assert_true(by[0] > 1.05 && by[0] - 1 > 3 * (by[1] - 1));
	arena_fini(&a);
}

/* `stretch` moves the sky down, `extend` fades it out below the horizon: both are compared with the formula at some
 * angles, between which the map interpolates. */
static void test_stretch_and_extend_fill_below_the_horizon(void **state)
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
		/* The first row of the map below the horizon, for which the model is evaluated just above it. */
		double horizon = luminance_at(&extended, 0.5 * PI + 0.5 * PI / 256, azimuth);
		assert_true(fabs(horizon / luminance_at(&plain, 0.5 * PI - 0.5 * PI / 256, azimuth) - 1) < 0.2);
		for (double angle = 0.05; angle < 3.1; angle += 0.1) {
			double l = luminance_at(&plain, angle, azimuth), s = luminance_at(&stretched, angle, azimuth);
			double above = luminance_at(&plain, angle / 1.5, azimuth), fade = 2 - 2 * angle / PI;
			assert_true(luminance_at(&defaults, angle, azimuth) == l);
			assert_true((l > 0) == (angle < 0.5 * PI));
			if (fabs(angle - 0.75 * PI) > 0.05) /* not at its edge */
				assert_true(fabs(s - above) <= 0.02 * above);
			double below = horizon * fade * fade * (3 - 2 * fade);
			double x = luminance_at(&extended, angle, azimuth), due = angle < 0.5 * PI ? l : below;
			assert_true(fabs(x - due) <= 0.02 * due + 1e-4 * horizon);
		}
	}
	arena_fini(&a);
}

/* The parameters that scale sky and sun: in 0.6, `scale` is a default, and the only scale of `sky` and `sun`; in 3.x,
 * it is a further factor. */
static void test_scales_multiply_sky_and_sun(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		bool dialect_3;
		double factor;
	} skies[] = {
		{"sky scale=3", false, 3},
		{"sky scale=3 sky_scale=5", false, 3},
		{"sunsky scale=3", false, 3},
		{"sunsky scale=3 sky_scale=5", false, 5},
		{"sunsky scale=3 sun_scale=5", false, 3},
		{"sunsky sky_scale=5", true, 5},
		{"sunsky scale=3 sky_scale=5", true, 15},
	};
	for (size_t i = 0; i < sizeof skies / sizeof *skies; i++) {
		struct arena a = {0};
		struct emitter one, em;
		struct error e = {""};
		assert_int_equal(make_emitter(&a, "sky", skies[i].dialect_3, &one, &e), 0);
		assert_int_equal(make_emitter(&a, skies[i].text, skies[i].dialect_3, &em, &e), 0);
		vec3 at = skies[i].dialect_3 ? (vec3){0.3, -0.5, 0.8} : (vec3){0.3, 0.8, 0.5};
		const struct emitter_point x = {.p = vec3_normalize(at), .is_infinite = true};
		const struct wavelengths grey = {.is_grey = true};
		double l = one.ops->radiance(&one, &x, vec3_neg(x.p), &grey).v[0];
		double due = skies[i].factor * l, is = em.ops->radiance(&em, &x, vec3_neg(x.p), &grey).v[0];
		if (!(l > 0 && fabs(is - due) <= 0.03 * due)) /* the maps have different resolutions */
			fail_msg("%s: %g, not %g", skies[i].text, is, due);
		arena_fini(&a);
	}
}

/* Returns the mean direction of the light. */
static vec3 mean_direction(const struct emitter *em)
{
	enum { N = 200 };
	const struct wavelengths grey = {.is_grey = true};
	vec3 mean = {0, 0, 0};
	for (int k = 0; k < N * N; k++) {
		double u[2] = {(k % N + 0.5) / N, (k / N + 0.5) / N}, pdf;
		struct emitter_point x;
		if (em->ops->sample_point(em, u, &x, &pdf))
			mean = vec3_madd(mean, em->ops->radiance(em, &x, vec3_neg(x.p), &grey).v[0] / pdf, x.p);
	}
	return vec3_normalize(mean);
}

/* If the sun is given by time and place, south and west are +z and -x in 0.6, +x and +y in 3.x. `stretch` moves the
 * disk down along its meridian. */
static void test_north_follows_the_dialect(void **state)
{
	(void)state;
	struct arena a = {0};
	struct emitter old, recent, low;
	struct error e = {""};
	struct daylight_time t = {35.6894, 139.6917, 9, 15, 2010, 7, 10};
	vec3 d = daylight_sun_direction(&t);
	assert_true(d.x < -0.6 && d.z > 0.02); /* in the west, a little to the south */
	assert_int_equal(make_emitter(&a, "sun", false, &old, &e), 0);
	assert_int_equal(make_emitter(&a, "sun", true, &recent, &e), 0);
	assert_int_equal(make_emitter(&a, "sun stretch=1.75", false, &low, &e), 0);
	assert_true(vec3_length(vec3_sub(mean_direction(&old), d)) < 2e-3);
	assert_true(vec3_length(vec3_sub(mean_direction(&recent), (vec3){d.z, -d.x, d.y})) < 2e-3);
	double angle = 1.75 * acos(d.y), across = sqrt(1 - d.y * d.y);
	vec3 down = {d.x * sin(angle) / across, cos(angle), d.z * sin(angle) / across};
	assert_true(vec3_length(vec3_sub(mean_direction(&low), down)) < 2e-3);
	arena_fini(&a);
}

/* Creates an emitter with the sun in the given direction. */
static int make_with_sun(struct arena *a, const char *type, vec3 sun, struct emitter *em, struct error *e)
{
	struct scene_node *n = node_make(a, PLUGIN_EMITTER, type);
	struct property direction = {.name = "sun_direction", .value = {.type = VALUE_POINT, .as.point = sun}};
	n->properties = &direction;
	n->property_count = 1;
	return emitter_create(em, n, &(struct emitter_build){.arena = a, .world_scale = 1}, e);
}

/* As in Mitsuba, the sun may be on the horizon: the sky is bright, and the upper half of the sun is visible. */
static void test_sun_may_be_on_the_horizon(void **state)
{
	(void)state;
	static const char *const types[] = {"sunsky", "sky"};
	double light[2][2];
	for (int i = 0; i < 2; i++) {
		struct arena a = {0};
		struct emitter em;
		struct error e = {""};
		assert_true(make_with_sun(&a, types[i], (vec3){1, -0.001, 0}, &em, &e) < 0);
		assert_non_null(strstr(e.text, "below the horizon (-0.1 degrees)"));
		if (make_with_sun(&a, types[i], (vec3){1, 0, 0}, &em, &e))
			fail_msg("%s", e.text);
		light[i][0] = luminance_at(&em, 0.5 * PI - 1e-3, 0.5 * PI);
		light[i][1] = luminance_at(&em, 0.3 * PI, 2);
		arena_fini(&a);
	}
	assert_true(light[0][0] > 2 * light[1][0] && light[1][0] > 0);
	assert_true(light[1][1] > 0 && fabs(light[0][1] / light[1][1] - 1) < 0.02);
}

static void test_invalid_daylight_is_refused(void **state)
{
	(void)state;
	static const struct {
		const char *text, *word;
	} bad[] = {
		{"sky hour=2", "below the horizon"},
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
	struct arena a = {0};
	struct emitter em;
	struct error e = {""};
	struct scene_node *n = node_make(&a, PLUGIN_EMITTER, "sky");
	node_add_ref(&a, n, "albedo", node_make(&a, PLUGIN_TEXTURE, "checkerboard"));
	const struct emitter_build build = {.arena = &a, .world_scale = 1};
	assert_true(emitter_create(&em, n, &build, &e) < 0 && strstr(e.text, "textured albedo"));
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_sun_position_follows_the_seasons),
		cmocka_unit_test(test_sun_position_matches_the_almanac),
		cmocka_unit_test(test_illuminance_is_realistic),
		cmocka_unit_test(test_sky_matches_the_published_model),
		cmocka_unit_test(test_map_contains_all_sunlight),
		cmocka_unit_test(test_ground_albedo_colours_the_sky),
		cmocka_unit_test(test_stretch_and_extend_fill_below_the_horizon),
		cmocka_unit_test(test_scales_multiply_sky_and_sun),
		cmocka_unit_test(test_north_follows_the_dialect),
		cmocka_unit_test(test_sun_may_be_on_the_horizon),
		cmocka_unit_test(test_invalid_daylight_is_refused),
	};
	return cmocka_run_group_tests_name("daylight", tests, NULL, NULL);
}
