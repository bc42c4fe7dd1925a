/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Daylight (daylight.h) as an environment map: `sky`, `sun`, `sunsky`. A sky without a sun has 512 x 256 pixels,
 * one with a sun 2048 x 1024: the sun's disk is three pixels wide, and its total power is preserved. The map is black
 * below the horizon, unless `stretch` or `extend` of 0.6 is given. Up is +y in 0.5/0.6 and +z in 3.x. If the sun is
 * given by time and place, south is +z and west -x in 0.5/0.6; in 3.x, south is +x and west +y, as in Mitsuba, which
 * mirrors the compass there.
 *
 * Creation fails if to_world does more than rotate, if the sun is below the horizon or its direction has no length, if
 * the month does not have the given day, or if the albedo is textured.
 */
#include "worker/render/emitter/sunsky.h"

#include "worker/render/math/cie.h"

#include <string.h>

#define RADIANS_PER_DEGREE (M_PI / 180)
#define SUN_SCALE_MIN 0.1

struct sky_bake {
	struct daylight sky;
	struct image image;
	vec3 sun_direction;  /* in the axes of the map */
	vec3 disk_direction; /* where the sun is seen: `stretch` moves it down with the sky */
	double disk_radius;  /* angular */
};

static vec3 pixel_direction(const struct image *m, double column, double row)
{
	double phi = 2 * M_PI * column / m->width, theta = M_PI * row / m->height;
	return (vec3){sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi)};
}

static float *pixel_at(const struct image *m, uint32_t x, uint32_t y)
{
	return m->pixels + 3 * ((size_t)y * m->width + x);
}

/* Returns the share of the horizon's radiance that `extend` gives to directions below it: 1 at the horizon, 0 at the
 * nadir. */
static double below_horizon_share(double angle)
{
	double t = fmin(2 - 2 * angle / M_PI, 1);
	return t * t * (3 - 2 * t);
}

/* stretch: factor of all angles from the zenith, which lowers the horizon. */
static void bake_sky(const struct sky_bake *b, double scale, double stretch, bool extend)
{
	const struct image *m = &b->image;
	const double horizon = nextafter(0.5 * M_PI, 0);
	for (uint32_t y = 0; y < m->height; y++) {
		double angle = M_PI * (y + 0.5) / m->height, model_angle = angle / stretch, factor = scale;
		if (model_angle > horizon && !extend)
			break;
		if (extend) {
			model_angle = fmin(model_angle, horizon);
			factor *= below_horizon_share(angle);
		}
		for (uint32_t x = 0; x < m->width; x++) {
			vec3 d = pixel_direction(m, x + 0.5, model_angle * m->height / M_PI);
			double rgb[3];
			daylight_sky_radiance(&b->sky, model_angle, vec3_angle(d, b->sun_direction), rgb);
			for (int k = 0; k < 3; k++)
				pixel_at(m, x, y)[k] = (float)(factor * rgb[k]);
		}
	}
}

/* Returns the share of a pixel that the disk covers. */
static double covered_share(const struct sky_bake *b, uint32_t x, uint32_t y)
{
	enum { PARTS = 8 };
	double reach = b->disk_radius + 2 * M_PI / b->image.height;
	if (vec3_angle(pixel_direction(&b->image, x + 0.5, y + 0.5), b->disk_direction) > reach)
		return 0;
	int inside = 0;
	for (int i = 0; i < PARTS * PARTS; i++) {
		vec3 d = pixel_direction(&b->image, x + (i % PARTS + 0.5) / PARTS, y + (i / PARTS + 0.5) / PARTS);
		inside += vec3_angle(d, b->disk_direction) <= b->disk_radius;
	}
	return (double)inside / (PARTS * PARTS);
}

/* rgb: radiance of the disk at its true size; a larger disk is dimmed to the same power. */
static void bake_sun(const struct sky_bake *b, const double rgb[3])
{
	const struct image *m = &b->image;
	double covered_solid_angle = 0, pixel_area = 2 * M_PI / m->width * M_PI / m->height;
	double row = vec3_angle(b->disk_direction, (vec3){0, 1, 0}) * m->height / M_PI,
	       reach = b->disk_radius * m->height / M_PI + 2;
	uint32_t first = (uint32_t)fmax(row - reach, 0), last = (uint32_t)fmin(row + reach, m->height - 1.0);
	for (uint32_t y = first; y <= last; y++)
		for (uint32_t x = 0; x < m->width; x++)
			covered_solid_angle += covered_share(b, x, y) * pixel_area * sin(M_PI * (y + 0.5) / m->height);
	/* Solid angle of the true disk, without cancellation, over that of the covered pixels. */
	double true_solid_angle = 4 * M_PI * pow(sin(0.5 * DAYLIGHT_SUN_RADIUS), 2),
	       factor = covered_solid_angle > 0 ? true_solid_angle / covered_solid_angle : 0;
	for (uint32_t y = first; y <= last; y++)
		for (uint32_t x = 0; x < m->width; x++)
			for (int k = 0; k < 3; k++)
				pixel_at(m, x, y)[k] += (float)(covered_share(b, x, y) * factor * rgb[k]);
}

static int days_in_month(int month, int year)
{
	static const int days[12] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
	return days[month - 1] + (month == 2 && year % 4 == 0 && (year % 100 != 0 || year % 400 == 0));
}

int sunsky_check_day(const struct scene_node *n, int year, int month, int day, struct error *e)
{
	return day > days_in_month(month, year)
		       ? node_error(n, e, ERANGE, "month %d of %d has no day %d", month, year, day)
		       : 0;
}

vec3 sunsky_map_direction(vec3 d, bool dialect_3)
{
	return dialect_3 ? (vec3){d.z, d.y, d.x} : d; /* the third axis is -y in 3.x */
}

/* Reads the direction of the sun in the world. axis: axes of the map, the second of which is up. */
static int read_sun_direction(const struct scene_node *n, const vec3 axis[3], bool dialect_3, vec3 *sun_direction,
			      struct error *e)
{
	static const char *const time_params[] = {"latitude", "longitude", "timezone", "year",	"month",
						  "day",      "hour",	   "minute",   "second"};
	const struct property *p = node_find_property(n, "sun_direction");
	if (p) {
		double length = vec3_length(p->value.as.point);
		for (size_t i = 0; i < sizeof time_params / sizeof *time_params; i++)
			if (node_find_property(n, time_params[i]))
				return node_error(n, e, EINVAL,
						  "sun_direction and %s are both given: only one is allowed",
						  time_params[i]);
		if (!(length > 0) || !isfinite(length))
			return node_error(n, e, EINVAL, "a sun_direction of length %g", length);
		*sun_direction = vec3_scale(1 / length, p->value.as.point);
		return 0;
	}
	/* Mitsuba's default: a summer afternoon in Tokyo. */
	struct daylight_time t = {.latitude = node_float(n, "latitude", 35.6894),
				  .longitude = node_float(n, "longitude", 139.6917),
				  .utc_offset = node_float(n, "timezone", 9),
				  .year = (int)node_float(n, "year", 2010),
				  .month = (int)node_float(n, "month", 7),
				  .day = (int)node_float(n, "day", 10)};
	t.hour = node_float(n, "hour", 15) + node_float(n, "minute", 0) / 60 + node_float(n, "second", 0) / 3600;
	int code = sunsky_check_day(n, t.year, t.month, t.day, e);
	if (code)
		return code;
	vec3 d = sunsky_map_direction(daylight_sun_direction(&t), dialect_3);
	*sun_direction = vec3_madd(vec3_madd(vec3_scale(d.x, axis[0]), d.y, axis[1]), d.z, axis[2]);
	return 0;
}

int sunsky_read_albedo(const struct scene_node *n, const struct emitter_build *build, double albedo[3], struct error *e)
{
	const struct texture_build texture_build = {build->assets, build->arena, build->is_dialect_3,
						    NULL,	   NULL,	 false};
	struct texture t;
	int code = texture_from_node(&t, n, "albedo", build->is_dialect_3 ? 0.3 : 0.2, COLOR_REFLECTANCE,
				     &texture_build, e);
	if (code)
		return code;
	if (!texture_is_constant(&t))
		return node_error(n, e, ENOTSUP, "a textured albedo is not supported");
	double total[3] = {0, 0, 0}, reflected[3] = {0, 0, 0};
	for (int i = 0; i < CIE_COUNT; i++) {
		double nm = CIE_FIRST_NM + i,
		       a = color_eval(&t.color, &(struct wavelengths){.nm = {nm, nm, nm, nm}}).v[0];
		for (int k = 0; k < 3; k++) {
			total[k] += cie_observer[i][k];
			reflected[k] += a * cie_observer[i][k];
		}
	}
	for (int k = 0; k < 3; k++)
		albedo[k] = reflected[k] / total[k];
	return 0;
}

/* Moves d down, to `factor` times its angle from the zenith. */
static vec3 stretch_from_zenith(vec3 d, double factor)
{
	double angle = factor * vec3_angle(d, (vec3){0, 1, 0}), across = hypot(d.x, d.z);
	double part = across > 0 ? sin(angle) / across : 0;
	return (vec3){part * d.x, across > 0 ? cos(angle) : 1, part * d.z};
}

/* Returns the scale of the sky or of the sun. In 0.6, `scale` is the default of sunsky's `sunScale` and `skyScale`, and
 * the only scale of `sky` and `sun`. In 3.x, which has no `scale`, it multiplies both. */
static double read_scale(const struct scene_node *n, const char *name, bool dialect_3)
{
	double both = node_float(n, "scale", 1);
	if (dialect_3)
		return both * node_float(n, name, 1);
	return strcmp(n->type, "sunsky") == 0 ? node_float(n, name, both) : both;
}

/* Returns the angular radius of the sun. A sun without width (scale 0 in 0.6) gets a tenth of the true radius, a third
 * of a pixel in diameter. */
static double disk_radius(const struct scene_node *n)
{
	double radius = DAYLIGHT_SUN_RADIUS * fmax(node_float(n, "sun_radius_scale", 1), SUN_SCALE_MIN);
	return node_float(n, "sun_aperture", 2 * radius / RADIANS_PER_DEGREE) * RADIANS_PER_DEGREE / 2;
}

int sunsky_read_axes(const struct scene_node *n, const struct emitter_build *build, struct envmap_axes *axes,
		     struct error *e)
{
	int code = envmap_read_axes(n, axes, e);
	if (!code && axes->is_stretched)
		code = node_error(n, e, ENOTSUP, "to_world of a sky can only rotate");
	if (code || !build->is_dialect_3)
		return code;
	vec3 y = axes->axis[1];
	axes->axis[1] = axes->axis[2];
	axes->axis[2] = vec3_neg(y);
	memcpy(axes->inverse_row, axes->axis, sizeof axes->inverse_row);
	return 0;
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	bool has_sky = strcmp(n->type, "sun") != 0, has_sun = strcmp(n->type, "sky") != 0;
	struct sky_bake b = {.image = {.width = has_sun ? 2048 : 512, .height = has_sun ? 1024 : 256, .channels = 3}};
	double turbidity = node_float(n, "turbidity", 3), stretch = node_float(n, "stretch", 1);
	struct envmap_axes axes;
	vec3 *axis = axes.axis, sun_direction = {0, 1, 0};
	int code = sunsky_read_axes(n, build, &axes, e);
	if (code)
		return code;
	if ((code = read_sun_direction(n, axis, build->is_dialect_3, &sun_direction, e)))
		return code;
	b.sun_direction = (vec3){vec3_dot(axis[0], sun_direction), vec3_dot(axis[1], sun_direction),
				 vec3_dot(axis[2], sun_direction)};
	double sun_angle = vec3_angle(b.sun_direction, (vec3){0, 1, 0});
	if (!(sun_angle <= 0.5 * M_PI + 1e-6))
		return node_error(n, e, EINVAL, "the sun is below the horizon (%.1f degrees)",
				  90 - sun_angle / RADIANS_PER_DEGREE);
	double albedo[3];
	if ((code = sunsky_read_albedo(n, build, albedo, e)))
		return code;
	b.sky = daylight_make(turbidity, albedo, sun_angle);
	b.disk_radius = disk_radius(n);
	b.disk_direction = stretch_from_zenith(b.sun_direction, stretch);
	b.image.pixels = arena_alloc(build->arena, (size_t)b.image.width * b.image.height, 3 * sizeof *b.image.pixels);
	if (!b.image.pixels)
		return node_error(n, e, ENOMEM, "out of memory");
	double rgb[3];
	if (has_sky)
		bake_sky(&b, read_scale(n, "sky_scale", build->is_dialect_3), stretch, node_bool(n, "extend", false));
	daylight_sun_radiance(turbidity, sun_angle, rgb);
	for (int k = 0; k < 3; k++)
		rgb[k] *= read_scale(n, "sun_scale", build->is_dialect_3);
	if (has_sun)
		bake_sun(&b, rgb);
	return envmap_init(em, &(struct raster){.image = indexed_image_wrap(&b.image)}, false, 1, &axes, n, build, e);
}

#define NUMBER(name_, min_, max_)                                                         \
	{                                                                                 \
		.name = name_, .types = VALUE_FLOAT | VALUE_INT, .min = min_, .max = max_ \
	}
#define INTEGER(name_, min_, max_)                                          \
	{                                                                   \
		.name = name_, .types = VALUE_INT, .min = min_, .max = max_ \
	}

static const struct param sunsky_params[] = {
	NUMBER("turbidity", 1, 10),
	NUMBER("scale", 0, PARAM_LIGHT_MAX),
	NUMBER("sky_scale", 0, 1e9),
	NUMBER("sun_scale", 0, 1e9),
	{.name = "sun_direction", .types = VALUE_POINT, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX},
	NUMBER("sun_radius_scale", 0, 50),
	NUMBER("sun_aperture", 0.05, 30),
	NUMBER("latitude", -90, 90),
	NUMBER("longitude", -180, 180),
	NUMBER("timezone", -14, 14),
	INTEGER("year", 1900, 2200),
	INTEGER("month", 1, 12),
	INTEGER("day", 1, 31),
	NUMBER("hour", 0, 24),
	NUMBER("minute", 0, 60),
	NUMBER("second", 0, 60),
	NUMBER("stretch", 1, 2),
	{.name = "extend", .types = VALUE_BOOL},
	{.name = "to_world", .types = VALUE_TRANSFORM},
	{.name = "albedo", .types = VALUE_TEXTURE, .max = 1},
	{.name = "resolution", .types = VALUE_INT, .status = PARAM_IGNORED},
	{.name = "complex_sun", .types = VALUE_BOOL, .status = PARAM_IGNORED},
	{.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED},
	{.name = NULL},
};

#define SUNSKY_OPS(NAME)                                \
	const struct emitter_ops emitter_ops_##NAME = { \
		.decl = {PLUGIN_EMITTER, #NAME, sunsky_params, 0, PARAM_UNDERSTOOD}, .create = create, ENVMAP_OPS}
SUNSKY_OPS(sky);
SUNSKY_OPS(sun);
SUNSKY_OPS(sunsky);
