/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads the arrays of a file: phi_i and theta_i, in radians; ndf and sigma (azimuth, polar angle); vndf and luminance
 * (phi_i, theta_i, y, x); spectra (phi_i, theta_i, wavelength, y, x) with wavelengths in nm, or rgb with 3 channels
 * instead of wavelengths; jacobian, a byte. All arrays but jacobian are 32-bit floats. Spectra are transposed so that
 * the wavelengths of a node are adjacent in memory, without those that do not matter to visible light.
 *
 * Fails if an array is missing, has the wrong type or a size that disagrees with that of others; if a number is not
 * finite or beyond 1e30; if a density is negative or nowhere positive; or if angles or wavelengths are not ascending.
 * Arrays lie within the file, which bounds allocations.
 */
#include "worker/render/bsdf/measured_read.h"

#include "common/base/liveness.h"
#include "worker/render/bsdf/tensor_input.h"
#include "worker/render/bsdf/warp.h"
#include "worker/render/scene/asset_part.h"

static int read_plane(const struct tensor_input *in, const char *name, struct measured_plane *p)
{
	struct tensor t;
	double *value = NULL;
	int rc = tensor_input_find(in, name, TENSOR_FLOATS, 2, &t);
	if (!rc && (t.shape[0] < 2 || t.shape[1] < 2))
		rc = tensor_fault(in, EINVAL, name, "needs at least two numbers per side");
	if (!rc)
		rc = tensor_numbers(in, &t, name, &value);
	for (uint64_t i = 0; !rc && i < t.count; i++)
		if (value[i] < 0)
			rc = tensor_fault(in, EINVAL, name, "has a negative number");
	if (!rc)
		*p = (struct measured_plane){(uint32_t)t.shape[1], (uint32_t)t.shape[0], value};
	return rc;
}

/* Checks the sizes of an array that has one grid for each slice: the first two are those of the axes, the last two
 * those of the grid. */
static int check_slices(const struct tensor_input *in, const struct measured *m, const char *name,
			const struct tensor *t)
{
	if (t->shape[0] != m->axes.count[0] || t->shape[1] != m->axes.count[1])
		return tensor_fault(in, EINVAL, name, "has other sizes than phi_i and theta_i");
	if (t->shape[t->dimensions - 1] < 2 || t->shape[t->dimensions - 2] < 2)
		return tensor_fault(in, EINVAL, name, "needs at least two numbers per side");
	return 0;
}

static int read_warp(const struct tensor_input *in, const struct measured *m, const char *name, struct warp_table *out)
{
	struct tensor t;
	double *value = NULL;
	int rc = tensor_input_find(in, name, TENSOR_FLOATS, 4, &t);
	if (!rc)
		rc = check_slices(in, m, name, &t);
	if (!rc)
		rc = tensor_numbers(in, &t, name, &value);
	if (rc)
		return rc;
	rc = warp_table_make(out, (uint32_t)(t.shape[0] * t.shape[1]), (uint32_t)t.shape[3], (uint32_t)t.shape[2],
			     value, in->arena);
	if (rc)
		return tensor_fault(in, -rc, name,
				    rc == -ENOMEM ? "does not fit into memory"
						  : "has a negative number, or is 0 everywhere");
	return 0;
}

/* ---- colours ---- */

/* Keeps those of `all` wavelengths that matter to visible light; *first: index of the first one kept. */
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

static int read_rgb(const struct tensor_input *in, struct measured *m, const struct tensor *t)
{
	size_t nodes = (size_t)m->side * m->side, slices = t->shape[0] * t->shape[1];
	float *rgb = arena_alloc(in->arena, slices * nodes, 3 * sizeof *rgb);
	if (t->shape[2] != 3)
		return tensor_fault(in, EINVAL, "rgb", "needs 3 channels");
	if (!rgb)
		return tensor_fault(in, ENOMEM, "rgb", "does not fit into memory");
	for (size_t s = 0; s < slices; s++)
		for (size_t i = 0; i < nodes; i++)
			for (size_t c = 0; c < 3; c++)
				rgb[3 * (s * nodes + i) + c] = (float)tensor_value(t, (3 * s + c) * nodes + i);
	m->rgb = rgb;
	return 0;
}

static int read_spectra(const struct tensor_input *in, struct measured *m, const struct tensor *t)
{
	size_t nodes = (size_t)m->side * m->side, slices = t->shape[0] * t->shape[1];
	const double *nm;
	uint32_t all, first;
	double(*weight)[3] = NULL;
	int rc = tensor_axis(in, "wavelengths", TENSOR_FLOATS, 1, &all, &nm);
	if (!rc && t->shape[2] != all)
		rc = tensor_fault(in, EINVAL, "spectra", "needs one entry for each of the wavelengths");
	if (!rc)
		rc = tensor_rgb_weights(in, nm, all, &weight);
	if (rc)
		return rc;
	keep_visible(m, nm, all, &first);
	float *lanes = arena_alloc(in->arena, slices * nodes * m->count, sizeof *lanes),
	      *rgb = arena_alloc(in->arena, slices * nodes, 3 * sizeof *rgb);
	if (!lanes || !rgb)
		return tensor_fault(in, ENOMEM, "spectra", "does not fit into memory");
	for (size_t s = 0; s < slices; s++) {
		for (size_t i = 0; i < nodes; i++) {
			double sum[3] = {0, 0, 0};
			for (size_t k = 0; k < all; k++) {
				double x = tensor_value(t, (s * all + k) * nodes + i);
				for (int c = 0; c < 3; c++)
					sum[c] += weight[k][c] * x;
				if (k >= first && k < first + m->count)
					lanes[(s * nodes + i) * m->count + k - first] = (float)x;
			}
			for (size_t c = 0; c < 3; c++)
				rgb[3 * (s * nodes + i) + c] = (float)sum[c];
		}
		liveness_tick();
	}
	m->spectrum = lanes;
	m->rgb = rgb;
	return 0;
}

static int read_colors(const struct tensor_input *in, struct measured *m)
{
	struct tensor t;
	bool spectral = tensor_find(in->bytes, in->size, "wavelengths", &t) == 0;
	const char *name = spectral ? "spectra" : "rgb";
	int rc = tensor_input_find(in, name, TENSOR_FLOATS, 5, &t);
	if (!rc)
		rc = check_slices(in, m, name, &t);
	if (!rc && (t.shape[3] != t.shape[4] || t.shape[3] != m->luminance.width || t.shape[4] != m->luminance.height))
		rc = tensor_fault(in, EINVAL, name, "has other sizes than luminance, or is no square");
	if (!rc)
		rc = tensor_check_finite(in, &t, name);
	if (rc)
		return rc;
	m->side = (uint32_t)t.shape[3];
	return spectral ? read_spectra(in, m, &t) : read_rgb(in, m, &t);
}

/* ---- the whole ---- */

/* Follows Mitsuba's rules: a material with up to two azimuths is isotropic. */
static int find_symmetry(const struct tensor_input *in, struct measured *m)
{
	uint32_t count = m->axes.count[0];
	m->isotropic = count <= 2;
	m->symmetry = 1;
	if (m->isotropic)
		return 0;
	double parts = rint(2 * WARP_PI / (m->axes.at[0][count - 1] - m->axes.at[0][0]));
	if (parts != 1 && parts != 2 && parts != 4)
		return tensor_fault(in, ENOTSUP, "phi_i",
				    "spans neither the circle nor a half or a quarter of it, which is not supported");
	m->symmetry = (int)parts;
	return 0;
}

static int read_material(const struct tensor_input *in, struct measured *m)
{
	struct tensor flag = {.count = 0};
	int rc = tensor_axis(in, "phi_i", TENSOR_FLOATS, 1, &m->axes.count[0], &m->axes.at[0]);
	if (!rc)
		rc = tensor_axis(in, "theta_i", TENSOR_FLOATS, 1, &m->axes.count[1], &m->axes.at[1]);
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
		rc = tensor_input_find(in, "jacobian", TENSOR_BYTES, 1, &flag);
	m->microfacets = !rc && flag.bytes[0] != 0;
	return rc ? rc : read_colors(in, m);
}

int measured_read(struct measured *m, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct asset_range a;
	int rc = asset_part_open(&a, n, build->assets, e);
	if (rc)
		return rc;
	const struct tensor_input in = {a.bytes, a.size, n, build->arena, e};
	rc = read_material(&in, m);
	asset_range_close(&a, build->assets);
	return rc;
}

/* Returns 1 / sqrt(pi D) at the maximum of D, with D scaled such that the integral of D cos(theta) over the hemisphere
 * is 1. The coordinate x of the square of half vectors is sqrt(2 theta / pi). */
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
