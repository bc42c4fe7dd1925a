/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Measured materials that reflect on the side of the normal (Dupuy and Jakob 2018, An Adaptive Parameterization for
 * Efficient Material Acquisition and Rendering). Half vectors h are points of a square, x = sqrt(2 theta / pi), y = phi
 * / 2 pi + 1/2. A warp maps uniform numbers u to the half vectors visible from the camera. The file tabulates the
 * remaining factor S of the reflected light as a function of u (equations 5 to 7 of the paper):
 *
 *   f(wo, wi) wi.z = S(u) D(h) / (4 sigma(wo)),   wo towards the camera
 *
 * Sampling chains two warps: the first draws u in proportion to the mean of S over wavelengths, the second maps u to h.
 * Values are interpolated linearly between measurements. Measured light is not exactly reciprocal: paths from a light
 * use f with the directions exchanged, and sample as if they came from the camera.
 *
 * Failures: see measured_read.h.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/measured_read.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/warp.h"
#include "worker/render/math/search.h"

/* Directions with a smaller cosine carry no light, so that f stays within the range of doubles. */
#define COSINE_MIN 0x1p-500
/* The square root of a double's precision: unit vectors do not distinguish smaller angles to the normal. */
#define SQUARE_X_MIN 0x1p-26

/* Signs by which x and y are multiplied to turn w into the range of azimuths that the file covers, by Mitsuba's
 * rules. */
struct symmetry_signs {
	double x, y;
};

static struct symmetry_signs symmetry_signs_for(const struct measured_material *m, vec3 w)
{
	struct symmetry_signs t = {1, 1};
	if (m->symmetry > 1) {
		t.y = w.y < 0 ? 1 : -1;
		t.x = m->symmetry == 4 ? (w.x < 0 ? 1 : -1) : t.y;
	}
	return t;
}

static vec3 apply_signs(struct symmetry_signs t, vec3 w)
{
	return (vec3){t.x * w.x, t.y * w.y, w.z};
}

struct angles {
	double theta, phi;
};

static struct angles angles_from_direction(vec3 w)
{
	return (struct angles){atan2(hypot(w.x, w.y), w.z), atan2(w.y, w.x)};
}

static void square_from_angles(struct angles a, double square[2])
{
	double y = (a.phi + WARP_PI) / (2 * WARP_PI);
	square[0] = min_of(sqrt(a.theta * (2 / WARP_PI)), 1);
	square[1] = y - floor(y);
}

/* The values from the tables that depend only on the direction to the camera. */
struct view {
	const struct measured_material *m;
	struct symmetry_signs signs;
	struct angles angles;
	struct warp_mix mix;
};

static struct view view_from(const struct measured_material *m, vec3 camera)
{
	struct view v = {.m = m, .signs = symmetry_signs_for(m, camera)};
	v.angles = angles_from_direction(apply_signs(v.signs, camera));
	v.mix = warp_mix_at(&m->axes, (const double[2]){v.angles.phi, v.angles.theta});
	return v;
}

/* Finds the point of h in the square; returns the solid angle of directions to the light per area of the square. */
static double square_from_half_vector(const struct view *v, vec3 h, double cosine, double square[2])
{
	struct angles a = angles_from_direction(apply_signs(v->signs, h));
	if (v->m->is_isotropic)
		a.phi -= v->angles.phi;
	square_from_angles(a, square);
	double x = max_of(square[0], SQUARE_X_MIN);
	return 2 * WARP_PI * WARP_PI * x * sin(0.5 * WARP_PI * x * x) * 4 * cosine;
}

static double eval_plane(const struct measured_plane *p, const double square[2])
{
	struct warp_cell x = warp_cell_at(p->width, square[0]), y = warp_cell_at(p->height, square[1]);
	const double *near = p->value + (size_t)y.i * p->width + x.i, *far = near + p->width;
	double a = near[0] + x.fraction * (near[1] - near[0]), b = far[0] + x.fraction * (far[1] - far[0]);
	return a + y.fraction * (b - a);
}

/* The nodes around u in all slices of the mix, and the weight of each. */
struct nodes {
	int count;
	size_t index[16];
	double weight[16];
};

static struct nodes find_nodes(const struct view *v, const double u[2])
{
	struct nodes n = {.count = 0};
	const struct measured_material *m = v->m;
	struct warp_cell x = warp_cell_at(m->nodes_per_side, u[0]), y = warp_cell_at(m->nodes_per_side, u[1]);
	for (int k = 0; k < v->mix.count; k++)
		for (unsigned corner = 0; corner < 4; corner++) {
			unsigned right = corner % 2, up = corner / 2;
			n.index[n.count] =
				((size_t)v->mix.slice[k] * m->nodes_per_side + y.i + up) * m->nodes_per_side + x.i +
				right;
			n.weight[n.count++] = v->mix.weight[k] * (right ? x.fraction : 1 - x.fraction) *
					      (up ? y.fraction : 1 - y.fraction);
		}
	return n;
}

static double nodes_sum(const struct nodes *n, const float *table, size_t stride, size_t channel)
{
	double sum = 0;
	for (int i = 0; i < n->count; i++)
		sum += n->weight[i] * (double)table[n->index[i] * stride + channel];
	return sum;
}

static double eval_at_wavelength(const struct measured_material *m, const struct nodes *n, double nm)
{
	if (m->wavelength_count < 2 || !(nm > m->nm[0]))
		return nodes_sum(n, m->spectra, m->wavelength_count, 0);
	if (!(nm < m->nm[m->wavelength_count - 1]))
		return nodes_sum(n, m->spectra, m->wavelength_count, m->wavelength_count - 1);
	uint32_t i = search_find_cell(m->nm, m->wavelength_count - 1, nm);
	double fraction = (nm - m->nm[i]) / (m->nm[i + 1] - m->nm[i]);
	return (1 - fraction) * nodes_sum(n, m->spectra, m->wavelength_count, i) +
	       fraction * nodes_sum(n, m->spectra, m->wavelength_count, i + 1);
}

/* Returns S(u). Colours of the file may be outside the gamut, but light is never negative. */
static spectrum eval_color(const struct view *v, const double u[2], const struct wavelengths *w)
{
	const struct measured_material *m = v->m;
	struct nodes n = find_nodes(v, u);
	spectrum s;
	if (m->nm && !w->is_rgb) {
		for (int i = 0; i < SPECTRUM_LANES; i++)
			s.v[i] = max_of(eval_at_wavelength(m, &n, w->nm[i]), 0);
		return s;
	}
	double rgb[3], scale = 1;
	for (size_t c = 0; c < 3; c++) {
		rgb[c] = max_of(nodes_sum(&n, m->rgb, 3, c), 0);
		scale = max_of(scale, rgb[c]);
	}
	if (w->is_rgb)
		return spectrum_from_rgb(rgb);
	for (int c = 0; c < 3; c++)
		rgb[c] /= scale;
	return spectrum_scale(scale, color_eval_rgb_reflectance(rgb, w));
}

/* Returns f light.z for light that travels from `light` to `camera`. */
static spectrum eval_reflected(const struct measured_material *m, const struct wavelengths *w, vec3 camera, vec3 light)
{
	vec3 h;
	double length, square[2], u[2], factor = 1;
	if (!microfacet_half_vector(camera, 1, light, &h, &length))
		return spectrum_constant(0);
	struct view v = view_from(m, camera);
	square_from_half_vector(&v, h, 0.5 * length, square);
	if (m->has_microfacets) {
		double view_square[2];
		square_from_angles(v.angles, view_square);
		double area = eval_plane(&m->projected_area, view_square);
		factor = area > 0 ? eval_plane(&m->normal_density, square) / (4 * area) : 0;
		if (factor == 0)
			return spectrum_constant(0);
	}
	warp_table_invert(&m->visible_normals, &v.mix, square, u);
	return spectrum_scale(factor, eval_color(&v, u, w));
}

static bool both_above(vec3 wo, vec3 wi)
{
	return wo.z >= COSINE_MIN && wi.z >= COSINE_MIN;
}

static spectrum measured_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!both_above(wo, wi))
		return spectrum_constant(0);
	if (p->transport == TRANSPORT_IMPORTANCE)
		return spectrum_scale(1 / wo.z, eval_reflected(b->data, p->wavelengths, wi, wo));
	return spectrum_scale(1 / wi.z, eval_reflected(b->data, p->wavelengths, wo, wi));
}

static double measured_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct measured_material *m = b->data;
	vec3 h;
	double length, square[2], u[2];
	(void)p;
	if (!both_above(wo, wi) || !microfacet_half_vector(wo, 1, wi, &h, &length))
		return 0;
	struct view v = view_from(m, wo);
	double solid = square_from_half_vector(&v, h, 0.5 * length, square);
	double visible_pdf = warp_table_invert(&m->visible_normals, &v.mix, square, u);
	return visible_pdf * warp_table_density(&m->luminance, &v.mix, u) / solid;
}

static bool measured_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			    struct bsdf_sample *out)
{
	const struct measured_material *m = b->data;
	double inner[2], square[2];
	if (!(wo.z >= COSINE_MIN))
		return false;
	struct view v = view_from(m, wo);
	warp_table_sample(&m->luminance, &v.mix, u, inner);
	warp_table_sample(&m->visible_normals, &v.mix, inner, square);
	double theta = 0.5 * WARP_PI * square[0] * square[0],
	       phi = (2 * square[1] - 1) * WARP_PI + (m->is_isotropic ? v.angles.phi : 0);
	vec3 h = apply_signs(v.signs, (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)});
	if (!(vec3_dot(wo, h) > 0))
		return false;
	return bsdf_sample_smooth(b, p, wo, microfacet_mirror(wo, h), out);
}

static int measured_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct measured_material *m = b->data;
	int code = measured_material_read(m, n, build, e);
	if (code)
		return code;
	double alpha = measured_material_alpha(m);
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	b->is_nonreciprocal = true;
	b->uses_tangents = m->axes.count[0] > 1;
	b->min_alpha = alpha < 1 ? alpha : INFINITY;
	b->mean_alpha = min_of(alpha, 1);
	bsdf_add_color_kind(b, COLOR_KIND_OTHER);
	return 0;
}

const struct bsdf_ops bsdf_ops_measured = {
	.decl = PLUGIN(BSDF, "measured", {.name = "filename", .types = VALUE_STRING}),
	.data_size = sizeof(struct measured_material),
	.create = measured_create,
	.eval = measured_eval,
	.pdf_solid = measured_pdf,
	.sample = measured_sample,
};
