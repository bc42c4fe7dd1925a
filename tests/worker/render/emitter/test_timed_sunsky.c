/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `timed_sunsky` is compared with the mean of `sky`, `sun` or `sunsky` at many times: the radiance of the sky by
 * direction, and the irradiance from sky and sun on surfaces of different slopes. Other cases: the part of the time
 * that the sensor's shutter selects, and errors.
 */
#include "tests/support/nodes.h"
#include "tests/support/worlds.h"
#include "worker/render/emitter/daylight.h"
#include "worker/render/emitter/emitter.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define PLACE " latitude=47.5 longitude=8.5 timezone=1"
enum { DIRECTIONS = 60, SLOPES = 4 };

static const struct wavelengths rgb = {.is_rgb = true};

static int try_emitter(struct arena *a, const char *text, double open, double close, struct emitter *em,
		       struct error *e)
{
	const struct emitter_build build = {
		.arena = a, .is_dialect_3 = true, .world_scale = 1, .shutter_open = open, .shutter_close = close};
	return emitter_create(em, node_make(a, PLUGIN_EMITTER, text), &build, e);
}

/* Returns directions above the horizon (up is +z), evenly distributed. */
static vec3 sky_direction(int i)
{
	double z = (i + 0.5) / DIRECTIONS, r = sqrt(1 - z * z), phi = 2.399963 * i;
	return (vec3){r * cos(phi), r * sin(phi), z};
}

struct measured_light {
	double radiance[DIRECTIONS][3], irradiance[SLOPES][3];
};

/* Adds `share` times the light of an emitter; irradiance is estimated by its own samples. */
static void add_light(struct measured_light *l, const struct emitter *em, double share)
{
	enum { N = 128 };
	static const vec3 normal[SLOPES] = {{0, 0, 1}, {0.8, 0, 0.6}, {-0.6, 0.8, 0}, {0, -1, 0}};
	for (int i = 0; i < DIRECTIONS; i++) {
		struct emitter_point x = {.p = sky_direction(i), .is_infinite = true};
		spectrum s = em->ops->radiance(em, &x, vec3_neg(x.p), &rgb);
		for (int c = 0; c < 3; c++)
			l->radiance[i][c] += share * s.v[c];
	}
	for (int k = 0; k < N * N; k++) {
		const double u[2] = {(k % N + 0.5) / N, (k / N + 0.5) / N};
		struct emitter_point x;
		double pdf;
		if (!em->ops->sample_point(em, u, &x, &pdf))
			continue;
		spectrum s = em->ops->radiance(em, &x, vec3_neg(x.p), &rgb);
		for (int n = 0; n < SLOPES; n++)
			for (int c = 0; c < 3; c++)
				l->irradiance[n][c] +=
					share * s.v[c] * fmax(vec3_dot(normal[n], x.p), 0) / pdf / (N * N);
	}
}

static void make_light(struct measured_light *l, const char *text, double open, double close)
{
	struct arena a = {0};
	struct emitter em;
	struct error e;
	memset(l, 0, sizeof *l);
	if (try_emitter(&a, text, open, close, &em, &e))
		fail_msg("%s", e.text);
	add_light(l, &em, 1);
	arena_fini(&a);
}

/* Computes the mean over `steps` times, in the hours from begin to end of days from `first` on, counted from January 1,
 * 2025. The other emitters refuse a sun below the horizon, which is therefore taken as dark. */
static void average_over_times(struct measured_light *l, const char *what, int first, int days, double begin,
			       double end, int steps)
{
	static const int length[12] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
	memset(l, 0, sizeof *l);
	for (int i = 0; i < steps; i++) {
		struct arena a = {0};
		struct emitter em;
		struct error e;
		char text[300];
		double time = (i + 0.5) / steps * days;
		int day = (int)time + first, month = 0;
		while (day >= length[month])
			day -= length[month++];
		snprintf(text, sizeof text, "%s" PLACE " year=2025 month=%d day=%d hour=%.17g", what, month + 1,
			 day + 1, begin + (end - begin) * (time - floor(time)));
		if (!try_emitter(&a, text, 0, 0, &em, &e))
			add_light(l, &em, 1.0 / steps);
		else
			assert_non_null(strstr(e.text, "below the horizon"));
		arena_fini(&a);
	}
}

static void compare_light(const char *name, const struct measured_light *found, const struct measured_light *wanted,
			  double sky, double all)
{
	double square = 0, sum = 0, most = 0;
	for (int i = 0; i < DIRECTIONS; i++)
		for (int c = 0; c < 3; c++) {
			double off = found->radiance[i][c] - wanted->radiance[i][c];
			square += off * off;
			sum += wanted->radiance[i][c] * wanted->radiance[i][c];
		}
	for (int n = 0; n < SLOPES; n++)
		for (int c = 0; c < 3; c++)
			most = fmax(most, fabs(found->irradiance[n][c] / wanted->irradiance[n][c] - 1));
	double off = sum > 0 ? sqrt(square / sum) : 0;
	printf("%s: radiance off by %.2f %% (root mean square), irradiance by %.2f %% at most\n", name, 100 * off,
	       100 * most);
	assert_true(off < sky && most < all);
}

#define JULY_10 " start_month=7 start_day=10 end_year=2025 end_day=11"

static void test_sky_of_a_day_is_the_mean(void **state)
{
	(void)state;
	static struct measured_light found, wanted;
	make_light(&found, "timed_sunsky sun_scale=0 window_start_time=3 window_end_time=20 turbidity=4" PLACE JULY_10,
		   0, 1);
	average_over_times(&wanted, "sky turbidity=4", 31 + 28 + 31 + 30 + 31 + 30 + 9, 1, 3, 20, 64);
	compare_light("sky of a day", &found, &wanted, 0.01, 0.01);
}

static void test_sun_of_a_day_is_the_mean(void **state)
{
	(void)state;
	static struct measured_light found, wanted;
	make_light(&found, "timed_sunsky sky_scale=0 window_start_time=6 window_end_time=18" PLACE JULY_10, 0, 1);
	average_over_times(&wanted, "sun", 31 + 28 + 31 + 30 + 31 + 30 + 9, 1, 6, 18, 48);
	compare_light("sun of a day", &found, &wanted, INFINITY, 0.01);
}

static void test_year_is_the_mean_of_its_days(void **state)
{
	(void)state;
	static struct measured_light found, wanted;
	make_light(&found, "timed_sunsky sun_scale=0" PLACE, 0, 1);
	average_over_times(&wanted, "sky", 0, 365, 7, 19, 157);
	compare_light("sky of a year", &found, &wanted, 0.03, 0.02);
}

/* Half of the shutter's time is half of the day; a closed interval of length 0, the default of sensors, is its
 * beginning; times are relative to the emitter's own shutter times. The sun that `sunsky` draws is off by a fraction of
 * a pixel, which matters on slopes at grazing angles. */
static void test_shutter_selects_part_of_the_day(void **state)
{
	(void)state;
	static struct measured_light found, wanted;
	make_light(&found, "timed_sunsky sun_scale=0 window_start_time=8 window_end_time=16" PLACE JULY_10, 0, 0.5);
	average_over_times(&wanted, "sky", 190, 1, 8, 12, 32);
	compare_light("sky of half a day", &found, &wanted, 0.01, 0.01);
	make_light(
		&found,
		"timed_sunsky sun_scale=0 window_start_time=8 window_end_time=16 shutter_open=1 shutter_close=3" PLACE
			JULY_10,
		2, 3);
	average_over_times(&wanted, "sky", 190, 1, 12, 16, 32);
	compare_light("sky of the other half", &found, &wanted, 0.01, 0.01);
	make_light(&found, "timed_sunsky window_start_time=8 window_end_time=16" PLACE JULY_10, 0, 0);
	average_over_times(&wanted, "sunsky", 190, 1, 8, 8, 1);
	compare_light("sky and sun at once", &found, &wanted, 0.01, 0.03);
	make_light(&found, "timed_sunsky window_start_time=0 window_end_time=3" PLACE JULY_10, 0, 1);
	assert_true(found.irradiance[0][1] == 0);
}

/* The sensor's shutter is used: a shutter open from dawn on gets more light than one open at dawn only. */
static void test_shutter_of_the_sensor_is_used(void **state)
{
	(void)state;
	double power[2];
	for (int i = 0; i < 2; i++) {
		struct world *w = world_from_text(8, 8,
						  "<sensor type='perspective'><float name='shutter_close' value='%d'/>"
						  "</sensor><shape type='sphere'/><emitter type='timed_sunsky'>"
						  "<float name='window_start_time' value='8'/></emitter>",
						  i);
		power[i] = w->emitters[0].power;
		world_free(w);
	}
	assert_true(power[1] > 1.5 * power[0]);
}

static void test_days_between_dates_are_counted(void **state)
{
	(void)state;
	const struct daylight_time a = {.year = 2024, .month = 2, .day = 28}, b = {.year = 2024, .month = 3, .day = 1},
				   c = {.year = 2025, .month = 2, .day = 28};
	assert_int_equal(daylight_days_between(&a, &b), 2);
	assert_int_equal(daylight_days_between(&a, &c), 366);
	assert_int_equal(daylight_days_between(&c, &a), -366);
}

static void test_invalid_times_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double open, close;
		const char *what;
	} cases[] = {
		{"timed_sunsky", 0, 2, "the sensor's shutter is open from 0 to 2, which is not within 0 to 1"},
		{"timed_sunsky shutter_open=1", 1, 1, "its shutter_close must be after its shutter_open"},
		{"timed_sunsky window_start_time=9 window_end_time=8", 0, 1, "window_end_time is before"},
		{"timed_sunsky start_month=2 start_day=30", 0, 1, "month 2 of 2025 has no day 30"},
		{"timed_sunsky end_month=4 end_day=31", 0, 1, "month 4 of 2026 has no day 31"},
		{"timed_sunsky end_year=2024", 0, 1, "last day is before its first"},
		{"timed_sunsky start_year=1900 end_year=2200", 0, 1, "more than 200 years"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct arena a = {0};
		struct emitter em;
		struct error e = {""};
		assert_true(try_emitter(&a, cases[i].text, cases[i].open, cases[i].close, &em, &e) < 0);
		if (!strstr(e.text, cases[i].what))
			fail_msg("%s: %s", cases[i].text, e.text);
		arena_fini(&a);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_sky_of_a_day_is_the_mean),
		cmocka_unit_test(test_sun_of_a_day_is_the_mean),
		cmocka_unit_test(test_year_is_the_mean_of_its_days),
		cmocka_unit_test(test_shutter_selects_part_of_the_day),
		cmocka_unit_test(test_shutter_of_the_sensor_is_used),
		cmocka_unit_test(test_days_between_dates_are_counted),
		cmocka_unit_test(test_invalid_times_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
