/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A colour is a scale times a shape: constant, D65, a sigmoid polynomial fitted to RGB, or a table. color_from_* choose
 * the shape once; color_eval has a loop over the wavelengths for each. RGB values of textures are looked up in a table
 * of coefficients, which is computed when the program is built.
 *
 * Creation fails if a colour is outside the range of its role; evaluation cannot fail.
 */
#include "worker/render/texture/color.h"

#include "common/base/color.h"
#include "worker/render/math/cie.h"
#include "worker/render/math/search.h"
#include "worker/render/texture/upsample.h"

#include <string.h>

static const float upsample_coefficients[3 * UPSAMPLE_TABLE_SIZE * UPSAMPLE_TABLE_SIZE * UPSAMPLE_TABLE_SIZE * 3] = {
#include "upsample_table.inc"
};

/* Luminance of D65 at its tabulated scale: the integral of d65 y_bar, both linear between their values, divided by
 * 106.857 nm. A test recomputes it. */
#define D65_LUMINANCE 98.889832367126914

double color_d65(double nm)
{
	double position = nm - CIE_FIRST_NM;
	if (!(position >= 0 && position <= CIE_COUNT - 1))
		return 0;
	int cell = (int)position;
	cell = cell > CIE_COUNT - 2 ? CIE_COUNT - 2 : cell;
	double b = position - cell;
	return ((1 - b) * cie_d65[cell] + b * cie_d65[cell + 1]) * (1 / D65_LUMINANCE);
}

#define SMOOTHSTEP(x) ((x) * (x) * (3 - 2 * (x)))
#define TABLE_VALUE(k) SMOOTHSTEP(SMOOTHSTEP((double)(k) / (UPSAMPLE_TABLE_SIZE - 1)))
#define TABLE_VALUES_4(k) TABLE_VALUE(k), TABLE_VALUE((k) + 1), TABLE_VALUE((k) + 2), TABLE_VALUE((k) + 3)
/* The values of upsample_table_value(), tabulated because every textured vertex needs them. */
static const double upsample_values[UPSAMPLE_TABLE_SIZE] = {TABLE_VALUES_4(0),	TABLE_VALUES_4(4),  TABLE_VALUES_4(8),
							    TABLE_VALUES_4(12), TABLE_VALUES_4(16), TABLE_VALUES_4(20),
							    TABLE_VALUES_4(24), TABLE_VALUES_4(28)};

/* Interpolates the coefficients of a colour trilinearly; its largest component must be > 0. */
static void look_up_coefficients(const double rgb[3], double c[3])
{
	const int n = UPSAMPLE_TABLE_SIZE;
	int l = rgb[0] >= rgb[1] ? (rgb[0] >= rgb[2] ? 0 : 2) : (rgb[1] >= rgb[2] ? 1 : 2);
	double z = rgb[l], x = rgb[(l + 1) % 3] * (n - 1) / z, y = rgb[(l + 2) % 3] * (n - 1) / z;
	int xi = (int)x, yi = (int)y, zi = (int)search_find_cell(upsample_values, UPSAMPLE_TABLE_SIZE - 1, z);
	xi = xi > n - 2 ? n - 2 : xi;
	yi = yi > n - 2 ? n - 2 : yi;
	double fx = x - xi, fy = y - yi,
	       fz = (z - upsample_values[zi]) / (upsample_values[zi + 1] - upsample_values[zi]);
	const double wx[2] = {1 - fx, fx}, wy[2] = {1 - fy, fy}, wz[2] = {1 - fz, fz};
	double sum[3] = {0, 0, 0};
	for (int dz = 0; dz < 2; dz++)
		for (int dy = 0; dy < 2; dy++) {
			const float *p = upsample_coefficients + 3 * (((l * n + zi + dz) * n + yi + dy) * n + xi);
			double near = wx[0] * wy[dy] * wz[dz], far = wx[1] * wy[dy] * wz[dz];
			for (int k = 0; k < 3; k++)
				sum[k] = sum[k] + near * (double)p[k] + far * (double)p[3 + k];
		}
	for (int k = 0; k < 3; k++)
		c[k] = sum[k];
}

spectrum color_eval_rgb_reflectance(const double rgb[3], const struct wavelengths *w)
{
	if (WAVELENGTHS_GREY(w) || (rgb[0] == rgb[1] && rgb[1] == rgb[2]))
		return spectrum_constant(rgb[0]);
	if (w->is_rgb)
		return spectrum_from_rgb(rgb);
	double c[3];
	look_up_coefficients(rgb, c);
	spectrum s;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double t = (w->nm[i] - UPSAMPLE_CENTER_NM) * (1 / UPSAMPLE_HALF_NM);
		s.v[i] = upsample_sigmoid((c[0] * t + c[1]) * t + c[2]);
	}
	return s;
}

spectrum color_eval_rgb_illuminant(const double rgb[3], const struct wavelengths *w)
{
	double largest = fmax(rgb[0], fmax(rgb[1], rgb[2]));
	if (largest == 0 || WAVELENGTHS_GREY(w))
		return spectrum_constant(largest);
	if (w->is_rgb)
		return spectrum_from_rgb(rgb);
	const double unit[3] = {rgb[0] / largest, rgb[1] / largest, rgb[2] / largest};
	spectrum s = color_eval_rgb_reflectance(unit, w);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		s.v[i] *= largest * color_d65(w->nm[i]);
	return s;
}

spectrum color_eval_rgb_unbounded(const double rgb[3], const struct wavelengths *w)
{
	if (WAVELENGTHS_GREY(w) || w->is_rgb || (rgb[0] == rgb[1] && rgb[1] == rgb[2]))
		return color_eval_rgb_reflectance(rgb, w);
	double scale = COLOR_UNBOUNDED_SCALE * fmax(rgb[0], fmax(rgb[1], rgb[2]));
	const double unit[3] = {rgb[0] / scale, rgb[1] / scale, rgb[2] / scale};
	return spectrum_scale(scale, color_eval_rgb_reflectance(unit, w));
}

struct color color_constant(double x)
{
	return (struct color){.kind = COLOR_KIND_CONSTANT, .scale = x};
}

/* Returns x times the white of the role: D65 for illuminants, otherwise constant. */
static struct color color_white(double x, enum color_role role)
{
	struct color c = color_constant(x);
	if (role == COLOR_ILLUMINANT) {
		c.kind = COLOR_KIND_D65;
		c.is_times_d65 = true;
	}
	return c;
}

/* Converts the coefficients of the polynomial in t to those in nm. */
static void coefficients_in_nm(const double t[3], double nm[3])
{
	const double center = UPSAMPLE_CENTER_NM, r = 1 / UPSAMPLE_HALF_NM;
	nm[0] = t[0] * r * r;
	nm[1] = t[1] * r - 2 * t[0] * r * r * center;
	nm[2] = t[0] * r * r * center * center - t[1] * r * center + t[2];
}

/* Returns the largest component that a colour of the role may have. The declarations of textures' parameters do not
 * limit it. */
static double role_max(enum color_role role)
{
	return role == COLOR_REFLECTANCE ? 1 : role == COLOR_ILLUMINANT ? PARAM_LIGHT_MAX : PARAM_METAL_MAX;
}

int color_from_rgb(const double rgb[3], enum color_role role, struct color *out)
{
	double largest = 0;
	for (int k = 0; k < 3; k++) {
		if (!(rgb[k] >= 0) || !(rgb[k] <= role_max(role)))
			return -EINVAL;
		largest = rgb[k] > largest ? rgb[k] : largest;
	}
	*out = color_white(largest, role);
	if (rgb[0] == rgb[1] && rgb[1] == rgb[2])
		return 0;
	out->kind = COLOR_KIND_OTHER;
	out->is_sigmoid = true;
	out->scale = role == COLOR_REFLECTANCE	? 1
		     : role == COLOR_ILLUMINANT ? largest
						: COLOR_UNBOUNDED_SCALE * largest;
	double *unit = out->rgb, c[3];
	out->has_rgb = true;
	for (int k = 0; k < 3; k++)
		unit[k] = rgb[k] / out->scale;
	look_up_coefficients(unit, c);
	struct upsample s;
	upsample_init(&s, 1);
	upsample_fit(&s, unit, 1e-9, c);
	coefficients_in_nm(c, out->coefficient);
	return 0;
}

/* A position in a table: from sample i, `fraction` of the way to sample i + 1. */
struct table_position {
	uint32_t i;
	double fraction;
};

/* Finds the position of nm, clamped to the ends of the table. Most tables are equidistant, so the first guess is
 * right. */
static struct table_position find_position(const struct color *c, double nm)
{
	const double *nm_table = c->nm;
	uint32_t last = c->count - 2;
	if (!(nm > nm_table[0]))
		return (struct table_position){0, 0};
	if (!(nm < nm_table[last + 1]))
		return (struct table_position){last, 1};
	double guess = (nm - nm_table[0]) * c->intervals_per_nm;
	uint32_t g = guess >= (double)last ? last : (uint32_t)guess;
	if (!(nm_table[g] <= nm && nm <= nm_table[g + 1]))
		g = search_find_cell(nm_table, c->count - 1, nm);
	return (struct table_position){g, (nm - nm_table[g]) / (nm_table[g + 1] - nm_table[g])};
}

static double value_at_position(const struct color *c, struct table_position p)
{
	return (1 - p.fraction) * c->value[p.i] + p.fraction * c->value[p.i + 1];
}

static double table_value(const struct color *c, double nm)
{
	if (c->is_zero_outside && (nm < c->nm[0] || nm > c->nm[c->count - 1]))
		return 0;
	return value_at_position(c, find_position(c, nm));
}

/* Computes the RGB components of the colour, at scale 1, for paths that carry RGB: D65 is white, and negative
 * components become 0. */
static void compute_rgb(struct color *c, bool under_d65)
{
	double xyz[3] = {0, 0, 0}, d65_xyz[3] = {0, 0, 0}, white[3];
	for (int i = 0; i < CIE_COUNT; i++) {
		double nm = CIE_FIRST_NM + i, d65 = color_d65(nm),
		       x = (c->count ? table_value(c, nm) : 1) * (under_d65 ? d65 : 1);
		for (int k = 0; k < 3; k++) {
			xyz[k] += cie_observer[i][k] * x;
			d65_xyz[k] += cie_observer[i][k] * d65;
		}
	}
	rec709_from_xyz(xyz, c->rgb);
	rec709_from_xyz(d65_xyz, white);
	for (int k = 0; k < 3; k++)
		c->rgb[k] = fmax(c->rgb[k] / white[k], 0);
	c->has_rgb = true;
}

struct color color_from_samples(uint32_t n, const double *nm, const double *value, bool zero_outside, bool under_d65)
{
	struct color c = {.kind = COLOR_KIND_OTHER,
			  .scale = 1,
			  .count = n,
			  .intervals_per_nm = (n - 1) / (nm[n - 1] - nm[0]),
			  .nm = nm,
			  .value = value,
			  .is_zero_outside = zero_outside};
	compute_rgb(&c, under_d65);
	return c;
}

static int color_from_spectrum(const struct value *v, enum color_role role, struct arena *arena, struct color *out,
			       struct error *e)
{
	uint32_t n = v->as.spectrum.count;
	for (uint32_t i = 0; i < n; i++) {
		double x = v->as.spectrum.value[i], nm = v->as.spectrum.nm[i];
		if (!(x >= 0) || !(x <= role_max(role)) || !isfinite(nm))
			return error_set(e, EINVAL, "%g at %g nm is outside [0, %g]", x, nm, role_max(role));
		if (i && !(nm > v->as.spectrum.nm[i - 1]))
			return error_set(e, EINVAL, "the wavelengths of a spectrum must increase");
	}
	/* Once for all the materials that refer to it or repeat it. */
	const struct arena_interned *nm = arena_intern(arena, v->as.spectrum.nm, n * sizeof(double)),
				    *value = arena_intern(arena, v->as.spectrum.value, n * sizeof(double));
	if (!nm || !value)
		return error_set(e, ENOMEM, "out of memory for a spectrum of %u values", n);
	*out = color_from_samples(n, nm->bytes, value->bytes, role != COLOR_UNBOUNDED, role != COLOR_ILLUMINANT);
	for (int k = 0; k < 3 && role == COLOR_REFLECTANCE; k++)
		out->rgb[k] = fmin(out->rgb[k], 1);
	return 0;
}

int color_from_value(const struct value *v, enum color_role role, struct arena *arena, struct color *out,
		     struct error *e)
{
	double x;
	bool is_constant = false; /* constant over wavelengths rather than white */
	switch (v->type) {
	case VALUE_RGB:
		if (color_from_rgb(v->as.rgb, role, out))
			return error_set(e, EINVAL, "rgb %g %g %g: must be within [0, %g]", v->as.rgb[0], v->as.rgb[1],
					 v->as.rgb[2], role_max(role));
		return 0;
	case VALUE_SPECTRUM:
		if (v->as.spectrum.count > 1)
			return color_from_spectrum(v, role, arena, out, e);
		if (v->as.spectrum.count == 0)
			return error_set(e, EINVAL, "a spectrum without values");
		x = v->as.spectrum.value[0];
		is_constant = true;
		break;
	case VALUE_FLOAT:
		x = v->as.number;
		break;
	case VALUE_INT:
		x = (double)v->as.integer;
		break;
	default:
		return error_set(e, EINVAL, "not a colour");
	}
	if (!(x >= 0) || !(x <= role_max(role)))
		return error_set(e, EINVAL, "%g: must be within [0, %g]", x, role_max(role));
	*out = is_constant ? color_constant(x) : color_white(x, role);
	if (is_constant && role == COLOR_ILLUMINANT)
		compute_rgb(out, false);
	return 0;
}

static inline spectrum eval_lanes(const struct color *c, const struct wavelengths *w, int lanes)
{
	spectrum s = spectrum_constant(c->scale);
	if (c->is_sigmoid)
		for (int i = 0; i < lanes; i++) {
			double nm = w->nm[i];
			s.v[i] *=
				upsample_sigmoid((c->coefficient[0] * nm + c->coefficient[1]) * nm + c->coefficient[2]);
		}
	if (c->count)
		for (int i = 0; i < lanes; i++)
			s.v[i] *= table_value(c, w->nm[i]);
	if (c->is_times_d65)
		for (int i = 0; i < lanes; i++)
			s.v[i] *= color_d65(w->nm[i]);
	return s;
}

spectrum color_eval_colored(const struct color *c, const struct wavelengths *w)
{
	if (w->is_rgb)
		return c->has_rgb ? spectrum_scale(c->scale, spectrum_from_rgb(c->rgb)) : spectrum_constant(c->scale);
	if (c->kind == COLOR_KIND_CONSTANT)
		return spectrum_constant(c->scale);
	if (w->period)
		return spectrum_repeat(eval_lanes(c, w, (int)w->period), (int)w->period);
	return eval_lanes(c, w, SPECTRUM_LANES);
}

void color_eval_pair(const struct color *a, const struct color *b, const struct wavelengths *w, spectrum out[2])
{
	if (!a->count || a->nm != b->nm || a->is_zero_outside || WAVELENGTHS_GREY(w) || w->is_rgb) {
		out[0] = color_eval(a, w);
		out[1] = color_eval(b, w);
		return;
	}
	for (unsigned i = 0; i < SPECTRUM_LANES; i++) {
		unsigned source_lane = w->period ? i % w->period : i;
		if (source_lane < i) {
			out[0].v[i] = out[0].v[source_lane];
			out[1].v[i] = out[1].v[source_lane];
			continue;
		}
		struct table_position p = find_position(a, w->nm[i]);
		out[0].v[i] = a->scale * value_at_position(a, p);
		out[1].v[i] = b->scale * value_at_position(b, p);
	}
}

/* Returns the maximum of the sigmoid, where the polynomial has its own: at an end of the range, or at its vertex. */
static double sigmoid_max(const double c[3])
{
	double nm[3] = {WAVELENGTH_MIN, WAVELENGTH_MAX, WAVELENGTH_MIN};
	double vertex = -c[1] / (2 * c[0]);
	if (c[0] != 0 && vertex > WAVELENGTH_MIN && vertex < WAVELENGTH_MAX)
		nm[2] = vertex;
	double m = 0;
	for (int i = 0; i < 3; i++)
		m = fmax(m, upsample_sigmoid((c[0] * nm[i] + c[1]) * nm[i] + c[2]));
	return m;
}

double color_max_rgb_reflectance(const double rgb[3])
{
	if (rgb[0] == rgb[1] && rgb[1] == rgb[2])
		return rgb[0];
	double t[3], c[3];
	look_up_coefficients(rgb, t);
	coefficients_in_nm(t, c);
	return sigmoid_max(c);
}

double color_max_d65(void)
{
	double largest = 0;
	for (int nm = CIE_FIRST_NM; nm <= CIE_LAST_NM; nm++)
		largest = fmax(largest, color_d65(nm));
	return largest;
}

static bool is_invisible(const struct color *c)
{
	return c->is_zero_outside && (c->nm[0] > WAVELENGTH_MAX || c->nm[c->count - 1] < WAVELENGTH_MIN);
}

double color_max(const struct color *c)
{
	double m = is_invisible(c) ? 0 : c->scale;
	if (c->is_sigmoid)
		m *= sigmoid_max(c->coefficient);
	if (c->count) {
		double largest = 0;
		for (uint32_t i = 0; i < c->count; i++)
			largest = fmax(largest, c->value[i]);
		m *= largest;
	}
	if (c->is_times_d65)
		m *= color_max_d65();
	return m;
}

double color_mean(const struct color *c)
{
	enum { STEPS = 32 };
	double sum = 0;
	for (int i = 0; i < STEPS; i++) {
		struct wavelengths w = wavelengths_sample((i + 0.5) / (SPECTRUM_LANES * STEPS));
		sum += spectrum_mean(color_eval(c, &w));
	}
	return sum / STEPS;
}
