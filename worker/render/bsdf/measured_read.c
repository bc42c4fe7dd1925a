/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The arrays of a file: phi_i and theta_i, in radians; ndf and sigma (azimuth, polar angle); vndf and luminance (phi_i,
 * theta_i, y, x); spectra (phi_i, theta_i, wavelength, y, x) with wavelengths in nm, or rgb with 3 in their place;
 * jacobian, a byte. All others are 32-bit floats. Spectra are transposed, so that what a path asks for is together, and
 * what is invisible is left out.
 *
 * Failures: an array that is missing, of another type or of sizes that disagree with others; numbers beyond NUMBER_MAX
 * or not finite, densities that are negative or nowhere positive, angles or wavelengths that do not ascend. Arrays are
 * within the file, which bounds what is allocated.
 */
#include "worker/render/bsdf/measured_read.h"

#include "common/base/bytes.h"
#include "common/base/color.h"
#include "common/base/liveness.h"
#include "worker/render/bsdf/tensor.h"
#include "worker/render/bsdf/warp.h"
#include "worker/render/math/cie.h"
#include "worker/render/math/search.h"
#include "worker/render/scene/asset_part.h"

enum { SIDE_MAX = 1 << 16, EXPONENT = 0x7f800000 /* of a 32-bit float */ };
#define NUMBER_MAX 1e30

struct input {
	const unsigned char *bytes;
	size_t size;
	const struct scene_node *node;
	struct arena *arena;
	struct error *error;
};

static int fault(const struct input *in, int code, const char *name, const char *what)
{
	return node_error(in->node, in->error, code, "%s: %s%s%s", node_string(in->node, "filename", ""), name,
			  *name ? " " : "", what);
}

static int find(const struct input *in, const char *name, enum tensor_type type, unsigned dimensions,
		struct tensor *out)
{
	int rc = tensor_find(in->bytes, in->size, name, out);
	if (rc == -ENOENT)
		return fault(in, EINVAL, name, "is missing: this is no measured material");
	if (rc)
		return fault(in, -rc, "",
			     rc == -ENOTSUP ? "this version of a file of arrays is not supported"
					    : "this is no file of arrays (.bsdf), or it is cut off");
	if (out->type != (unsigned)type || out->dimensions != dimensions)
		return fault(in, EINVAL, name, "has another type or number of dimensions than it should");
	for (unsigned i = 0; i < dimensions; i++)
		if (out->shape[i] < 1 || out->shape[i] > SIDE_MAX)
			return fault(in, EINVAL, name, "has a side of 0 or of more than 65,536");
	return 0;
}

static double value_at(const struct tensor *t, uint64_t i)
{
	return (double)get_float(t->bytes + 4 * i);
}

static int check_finite(const struct input *in, const struct tensor *t, const char *name)
{
	for (uint64_t i = 0; i < t->count; i++) {
		/* By its bits: NaNs that signal must not be compared. */
		if ((get32(t->bytes + 4 * i) & EXPONENT) == EXPONENT || fabs(value_at(t, i)) > NUMBER_MAX)
			return fault(in, EINVAL, name, "has a number beyond 1e30, or one that is not finite");
		if (i % SIDE_MAX == 0)
			tick();
	}
	return 0;
}

/* All numbers, as doubles. NULL in *out if code is not 0. */
static int numbers(const struct input *in, const struct tensor *t, const char *name, double **out)
{
	int rc = check_finite(in, t, name);
	*out = rc ? NULL : arena_alloc(in->arena, t->count, sizeof **out);
	if (rc || !*out)
		return rc ? rc : fault(in, ENOMEM, name, "does not fit into memory");
	for (uint64_t i = 0; i < t->count; i++)
		(*out)[i] = value_at(t, i);
	return 0;
}

static int read_axis(const struct input *in, const char *name, uint32_t *count, const double **at)
{
	struct tensor t;
	double *value = NULL;
	int rc = find(in, name, TENSOR_FLOATS, 1, &t);
	if (!rc)
		rc = numbers(in, &t, name, &value);
	if (rc)
		return rc;
	*count = (uint32_t)t.count;
	*at = value;
	for (uint32_t i = 1; i < *count; i++)
		if (!(value[i] > value[i - 1]))
			return fault(in, EINVAL, name, "must ascend");
	return 0;
}

static int read_plane(const struct input *in, const char *name, struct measured_plane *p)
{
	struct tensor t;
	double *value = NULL;
	int rc = find(in, name, TENSOR_FLOATS, 2, &t);
	if (!rc && (t.shape[0] < 2 || t.shape[1] < 2))
		rc = fault(in, EINVAL, name, "needs two numbers a side");
	if (!rc)
		rc = numbers(in, &t, name, &value);
	for (uint64_t i = 0; !rc && i < t.count; i++)
		if (value[i] < 0)
			rc = fault(in, EINVAL, name, "has a negative number");
	if (!rc)
		*p = (struct measured_plane){(uint32_t)t.shape[1], (uint32_t)t.shape[0], value};
	return rc;
}

/* The sizes of an array for each slice, whose last two are those of a grid. */
static int check_slices(const struct input *in, const struct measured *m, const char *name, const struct tensor *t)
{
	if (t->shape[0] != m->axes.count[0] || t->shape[1] != m->axes.count[1])
		return fault(in, EINVAL, name, "has other sizes than phi_i and theta_i");
	if (t->shape[t->dimensions - 1] < 2 || t->shape[t->dimensions - 2] < 2)
		return fault(in, EINVAL, name, "needs two numbers a side");
	return 0;
}

static int read_warp(const struct input *in, const struct measured *m, const char *name, struct warp_table *out)
{
	struct tensor t;
	double *value = NULL;
	int rc = find(in, name, TENSOR_FLOATS, 4, &t);
	if (!rc)
		rc = check_slices(in, m, name, &t);
	if (!rc)
		rc = numbers(in, &t, name, &value);
	if (rc)
		return rc;
	rc = warp_table_make(out, (uint32_t)(t.shape[0] * t.shape[1]), (uint32_t)t.shape[3], (uint32_t)t.shape[2],
			     value, in->arena);
	if (rc)
		return fault(in, -rc, name,
			     rc == -ENOMEM ? "does not fit into memory" : "has a negative number, or is 0 everywhere");
	return 0;
}

/* ---- colours ---- */

/* What each wavelength adds to R, G and B under D65, for values that are linear between them and the same beyond. */
static int rgb_weights(const struct input *in, const double *nm, uint32_t count, double (**out)[3])
{
	double(*weight)[3] = arena_alloc(in->arena, count, sizeof *weight), sum[3] = {0, 0, 0}, white[3];
	if (!weight)
		return fault(in, ENOMEM, "wavelengths", "do not fit into memory");
	for (int i = 0; i < CIE_COUNT; i++) {
		double at = CIE_FIRST_NM + i, part = 0;
		uint32_t k = 0;
		if (count > 1 && at > nm[0]) {
			k = search_cell(nm, count - 1, at);
			part = fmin((at - nm[k]) / (nm[k + 1] - nm[k]), 1);
		}
		for (int c = 0; c < 3; c++) {
			double x = cie_observer[i][c] * color_d65(at);
			weight[k][c] += (1 - part) * x;
			if (part > 0)
				weight[k + 1][c] += part * x;
			sum[c] += x;
		}
	}
	rec709_from_xyz(sum, white);
	for (uint32_t k = 0; k < count; k++) {
		double rgb[3];
		rec709_from_xyz(weight[k], rgb);
		for (int c = 0; c < 3; c++)
			weight[k][c] = rgb[c] / white[c];
	}
	*out = weight;
	return 0;
}

/* Those of `all` wavelengths that matter to what is visible. */
static void keep_visible(struct measured *m, const double *nm, uint32_t all, uint32_t *first)
{
	uint32_t end = all;
	*first = 0;
	while (*first + 1 < all && nm[*first + 1] <= WAVELENGTH_MIN)
		++*first;
	while (end - 1 > *first && nm[end - 2] >= WAVELENGTH_MAX)
		end--;
	m->nm = nm + *first;
	m->count = end - *first;
}

static int read_rgb(const struct input *in, struct measured *m, const struct tensor *t)
{
	size_t nodes = (size_t)m->side * m->side, slices = t->shape[0] * t->shape[1];
	float *rgb = arena_alloc(in->arena, slices * nodes, 3 * sizeof *rgb);
	if (t->shape[2] != 3)
		return fault(in, EINVAL, "rgb", "needs 3 channels");
	if (!rgb)
		return fault(in, ENOMEM, "rgb", "does not fit into memory");
	for (size_t s = 0; s < slices; s++)
		for (size_t i = 0; i < nodes; i++)
			for (size_t c = 0; c < 3; c++)
				rgb[3 * (s * nodes + i) + c] = (float)value_at(t, (3 * s + c) * nodes + i);
	m->rgb = rgb;
	return 0;
}

static int read_spectra(const struct input *in, struct measured *m, const struct tensor *t)
{
	size_t nodes = (size_t)m->side * m->side, slices = t->shape[0] * t->shape[1];
	const double *nm;
	uint32_t all, first;
	double(*weight)[3] = NULL;
	int rc = read_axis(in, "wavelengths", &all, &nm);
	if (!rc && t->shape[2] != all)
		rc = fault(in, EINVAL, "spectra", "has another number of wavelengths than there are");
	if (!rc)
		rc = rgb_weights(in, nm, all, &weight);
	if (rc)
		return rc;
	keep_visible(m, nm, all, &first);
	float *lanes = arena_alloc(in->arena, slices * nodes * m->count, sizeof *lanes),
	      *rgb = arena_alloc(in->arena, slices * nodes, 3 * sizeof *rgb);
	if (!lanes || !rgb)
		return fault(in, ENOMEM, "spectra", "does not fit into memory");
	for (size_t s = 0; s < slices; s++) {
		for (size_t i = 0; i < nodes; i++) {
			double sum[3] = {0, 0, 0};
			for (size_t k = 0; k < all; k++) {
				double x = value_at(t, (s * all + k) * nodes + i);
				for (int c = 0; c < 3; c++)
					sum[c] += weight[k][c] * x;
				if (k >= first && k < first + m->count)
					lanes[(s * nodes + i) * m->count + k - first] = (float)x;
			}
			for (size_t c = 0; c < 3; c++)
				rgb[3 * (s * nodes + i) + c] = (float)sum[c];
		}
		tick();
	}
	m->spectrum = lanes;
	m->rgb = rgb;
	return 0;
}

static int read_colors(const struct input *in, struct measured *m)
{
	struct tensor t;
	bool spectral = tensor_find(in->bytes, in->size, "wavelengths", &t) == 0;
	const char *name = spectral ? "spectra" : "rgb";
	int rc = find(in, name, TENSOR_FLOATS, 5, &t);
	if (!rc)
		rc = check_slices(in, m, name, &t);
	if (!rc && (t.shape[3] != t.shape[4] || t.shape[3] != m->luminance.width || t.shape[4] != m->luminance.height))
		rc = fault(in, EINVAL, name, "has other sizes than luminance, or is no square");
	if (!rc)
		rc = check_finite(in, &t, name);
	if (rc)
		return rc;
	m->side = (uint32_t)t.shape[3];
	return spectral ? read_spectra(in, m, &t) : read_rgb(in, m, &t);
}

/* ---- the whole ---- */

/* Mitsuba's rules: up to two azimuths are an isotropic material. */
static int find_symmetry(const struct input *in, struct measured *m)
{
	uint32_t count = m->axes.count[0];
	m->isotropic = count <= 2;
	m->symmetry = 1;
	if (m->isotropic)
		return 0;
	double parts = rint(2 * WARP_PI / (m->axes.at[0][count - 1] - m->axes.at[0][0]));
	if (parts != 1 && parts != 2 && parts != 4)
		return fault(in, ENOTSUP, "phi_i",
			     "spans neither the circle nor a half or a quarter of it, which is not supported");
	m->symmetry = (int)parts;
	return 0;
}

static int read_material(const struct input *in, struct measured *m)
{
	struct tensor flag = {.count = 0};
	int rc = read_axis(in, "phi_i", &m->axes.count[0], &m->axes.at[0]);
	if (!rc)
		rc = read_axis(in, "theta_i", &m->axes.count[1], &m->axes.at[1]);
	if (!rc)
		rc = find_symmetry(in, m);
	if (!rc)
		rc = read_plane(in, "ndf", &m->normals);
	if (!rc)
		rc = read_plane(in, "sigma", &m->area);
	if (!rc)
		rc = read_warp(in, m, "vndf", &m->visible);
	if (!rc)
		rc = read_warp(in, m, "luminance", &m->luminance);
	if (!rc)
		rc = find(in, "jacobian", TENSOR_BYTES, 1, &flag);
	m->microfacets = !rc && flag.bytes[0] != 0;
	return rc ? rc : read_colors(in, m);
}

int measured_read(struct measured *m, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct asset_range a;
	int rc = asset_part_open(&a, n, build->assets, e);
	if (rc)
		return rc;
	const struct input in = {a.bytes, a.size, n, build->arena, e};
	rc = read_material(&in, m);
	asset_range_close(&a, build->assets);
	return rc;
}

/* 1 / sqrt(pi D) at the maximum of D, scaled such that the integral of D cos(theta) over the hemisphere is 1. Of a
 * square of half vectors, x is the root of theta's share of a right angle. */
double measured_alpha(const struct measured *m)
{
	const struct measured_plane *p = &m->normals;
	double largest = 0, sum = 0;
	for (uint32_t y = 0; y < p->height; y++)
		for (uint32_t x = 0; x < p->width; x++) {
			double u = (double)x / (p->width - 1), theta = 0.5 * WARP_PI * u * u,
			       d = p->value[(size_t)y * p->width + x];
			double ends =
				(x == 0 || x == p->width - 1 ? 0.5 : 1) * (y == 0 || y == p->height - 1 ? 0.5 : 1);
			sum += ends * d * cos(theta) * sin(theta) * u;
			largest = fmax(largest, d);
		}
	sum *= 2 * WARP_PI * WARP_PI / ((double)(p->width - 1) * (p->height - 1));
	return largest > 0 ? sqrt(sum / (WARP_PI * largest)) : INFINITY;
}
