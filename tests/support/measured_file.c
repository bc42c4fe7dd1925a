/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The formulas come first, then the warp of a table of normals, the arrays of the file, and the file. Warps are
 * inverted by bisection of sums over the nodes: slow, but with no error in common with the renderer.
 *
 * Running out of memory aborts.
 */
#include "tests/support/measured_file.h"
#include "tests/support/polarized_file.h"
#include "tests/support/tensor_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
enum { WAVELENGTHS = 7 };

double measured_file_tint(double nm)
{
	return 0.4 + 0.3 * (nm - 550) / 250;
}

double measured_file_theta(const struct measured_file_material *k, int i)
{
	double x = (double)i / (k->elevations - 1);
	return x * x * MEASURED_THETA_MAX;
}

static double material_phi(const struct measured_file_material *k, int i)
{
	return k->azimuths == 1 ? 0 : -PI + 2 * PI / k->symmetry * i / (k->azimuths - 1);
}

/* ---- the formulas ---- */

/* Transforms a direction to the axes of the facets. */
static vec3 into_facet_frame(const struct measured_file_material *k, vec3 w)
{
	double c = cos(k->rotation), s = sin(k->rotation);
	return (vec3){c * w.x + s * w.y, c * w.y - s * w.x, w.z};
}

static double facet_density(const struct measured_file_material *k, vec3 h)
{
	vec3 m = into_facet_frame(k, h);
	double x = m.x / k->alpha_u, y = m.y / k->alpha_v, r = x * x + y * y + m.z * m.z;
	return 1 / (PI * k->alpha_u * k->alpha_v * r * r);
}

/* cos(theta) / G1 */
static double cosine_over_g1(const struct measured_file_material *k, vec3 v)
{
	vec3 w = into_facet_frame(k, v);
	double x = k->alpha_u * w.x, y = k->alpha_v * w.y;
	return 0.5 * (w.z + sqrt(w.z * w.z + x * x + y * y));
}

/* Returns what the file stores for light from wi. */
static double stored_color(const struct measured_file_material *k, double tint, vec3 wo, vec3 wi)
{
	vec3 h = vec3_normalize(vec3_add(wo, wi));
	double fresnel = k->is_white ? 1 : tint + (1 - tint) * pow(1 - fmin(vec3_dot(wo, h), 1), 5);
	double s = wi.z > 0 ? fresnel * wi.z / cosine_over_g1(k, wi) : 0;
	return k->is_absolute ? s * facet_density(k, h) / (4 * cosine_over_g1(k, wo)) : s;
}

double measured_file_reflected(const struct measured_file_material *k, double tint, vec3 wo, vec3 wi)
{
	vec3 h = vec3_normalize(vec3_add(wo, wi));
	double s = stored_color(k, tint, wo, wi);
	return k->is_absolute ? s : s * facet_density(k, h) / (4 * cosine_over_g1(k, wo));
}

static vec3 node_direction(double x, double y)
{
	double theta = 0.5 * PI * x * x, phi = (2 * y - 1) * PI;
	return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

/* ---- the warp of a grid of n x n values ---- */

/* Returns the integral from 0 to x of the piecewise linear function with these n values. */
static double integral(const double *value, int n, double x)
{
	double sum = 0, step = 1.0 / (n - 1);
	for (int i = 0; i + 1 < n && i * step < x; i++) {
		double part = fmin((x - i * step) / step, 1);
		sum += step * part * (value[i] + 0.5 * part * (value[i + 1] - value[i]));
	}
	return sum;
}

static double inverse_integral(const double *value, int n, double fraction)
{
	double target = fraction * integral(value, n, 1), low = 0, high = 1;
	for (int i = 0; i < 50; i++) {
		double middle = 0.5 * (low + high);
		if (integral(value, n, middle) < target)
			low = middle;
		else
			high = middle;
	}
	return low;
}

static void warp(const double *grid, int n, double u, double v, double *x, double *y)
{
	double line[256];
	for (int i = 0; i < n; i++)
		line[i] = integral(grid + (size_t)i * (size_t)n, n, 1);
	*y = inverse_integral(line, n, v);
	int row = (int)fmin(*y * (n - 1), n - 2);
	double part = *y * (n - 1) - row;
	for (int i = 0; i < n; i++)
		line[i] = (1 - part) * grid[row * n + i] + part * grid[(row + 1) * n + i];
	*x = inverse_integral(line, n, u);
}

/* ---- the arrays ---- */

static double channel_wavelength(const struct measured_file_material *k, int i)
{
	static const double rgb[3] = {600, 550, 450};
	return k->is_rgb ? rgb[i] : 340 + 90 * i;
}

static void add_axes(struct tensor_file *f, const struct measured_file_material *k)
{
	unsigned char *at = tensor_file_add(f, "phi_i", TENSOR_FLOATS, 1, &k->azimuths);
	for (int i = 0; i < k->azimuths; i++)
		tensor_file_put_float(&at, material_phi(k, i));
	at = tensor_file_add(f, "theta_i", TENSOR_FLOATS, 1, &k->elevations);
	for (int i = 0; i < k->elevations; i++)
		tensor_file_put_float(&at, measured_file_theta(k, i));
	tensor_file_add(f, "jacobian", TENSOR_BYTES, 1, (const int[]){1})[0] = !k->is_absolute;
	tensor_file_add(f, "description", TENSOR_BYTES, 1, (const int[]){4});
	if (k->is_rgb)
		return;
	at = tensor_file_add(f, "wavelengths", TENSOR_FLOATS, 1, (const int[]){WAVELENGTHS});
	for (int i = 0; i < WAVELENGTHS; i++)
		tensor_file_put_float(&at, channel_wavelength(k, i));
}

static void add_planes(struct tensor_file *f, const struct measured_file_material *k)
{
	int n = k->normal_nodes;
	unsigned char *ndf = tensor_file_add(f, "ndf", TENSOR_FLOATS, 2, (const int[]){n, n}),
		      *sigma = tensor_file_add(f, "sigma", TENSOR_FLOATS, 2, (const int[]){n, n});
	for (int y = 0; y < n; y++)
		for (int x = 0; x < n; x++) {
			vec3 w = node_direction((double)x / (n - 1), (double)y / (n - 1));
			tensor_file_put_float(&ndf, facet_density(k, w));
			tensor_file_put_float(&sigma, cosine_over_g1(k, w));
		}
}

static void compute_visible_normals(const struct measured_file_material *k, vec3 wo, double *grid)
{
	int n = k->normal_nodes;
	for (int y = 0; y < n; y++)
		for (int x = 0; x < n; x++) {
			double u = (double)x / (n - 1);
			vec3 m = node_direction(u, (double)y / (n - 1));
			double d = facet_density(k, m) * fmax(vec3_dot(wo, m), 0) * u * sin(0.5 * PI * u * u);
			grid[y * n + x] = (double)(float)d;
		}
}

/* The luminance differs from the colours, which is allowed: it only guides sampling. */
static void add_slices(struct tensor_file *f, const struct measured_file_material *k)
{
	int n = k->normal_nodes, side = k->color_nodes, channels = k->is_rgb ? 3 : WAVELENGTHS;
	int p = k->azimuths, t = k->elevations;
	unsigned char *vndf = tensor_file_add(f, "vndf", TENSOR_FLOATS, 4, (const int[]){p, t, n, n}),
		      *luminance = tensor_file_add(f, "luminance", TENSOR_FLOATS, 4, (const int[]){p, t, side, side}),
		      *color = tensor_file_add(f, k->is_rgb ? "rgb" : "spectra", TENSOR_FLOATS, 5,
					       (const int[]){p, t, channels, side, side});
	double *grid = calloc((size_t)n * (size_t)n, sizeof *grid);
	if (!grid || n > 256)
		abort();
	for (int slice = 0; slice < p * t; slice++) {
		double theta = measured_file_theta(k, slice % t), phi = material_phi(k, slice / t);
		vec3 wo = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
		compute_visible_normals(k, wo, grid);
		for (int i = 0; i < n * n; i++)
			tensor_file_put_float(&vndf, grid[i]);
		for (int i = 0; i < side * side; i++) {
			double u = (double)(i % side) / (side - 1), v = (double)(i / side) / (side - 1), x, y;
			warp(grid, n, u, v, &x, &y);
			vec3 m = node_direction(x, y), wi = vec3_sub(vec3_scale(2 * vec3_dot(wo, m), m), wo);
			tensor_file_put_float(&luminance, 0.2 + u * v);
			for (int c = 0; c < channels; c++) {
				unsigned char *at = color + 4 * ((slice * channels + c) * side * side + i);
				tensor_file_put_float(
					&at, stored_color(k, measured_file_tint(channel_wavelength(k, c)), wo, wi));
			}
		}
	}
	free(grid);
}

unsigned char *measured_file_make(const struct measured_file_material *k, size_t *size)
{
	struct tensor_file f = {.count = 0};
	add_axes(&f, k);
	add_planes(&f, k);
	add_slices(&f, k);
	return tensor_file_end(&f, size);
}

/* Brighter where facets are flat, different on either side of these, with a corner that was not measured. */
static double flat_facets(double phi_d, double theta_d, double theta_h, double nm)
{
	if (theta_d + theta_h > 2.5)
		return NAN;
	return (0.02 + 0.3 * exp(-6 * theta_h * theta_h)) * (1 + 0.3 * cos(phi_d) * sin(theta_d)) * nm / 600;
}

const struct memory_file *measured_file_all(void)
{
	static const struct measured_file_material kinds[] = {
		{.name = "isotropic.bsdf",
		 .alpha_u = 0.4,
		 .alpha_v = 0.4,
		 .azimuths = 1,
		 .symmetry = 1,
		 .elevations = 6,
		 .normal_nodes = 24,
		 .color_nodes = 8},
		{.name = "anisotropic.bsdf",
		 .alpha_u = 0.6,
		 .alpha_v = 0.3,
		 .azimuths = 5,
		 .symmetry = 2,
		 .elevations = 5,
		 .normal_nodes = 24,
		 .color_nodes = 6},
		{.name = "rgb.bsdf",
		 .alpha_u = 0.7,
		 .alpha_v = 0.7,
		 .azimuths = 1,
		 .symmetry = 1,
		 .elevations = 5,
		 .normal_nodes = 16,
		 .color_nodes = 6,
		 .is_rgb = true,
		 .is_absolute = true},
	};
	enum { KINDS = sizeof kinds / sizeof *kinds };
	static struct memory_file files[KINDS + 2];
	for (size_t i = 0; i < KINDS && !files[i].name; i++) {
		size_t size;
		unsigned char *bytes = measured_file_make(&kinds[i], &size);
		files[i] = (struct memory_file){kinds[i].name, bytes, size};
	}
	if (!files[KINDS].name) {
		size_t size;
		unsigned char *bytes = polarized_file_make(flat_facets, 9, 5, &size);
		files[KINDS] = (struct memory_file){"polarized.pbsdf", bytes, size};
	}
	return files;
}
