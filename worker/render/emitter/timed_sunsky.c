/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Daylight over a period, `timed_sunsky` of Mitsuba 3.7. The emitter's time from shutter_open to shutter_close covers a
 * window of hours on each day from the first to the one before the last; the camera's shutter is open for a part of
 * that time. The emitter is an environment map of the mean light in that part: the sky at SKY_SAMPLES times, and the
 * sun at SUN_SAMPLES times, each with one point of its disk. If the camera's shutter closes at the time it opens, the
 * map consists of one sky and DISK_SAMPLES points of the sun. There is no light while the sun is below the horizon.
 *
 * Creation fails as described in sunsky.c, if times are not in order, if the camera's shutter is open outside the
 * emitter's time, and in a scene of 0.6.
 */
#include "worker/render/emitter/sunsky.h"

#include "common/base/liveness.h"

#include <string.h>

enum {
	SKY_SAMPLES = 256,
	SUN_SAMPLES = 1 << 20,
	DISK_SAMPLES = 1 << 12,
	SKY_WIDTH = 256,
	SKY_HEIGHT = 128,
	SUN_ANGLES = 256,
	SKY_SCALE = 8,
	DAYS_MAX = 366 * 200
};

/* Irrational steps whose multiples, modulo 1, fill an interval or a square evenly (Roberts 2018). */
#define SKY_STEP 0.6180339887498949
#define DISK_STEP_X 0.7548776662466927
#define DISK_STEP_Y 0.5698402909980532

static double fraction(double x)
{
	return x - floor(x);
}

struct sun_period {
	struct daylight_time start; /* hour: beginning of the window */
	double window_hours;
	int day_count;
	double shutter_begin, shutter_end; /* the part of the emitter's time, from 0 to 1, during which the camera's
					      shutter is open */
	int sky_samples, sun_samples;
	double turbidity, albedo[3], sun_radius, sky_scale, sun_scale;
	struct envmap_axes axes;
	struct image image;
};

/* Computes the direction of the sun and its angle from the zenith at a share of the camera's shutter time. Returns
 * false if the sun is below the horizon. */
static bool sun_direction_at(const struct sun_period *t, double share, vec3 *sun_direction, double *angle)
{
	struct daylight_time moment = t->start;
	double day = fmin((t->shutter_begin + share * (t->shutter_end - t->shutter_begin)) * t->day_count,
			  t->day_count * (1 - 0x1p-52)),
	       whole_days = floor(day);
	moment.day += (int)whole_days;
	moment.hour += (day - whole_days) * t->window_hours;
	*sun_direction = sunsky_map_direction(daylight_sun_direction(&moment), true);
	*angle = atan2(hypot(sun_direction->x, sun_direction->z), sun_direction->y);
	return *angle <= 0.5 * M_PI;
}

/* ---- the map: rows from up (+y) down, columns from -z on over +x ---- */

static vec3 map_direction(double column, double row)
{
	double phi = 2 * M_PI * column, theta = M_PI * row;
	return (vec3){sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi)};
}

static void accumulate_sky(const struct sun_period *t, vec3 sun_direction, double angle, double *mean)
{
	struct daylight sky = daylight_make(t->turbidity, t->albedo, angle);
	for (int y = 0; y < SKY_HEIGHT / 2; y++)
		for (int x = 0; x < SKY_WIDTH; x++) {
			double row = (y + 0.5) / SKY_HEIGHT, rgb[3];
			vec3 d = map_direction((x + 0.5) / SKY_WIDTH, row);
			double gamma = atan2(vec3_length(vec3_cross(d, sun_direction)), vec3_dot(d, sun_direction));
			daylight_sky_radiance(&sky, M_PI * row, gamma, rgb);
			for (int k = 0; k < 3; k++)
				mean[3 * (y * SKY_WIDTH + x) + k] += t->sky_scale * rgb[k] / t->sky_samples;
		}
	liveness_tick();
}

/* Interpolates the coarse sky bilinearly; its outer rows continue to the pole and to the horizon. */
static void upsample_sky(const struct sun_period *t, const double *mean)
{
	for (uint32_t y = 0; y < t->image.height / 2; y++)
		for (uint32_t x = 0; x < t->image.width; x++) {
			double row = (y + 0.5) / SKY_SCALE - 0.5, column = (x + 0.5) / SKY_SCALE - 0.5;
			int r = (int)floor(row), c = (int)floor(column), up = r < 0 ? 0 : r,
			    down = r + 1 < SKY_HEIGHT / 2 ? r + 1 : SKY_HEIGHT / 2 - 1;
			double v = row - r, u = column - c;
			for (int k = 0; k < 3; k++) {
				const double *channel = mean + k;
				int left = (c + SKY_WIDTH) % SKY_WIDTH, right = (c + 1) % SKY_WIDTH;
				double a = channel[3 * (up * SKY_WIDTH + left)],
				       b = channel[3 * (up * SKY_WIDTH + right)],
				       d = channel[3 * (down * SKY_WIDTH + left)],
				       f = channel[3 * (down * SKY_WIDTH + right)];
				t->image.pixels[3 * ((size_t)y * t->image.width + x) + (size_t)k] =
					(float)((1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * f));
			}
		}
}

static int bake_sky(const struct sun_period *t, struct arena *scratch)
{
	double *mean = arena_alloc(scratch, (size_t)SKY_WIDTH * SKY_HEIGHT / 2, 3 * sizeof *mean);
	if (!mean)
		return -ENOMEM;
	for (int i = 0; i < t->sky_samples && t->sky_scale > 0; i++) {
		vec3 sun_direction;
		double angle;
		if (sun_direction_at(t, (i + fraction(i * SKY_STEP)) / t->sky_samples, &sun_direction, &angle))
			accumulate_sky(t, sun_direction, angle, mean);
	}
	upsample_sky(t, mean);
	return 0;
}

/* Computes the radiance of the disk at its true size, for SUN_ANGLES angles from the zenith. */
static void tabulate_sun(const struct sun_period *t, double rgb[SUN_ANGLES][3])
{
	for (int i = 0; i < SUN_ANGLES; i++)
		daylight_sun_radiance(t->turbidity, 0.5 * M_PI * i / (SUN_ANGLES - 1), rgb[i]);
}

/* Adds light from a direction to four pixels, with bilinear weights. l: radiance times solid angle. */
static void splat_light(const struct sun_period *t, vec3 d, const double l[3])
{
	const struct image *m = &t->image;
	double column = (atan2(d.x, -d.z) / (2 * M_PI) + 1) * m->width - 0.5,
	       row = fmin(fmax(atan2(hypot(d.x, d.z), d.y) / M_PI * m->height - 0.5, 0), m->height - 1.0);
	uint32_t y = (uint32_t)row, x = (uint32_t)column;
	for (uint32_t k = 0; k < 4; k++) {
		uint32_t right = k & 1, down = k >> 1;
		uint32_t at_x = (x + right) % m->width, at_y = y + down < m->height ? y + down : y;
		double weight = (right ? column - x : 1 - (column - x)) * (down ? row - y : 1 - (row - y)),
		       solid = 2 * M_PI / m->width * M_PI / m->height * sin(M_PI * (at_y + 0.5) / m->height);
		float *pixel = m->pixels + 3 * ((size_t)at_y * m->width + at_x);
		for (int c = 0; c < 3; c++)
			pixel[c] += (float)(weight * l[c] / solid);
	}
}

static void bake_sun(const struct sun_period *t)
{
	static const vec3 up = {0, 1, 0};
	double colors[SUN_ANGLES][3], solid_angle = 4 * M_PI * pow(sin(0.5 * DAYLIGHT_SUN_RADIUS), 2);
	tabulate_sun(t, colors);
	for (int i = 0; i < t->sun_samples; i++) {
		vec3 sun_direction;
		double angle, l[3];
		if (i % 4096 == 0)
			liveness_tick();
		if (!sun_direction_at(t, (i + 0.5) / t->sun_samples, &sun_direction, &angle))
			continue;
		double position = angle / (0.5 * M_PI) * (SUN_ANGLES - 1),
		       r = t->sun_radius * sqrt(fraction(i * DISK_STEP_X)), phi = 2 * M_PI * fraction(i * DISK_STEP_Y);
		int low = (int)fmin(position, SUN_ANGLES - 2);
		for (int k = 0; k < 3; k++)
			l[k] = t->sun_scale * solid_angle / t->sun_samples *
			       (colors[low][k] + (position - low) * (colors[low + 1][k] - colors[low][k]));
		struct frame f = frame_along(sun_direction, up);
		splat_light(t, frame_to_world(&f, (vec3){sin(r) * cos(phi), sin(r) * sin(phi), cos(r)}), l);
	}
}

/* ---- reading ---- */

/* Reads the part of the emitter's time in which the camera's shutter is open. */
static int read_shutter(struct sun_period *t, const struct scene_node *n, const struct emitter_build *build,
			struct error *e)
{
	double open = node_float(n, "shutter_open", 0), length = node_float(n, "shutter_close", 1) - open;
	if (!(length > 0))
		return node_error(n, e, EINVAL, "its shutter_close must be after its shutter_open");
	t->shutter_begin = (build->shutter_open - open) / length;
	t->shutter_end = (build->shutter_close - open) / length;
	if (!(t->shutter_begin >= 0 && t->shutter_end <= 1))
		return node_error(n, e, EINVAL,
				  "the sensor's shutter is open from %g to %g, which is not within %g to %g",
				  build->shutter_open, build->shutter_close, open, open + length);
	return 0;
}

static int read_time(struct sun_period *t, const struct scene_node *n, struct error *e)
{
	double begin = node_float(n, "window_start_time", 7), end = node_float(n, "window_end_time", 19);
	t->start = (struct daylight_time){.latitude = node_float(n, "latitude", 35.689),
					  .longitude = node_float(n, "longitude", 139.6917),
					  .utc_offset = node_float(n, "timezone", 9),
					  .hour = begin,
					  .year = (int)node_float(n, "start_year", 2025),
					  .month = (int)node_float(n, "start_month", 1),
					  .day = (int)node_float(n, "start_day", 1)};
	struct daylight_time last = t->start;
	last.year = (int)node_float(n, "end_year", t->start.year + 1);
	last.month = (int)node_float(n, "end_month", t->start.month);
	last.day = (int)node_float(n, "end_day", t->start.day);
	int code = sunsky_check_day(n, t->start.year, t->start.month, t->start.day, e);
	if (!code)
		code = sunsky_check_day(n, last.year, last.month, last.day, e);
	if (code)
		return code;
	t->window_hours = end - begin;
	t->day_count = daylight_days_between(&t->start, &last);
	if (t->window_hours < 0 || t->day_count < 0 || t->day_count > DAYS_MAX)
		return node_error(n, e, EINVAL, "its %s",
				  t->window_hours < 0 ? "window_end_time is before window_start_time"
				  : t->day_count < 0  ? "last day is before its first"
						      : "days are more than 200 years");
	t->day_count += t->day_count == 0;
	bool is_instant = t->shutter_begin == t->shutter_end || (t->window_hours == 0 && t->day_count == 1);
	t->sky_samples = is_instant ? 1 : SKY_SAMPLES;
	t->sun_samples = is_instant ? DISK_SAMPLES : SUN_SAMPLES;
	return 0;
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct sun_period t = {
		.turbidity = node_float(n, "turbidity", 3),
		.sky_scale = node_float(n, "sky_scale", 1),
		.sun_scale = node_float(n, "sun_scale", 1),
		.image = {.width = SKY_WIDTH * SKY_SCALE, .height = SKY_HEIGHT * SKY_SCALE, .channels = 3}};
	t.sun_radius = node_float(n, "sun_aperture", 2 * DAYLIGHT_SUN_RADIUS * 180 / M_PI) * M_PI / 360;
	int code = build->is_dialect_3 ? 0 : node_error(n, e, ENOTSUP, "a scene of 0.6 has no \"timed_sunsky\"");
	if (!code)
		code = sunsky_read_axes(n, build, &t.axes, e);
	if (!code)
		code = read_shutter(&t, n, build, e);
	if (!code)
		code = read_time(&t, n, e);
	if (!code)
		code = sunsky_read_albedo(n, build, t.albedo, e);
	if (code)
		return code;
	struct arena scratch = {.limit = build->arena->limit};
	t.image.pixels = arena_alloc(build->arena, (size_t)t.image.width * t.image.height, 3 * sizeof *t.image.pixels);
	code = t.image.pixels ? bake_sky(&t, &scratch) : -ENOMEM;
	arena_fini(&scratch);
	if (code)
		return node_error(n, e, ENOMEM, "out of memory");
	if (t.sun_scale > 0)
		bake_sun(&t);
	return envmap_init(em, &(struct raster){.image = indexed_image_wrap(&t.image)}, false, 1, &t.axes, n, build, e);
}

#define RANGE(name_, types_, min_, max_)                                 \
	{                                                                \
		.name = name_, .types = types_, .min = min_, .max = max_ \
	}
#define NUMBER(name, min, max) RANGE(name, VALUE_FLOAT | VALUE_INT, min, max)

const struct emitter_ops emitter_ops_timed_sunsky = {
	.decl = {PLUGIN_EMITTER, "timed_sunsky",
		 PARAMS(NUMBER("turbidity", 1, 10), NUMBER("sky_scale", 0, 1e9), NUMBER("sun_scale", 0, 1e9),
			NUMBER("sun_aperture", 0.05, 30), NUMBER("latitude", -90, 90), NUMBER("longitude", -180, 180),
			NUMBER("timezone", -14, 14), NUMBER("window_start_time", 0, 24),
			NUMBER("window_end_time", 0, 24), RANGE("start_year", VALUE_INT, 1900, 2200),
			RANGE("start_month", VALUE_INT, 1, 12), RANGE("start_day", VALUE_INT, 1, 31),
			RANGE("end_year", VALUE_INT, 1900, 2200), RANGE("end_month", VALUE_INT, 1, 12),
			RANGE("end_day", VALUE_INT, 1, 31), NUMBER("shutter_open", -1e30, 1e30),
			NUMBER("shutter_close", -1e30, 1e30), {.name = "to_world", .types = VALUE_TRANSFORM},
			{.name = "albedo", .types = VALUE_TEXTURE, .max = 1},
			{.name = "complex_sun", .types = VALUE_BOOL, .status = PARAM_IGNORED},
			{.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED}),
		 0, PARAM_UNDERSTOOD},
	.create = create,
	ENVMAP_OPS};
