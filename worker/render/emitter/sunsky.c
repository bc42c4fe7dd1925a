/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Daylight (daylight.h) as an environment map: `sky`, `sun`, `sunsky`. A sky without a sun has 512 x 256 pixels, one
 * with a sun 2048 x 1024: the sun's disk is three pixels wide, and its total power is preserved. The map is black below
 * the horizon, unless `stretch` or `extend` of 0.6 is given. Up is +y in 0.5/0.6 and +z in 3.x. If the sun is given by
 * time and place, south is +z and west -x in 0.5/0.6; in 3.x, south is +x and west +y, as in Mitsuba, which mirrors the
 * compass there.
 *
 * Creation fails if to_world does more than rotate, if the sun is below the horizon or its direction has no length, if
 * the month does not have the given day, or if the albedo is textured.
 */
#include "worker/render/emitter/sunsky.h"

#include "worker/render/math/cie.h"

#include <string.h>

#define RADIANS (M_PI / 180)
#define SUN_SCALE_MIN 0.1

struct baking {
	struct daylight sky;
	struct image image;
	vec3 towards;  /* direction of the sun in the axes of the map */
	vec3 disk;     /* direction in which the sun is seen: `stretch` moves it down with the sky */
	double radius; /* angular radius of the disk */
};

static vec3 direction(const struct image *m, double column, double row)
{
	double phi = 2 * M_PI * column / m->width, theta = M_PI * row / m->height;
	return (vec3){sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi)};
}

static float *pixel(const struct image *m, uint32_t x, uint32_t y)
{
	return m->pixels + 3 * ((size_t)y * m->width + x);
}

/* Returns the share of the horizon's radiance that `extend` gives to directions below it: 1 at the horizon, 0 at the
 * nadir. */
static double extension_below_horizon(double angle)
{
	double t = fmin(2 - 2 * angle / M_PI, 1);
	return t * t * (3 - 2 * t);
}

/* stretch: factor of all angles from the zenith, which lowers the horizon. */
static void bake_sky(const struct baking *b, double scale, double stretch, bool extend)
{
	const struct image *m = &b->image;
	const double horizon = nextafter(0.5 * M_PI, 0);
	for (uint32_t y = 0; y < m->height; y++) {
		double angle = M_PI * (y + 0.5) / m->height, model = angle / stretch, factor = scale;
		if (model > horizon && !extend)
			break;
		if (extend) {
			model = fmin(model, horizon);
			factor *= extension_below_horizon(angle);
		}
		for (uint32_t x = 0; x < m->width; x++) {
			vec3 d = direction(m, x + 0.5, model * m->height / M_PI);
			double rgb[3];
			daylight_sky(&b->sky, model, vec3_angle(d, b->towards), rgb);
			for (int k = 0; k < 3; k++)
				pixel(m, x, y)[k] = (float)(factor * rgb[k]);
		}
	}
}

/* Returns the share of a pixel that the disk covers. */
static double covered_share(const struct baking *b, uint32_t x, uint32_t y)
{
	enum { PARTS = 8 };
	double reach = b->radius + 2 * M_PI / b->image.height;
	if (vec3_angle(direction(&b->image, x + 0.5, y + 0.5), b->disk) > reach)
		return 0;
	int inside = 0;
	for (int i = 0; i < PARTS * PARTS; i++) {
		vec3 d = direction(&b->image, x + (i % PARTS + 0.5) / PARTS, y + (i / PARTS + 0.5) / PARTS);
		inside += vec3_angle(d, b->disk) <= b->radius;
	}
	return (double)inside / (PARTS * PARTS);
}

/* rgb: radiance of the disk at its true size; a larger disk is dimmed to the same power. */
static void bake_sun(const struct baking *b, const double rgb[3])
{
	const struct image *m = &b->image;
	double solid = 0, pixel_row = 2 * M_PI / m->width * M_PI / m->height;
	double row = vec3_angle(b->disk, (vec3){0, 1, 0}) * m->height / M_PI, reach = b->radius * m->height / M_PI + 2;
	uint32_t first = (uint32_t)fmax(row - reach, 0), last = (uint32_t)fmin(row + reach, m->height - 1.0);
	for (uint32_t y = first; y <= last; y++)
		for (uint32_t x = 0; x < m->width; x++)
			solid += covered_share(b, x, y) * pixel_row * sin(M_PI * (y + 0.5) / m->height);
	/* Solid angle of the true disk, without cancellation, over that of the covered pixels. */
	double whole = 4 * M_PI * pow(sin(0.5 * DAYLIGHT_SUN_RADIUS), 2), factor = solid > 0 ? whole / solid : 0;
	for (uint32_t y = first; y <= last; y++)
		for (uint32_t x = 0; x < m->width; x++)
			for (int k = 0; k < 3; k++)
				pixel(m, x, y)[k] += (float)(covered_share(b, x, y) * factor * rgb[k]);
}

static int days_of(int month, int year)
{
	static const int days[12] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
	return days[month - 1] + (month == 2 && year % 4 == 0 && (year % 100 != 0 || year % 400 == 0));
}

int sunsky_check_day(const struct scene_node *n, int year, int month, int day, struct error *e)
{
	return day > days_of(month, year) ? node_error(n, e, ERANGE, "month %d of %d has no day %d", month, year, day)
					  : 0;
}

vec3 sunsky_compass(vec3 d, bool dialect_3)
{
	return dialect_3 ? (vec3){d.z, d.y, d.x} : d; /* the third axis is -y in 3.x */
}

/* Reads the direction of the sun in the world. axis: axes of the map, the second of which is up. */
static int read_sun(const struct scene_node *n, const vec3 axis[3], bool dialect_3, vec3 *towards, struct error *e)
{
	static const char *const clock[] = {"latitude", "longitude", "timezone", "year",  "month",
					    "day",	"hour",	     "minute",	 "second"};
	const struct property *p = node_find(n, "sun_direction");
	if (p) {
		double length = vec3_length(p->value.as.point);
		for (size_t i = 0; i < sizeof clock / sizeof *clock; i++)
			if (node_find(n, clock[i]))
				return node_error(n, e, EINVAL,
						  "sun_direction and %s are both given: only one is allowed", clock[i]);
		if (!(length > 0) || !isfinite(length))
			return node_error(n, e, EINVAL, "a sun_direction of length %g", length);
		*towards = vec3_scale(1 / length, p->value.as.point);
		return 0;
	}
	/* Mitsuba's default: a summer afternoon in Tokyo. */
	struct daylight_time t = {.latitude = node_float(n, "latitude", 35.6894),
				  .longitude = node_float(n, "longitude", 139.6917),
				  .zone = node_float(n, "timezone", 9),
				  .year = (int)node_float(n, "year", 2010),
				  .month = (int)node_float(n, "month", 7),
				  .day = (int)node_float(n, "day", 10)};
	t.hour = node_float(n, "hour", 15) + node_float(n, "minute", 0) / 60 + node_float(n, "second", 0) / 3600;
	int code = sunsky_check_day(n, t.year, t.month, t.day, e);
	if (code)
		return code;
	vec3 d = sunsky_compass(daylight_position(&t), dialect_3);
	*towards = vec3_madd(vec3_madd(vec3_scale(d.x, axis[0]), d.y, axis[1]), d.z, axis[2]);
	return 0;
}

int sunsky_albedo(const struct scene_node *n, const struct emitter_build *build, double albedo[3], struct error *e)
{
	const struct texture_build inner = {build->assets, build->arena, build->dialect_3, NULL, NULL, false};
	struct texture t;
	int code = texture_from_node(&t, n, "albedo", build->dialect_3 ? 0.3 : 0.2, COLOR_REFLECTANCE, &inner, e);
	if (code)
		return code;
	if (!texture_is_constant(&t))
		return node_error(n, e, ENOTSUP, "a textured albedo is not supported");
	double whole[3] = {0, 0, 0}, reflected[3] = {0, 0, 0};
	for (int i = 0; i < CIE_COUNT; i++) {
		double nm = CIE_FIRST_NM + i,
		       a = color_eval(&t.color, &(struct wavelengths){.nm = {nm, nm, nm, nm}}).v[0];
		for (int k = 0; k < 3; k++) {
			whole[k] += cie_observer[i][k];
			reflected[k] += a * cie_observer[i][k];
		}
	}
	for (int k = 0; k < 3; k++)
		albedo[k] = reflected[k] / whole[k];
	return 0;
}

/* Moves d down, to `by` times its angle from the zenith. */
static vec3 stretch_from_zenith(vec3 d, double by)
{
	double angle = by * vec3_angle(d, (vec3){0, 1, 0}), across = hypot(d.x, d.z);
	double part = across > 0 ? sin(angle) / across : 0;
	return (vec3){part * d.x, across > 0 ? cos(angle) : 1, part * d.z};
}

/* Returns the scale of the sky or of the sun. In 0.6, `scale` is the default of sunsky's `sunScale` and `skyScale`, and
 * the only scale of `sky` and `sun`. In 3.x, which has no `scale`, it multiplies both. */
static double scale_of(const struct scene_node *n, const char *name, bool dialect_3)
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
	return node_float(n, "sun_aperture", 2 * radius / RADIANS) * RADIANS / 2;
}

int sunsky_axes_read(const struct scene_node *n, const struct emitter_build *build, struct envmap_axes *axes,
		     struct error *e)
{
	int code = envmap_axes_read(n, axes, e);
	if (!code && axes->stretched)
		code = node_error(n, e, ENOTSUP, "to_world of a sky can only rotate");
	if (code || !build->dialect_3)
		return code;
	vec3 y = axes->axis[1];
	axes->axis[1] = axes->axis[2];
	axes->axis[2] = vec3_neg(y);
	memcpy(axes->back, axes->axis, sizeof axes->back);
	return 0;
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	bool has_sky = strcmp(n->type, "sun") != 0, has_sun = strcmp(n->type, "sky") != 0;
	struct baking b = {.image = {.width = has_sun ? 2048 : 512, .height = has_sun ? 1024 : 256, .channels = 3}};
	double turbidity = node_float(n, "turbidity", 3), stretch = node_float(n, "stretch", 1);
	struct envmap_axes axes;
	vec3 *axis = axes.axis, towards = {0, 1, 0};
	int code = sunsky_axes_read(n, build, &axes, e);
	if (code)
		return code;
	if ((code = read_sun(n, axis, build->dialect_3, &towards, e)))
		return code;
	b.towards = (vec3){vec3_dot(axis[0], towards), vec3_dot(axis[1], towards), vec3_dot(axis[2], towards)};
	double sun = vec3_angle(b.towards, (vec3){0, 1, 0});
	if (!(sun <= 0.5 * M_PI + 1e-6))
		return node_error(n, e, EINVAL, "the sun is below the horizon (%.1f degrees)", 90 - sun / RADIANS);
	double albedo[3];
	if ((code = sunsky_albedo(n, build, albedo, e)))
		return code;
	b.sky = daylight_of(turbidity, albedo, sun);
	b.radius = disk_radius(n);
	b.disk = stretch_from_zenith(b.towards, stretch);
	b.image.pixels = arena_alloc(build->arena, (size_t)b.image.width * b.image.height, 3 * sizeof *b.image.pixels);
	if (!b.image.pixels)
		return node_error(n, e, ENOMEM, "out of memory");
	double rgb[3];
	if (has_sky)
		bake_sky(&b, scale_of(n, "sky_scale", build->dialect_3), stretch, node_bool(n, "extend", false));
	daylight_sun(turbidity, sun, rgb);
	for (int k = 0; k < 3; k++)
		rgb[k] *= scale_of(n, "sun_scale", build->dialect_3);
	if (has_sun)
		bake_sun(&b, rgb);
	return envmap_make(em, &(struct raster){.image = indexed_image_of(&b.image)}, false, 1, &axes, n, build, e);
}

#define NUMBER(name_, min_, max_)                                                         \
	{                                                                                 \
		.name = name_, .types = VALUE_FLOAT | VALUE_INT, .min = min_, .max = max_ \
	}
#define WHOLE(name_, min_, max_)                                            \
	{                                                                   \
		.name = name_, .types = VALUE_INT, .min = min_, .max = max_ \
	}

static const struct param params[] = {
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
	WHOLE("year", 1900, 2200),
	WHOLE("month", 1, 12),
	WHOLE("day", 1, 31),
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

#define OPS(NAME)                                       \
	const struct emitter_ops emitter_ops_##NAME = { \
		.decl = {PLUGIN_EMITTER, #NAME, params, 0, PARAM_UNDERSTOOD}, .create = create, ENVMAP_OPS}
OPS(sky);
OPS(sun);
OPS(sunsky);
