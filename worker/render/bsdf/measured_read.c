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
		rc = tensor_input_error(in, EINVAL, name, "needs at least two numbers per side");
	if (!rc)
		rc = tensor_read_numbers(in, &t, name, &value);
	for (uint64_t i = 0; !rc && i < t.count; i++)
		if (value[i] < 0)
			rc = tensor_input_error(in, EINVAL, name, "has a negative number");
	if (!rc)
		*p = (struct measured_plane){(uint32_t)t.shape[1], (uint32_t)t.shape[0], value};
	return rc;
}

/* Checks the sizes of an array that has one grid for each slice: the first two are those of the axes, the last two
 * those of the grid. */
static int check_slices(const struct tensor_input *in, const struct measured_material *m, const char *name,
			const struct tensor *t)
{
	if (t->shape[0] != m->axes.count[0] || t->shape[1] != m->axes.count[1])
		return tensor_input_error(in, EINVAL, name, "has other sizes than phi_i and theta_i");
	if (t->shape[t->dimension_count - 1] < 2 || t->shape[t->dimension_count - 2] < 2)
		return tensor_input_error(in, EINVAL, name, "needs at least two numbers per side");
	return 0;
}

static int read_warp(const struct tensor_input *in, const struct measured_material *m, const char *name,
		     struct warp_table *out)
{
	struct tensor t;
	double *value = NULL;
	int rc = tensor_input_find(in, name, TENSOR_FLOATS, 4, &t);
	if (!rc)
		rc = check_slices(in, m, name, &t);
	if (!rc)
		rc = tensor_read_numbers(in, &t, name, &value);
	if (rc)
		return rc;
	rc = warp_table_init(out, (uint32_t)(t.shape[0] * t.shape[1]), (uint32_t)t.shape[3], (uint32_t)t.shape[2],
			     value, in->arena);
	if (rc)
		return tensor_input_error(in, -rc, name,
					  rc == -ENOMEM ? "does not fit into memory"
							: "has a negative number, or is 0 everywhere");
	return 0;
}

/* ---- colours ---- */

/* Keeps those of `file_count` wavelengths that matter to visible light; *first: index of the first one kept. */
static void trim_to_visible(struct measured_material *m, const double *nm, uint32_t file_count, uint32_t *first)
{
	uint32_t end = file_count;
	*first = 0;
	while (*first + 1 < file_count && nm[*first + 1] <= WAVELENGTH_MIN)
		++*first;
	while (end - 1 > *first && nm[end - 2] >= WAVELENGTH_MAX)
		end--;
	m->nm = nm + *first;
	m->wavelength_count = end - *first;
}

static int read_rgb(const struct tensor_input *in, struct measured_material *m, const struct tensor *t)
{
	size_t nodes = (size_t)m->nodes_per_side * m->nodes_per_side, slices = t->shape[0] * t->shape[1];
	float *rgb = arena_alloc(in->arena, slices * nodes, 3 * sizeof *rgb);
	if (t->shape[2] != 3)
		return tensor_input_error(in, EINVAL, "rgb", "needs 3 channels");
	if (!rgb)
		return tensor_input_error(in, ENOMEM, "rgb", "does not fit into memory");
	for (size_t s = 0; s < slices; s++)
		for (size_t i = 0; i < nodes; i++)
			for (size_t c = 0; c < 3; c++)
				rgb[3 * (s * nodes + i) + c] = (float)tensor_value(t, (3 * s + c) * nodes + i);
	m->rgb = rgb;
	return 0;
}

static int read_spectra(const struct tensor_input *in, struct measured_material *m, const struct tensor *t)
{
	size_t nodes = (size_t)m->nodes_per_side * m->nodes_per_side, slices = t->shape[0] * t->shape[1];
	const double *nm;
	uint32_t file_count, first;
	double(*weight)[3] = NULL;
	int rc = tensor_read_axis(in, "wavelengths", TENSOR_FLOATS, 1, &file_count, &nm);
	if (!rc && t->shape[2] != file_count)
		rc = tensor_input_error(in, EINVAL, "spectra", "needs one entry for each of the wavelengths");
	if (!rc)
		rc = tensor_rgb_weights(in, nm, file_count, &weight);
	if (rc)
		return rc;
	trim_to_visible(m, nm, file_count, &first);
	float *spectra = arena_alloc(in->arena, slices * nodes * m->wavelength_count, sizeof *spectra),
	      *rgb = arena_alloc(in->arena, slices * nodes, 3 * sizeof *rgb);
	if (!spectra || !rgb)
		return tensor_input_error(in, ENOMEM, "spectra", "does not fit into memory");
	for (size_t s = 0; s < slices; s++) {
		for (size_t i = 0; i < nodes; i++) {
			double sum[3] = {0, 0, 0};
			for (size_t k = 0; k < file_count; k++) {
				double x = tensor_value(t, (s * file_count + k) * nodes + i);
				for (int c = 0; c < 3; c++)
					sum[c] += weight[k][c] * x;
				if (k >= first && k < first + m->wavelength_count)
					spectra[(s * nodes + i) * m->wavelength_count + k - first] = (float)x;
			}
			for (size_t c = 0; c < 3; c++)
				rgb[3 * (s * nodes + i) + c] = (float)sum[c];
		}
		liveness_tick();
	}
	m->spectra = spectra;
	m->rgb = rgb;
	return 0;
}

static int read_colors(const struct tensor_input *in, struct measured_material *m)
{
	struct tensor t;
	bool spectral = tensor_find(in->bytes, in->size, "wavelengths", &t) == 0;
	const char *name = spectral ? "spectra" : "rgb";
	int rc = tensor_input_find(in, name, TENSOR_FLOATS, 5, &t);
	if (!rc)
		rc = check_slices(in, m, name, &t);
	if (!rc && (t.shape[3] != t.shape[4] || t.shape[3] != m->luminance.width || t.shape[4] != m->luminance.height))
		rc = tensor_input_error(in, EINVAL, name, "has other sizes than luminance, or is no square");
	if (!rc)
		rc = tensor_check_finite(in, &t, name);
	if (rc)
		return rc;
	m->nodes_per_side = (uint32_t)t.shape[3];
	return spectral ? read_spectra(in, m, &t) : read_rgb(in, m, &t);
}

/* ---- the whole ---- */

/* Follows Mitsuba's rules: a material with up to two azimuths is isotropic. */
static int detect_symmetry(const struct tensor_input *in, struct measured_material *m)
{
	uint32_t count = m->axes.count[0];
	m->is_isotropic = count <= 2;
	m->symmetry = 1;
	if (m->is_isotropic)
		return 0;
	double sectors = rint(2 * WARP_PI / (m->axes.value[0][count - 1] - m->axes.value[0][0]));
	if (sectors != 1 && sectors != 2 && sectors != 4)
		return tensor_input_error(
			in, ENOTSUP, "phi_i",
			"spans neither the circle nor a half or a quarter of it, which is not supported");
	m->symmetry = (int)sectors;
	return 0;
}

static int read_material(const struct tensor_input *in, struct measured_material *m)
{
	struct tensor jacobian = {.count = 0};
	int rc = tensor_read_axis(in, "phi_i", TENSOR_FLOATS, 1, &m->axes.count[0], &m->axes.value[0]);
	if (!rc)
		rc = tensor_read_axis(in, "theta_i", TENSOR_FLOATS, 1, &m->axes.count[1], &m->axes.value[1]);
	if (!rc)
		rc = detect_symmetry(in, m);
	if (!rc)
		rc = read_plane(in, "ndf", &m->normal_density);
	if (!rc)
		rc = read_plane(in, "sigma", &m->projected_area);
	if (!rc)
		rc = read_warp(in, m, "vndf", &m->visible_normals);
	if (!rc)
		rc = read_warp(in, m, "luminance", &m->luminance);
	if (!rc)
		rc = tensor_input_find(in, "jacobian", TENSOR_BYTES, 1, &jacobian);
	m->has_microfacets = !rc && jacobian.bytes[0] != 0;
	return rc ? rc : read_colors(in, m);
}

int measured_material_read(struct measured_material *m, const struct scene_node *n, const struct bsdf_build *build,
			   struct error *e)
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
double measured_material_alpha(const struct measured_material *m)
{
	const struct measured_plane *p = &m->normal_density;
	double largest = 0, sum = 0;
	for (uint32_t y = 0; y < p->height; y++)
		for (uint32_t x = 0; x < p->width; x++) {
			double u = (double)x / (p->width - 1), theta = 0.5 * WARP_PI * u * u,
			       d = p->value[(size_t)y * p->width + x];
			double trapezoid_weight =
				(x == 0 || x == p->width - 1 ? 0.5 : 1) * (y == 0 || y == p->height - 1 ? 0.5 : 1);
			sum += trapezoid_weight * d * cos(theta) * sin(theta) * u;
			largest = fmax(largest, d);
		}
	sum *= 2 * WARP_PI * WARP_PI / ((double)(p->width - 1) * (p->height - 1));
	return largest > 0 ? sqrt(sum / (WARP_PI * largest)) : INFINITY;
}
