/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Materials of the KAIST database of measured Mueller matrices (Baek et al. 2020, Image-Based Acquisition and Modeling
 * of Polarimetric Reflectance), for unpolarised light: only the first element is used, the reflectance of unpolarised
 * light.
 *
 * The table is indexed by the angles of Rusinkiewicz 1998: theta_h between the half vector h and the normal; theta_d
 * between the direction to the light and h; and phi_d, the azimuth of that direction about h, counted from the tangent
 * that points down along the meridian. Values are interpolated linearly in all three angles and in the wavelength,
 * clamped to the first and last measurement, and negative ones count as 0. A value that is not finite or beyond 1e30
 * marks a configuration that could not be measured; wherever the interpolation involves one, no light is reflected, as
 * in Mitsuba. One sample in ten is drawn in proportion to the cosine, the others from the visible normals of a GGX
 * distribution with roughness `alpha_sample`.
 *
 * Measured light is not reciprocal: paths from a light use f with the directions exchanged.
 *
 * Creation fails if an array is missing, has the wrong type or a size that disagrees with that of others, or if an axis
 * is not ascending. Arrays lie within the file, which bounds allocations: the table takes a sixteenth of the array of
 * matrices.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/tensor_input.h"
#include "worker/render/bsdf/warp.h"
#include "worker/render/math/search.h"
#include "worker/render/scene/asset_part.h"
#include "common/base/liveness.h"

#include <float.h>

#define COSINE_MIN 0x1p-500 /* as for `measured` */
#define ALL_WAVELENGTHS (-1)
#define COSINE_SHARE 0.1 /* share of samples drawn in proportion to the cosine */

enum { AXIS_COUNT = 4, MUELLER_ELEMENTS = 16, TICK_INTERVAL = 1 << 16 };

/* Marks a missing measurement: so far below 0 that interpolating it with any values around it gives a negative value,
 * which counts as 0. */
static const float missing_value = -FLT_MAX;

struct axis {
	uint32_t count;
	const double *value;
};

struct polarized {
	struct axis axis[AXIS_COUNT]; /* phi_d, theta_d, theta_h, and wavelengths in nm, which vary fastest */
	const float *value;	      /* f */
	const double (*rgb)[3];	      /* weight of each wavelength in linear Rec. 709 under D65 */
	double nm;		      /* the only wavelength, or ALL_WAVELENGTHS */
	struct microfacet facets;     /* only for sampling */
};

/* ---- the table ---- */

/* A position between the values i and next of an axis; fraction: share of the way from the one to the other. */
struct cell {
	uint32_t i, next;
	double fraction;
};

static struct cell find_cell(const struct axis *a, double x)
{
	uint32_t last = a->count - 1;
	if (!(x > a->value[0]))
		return (struct cell){0, 0, 0};
	if (!(x < a->value[last]))
		return (struct cell){last, last, 0};
	uint32_t i = search_find_cell(a->value, last, x);
	return (struct cell){i, i + 1, (x - a->value[i]) / (a->value[i + 1] - a->value[i])};
}

/* The values around a pair of directions, each at its first wavelength, and the weight of each. */
struct nodes {
	int count;
	const float *value[8];
	double weight[8];
};

static struct nodes find_nodes(const struct polarized *m, vec3 light, vec3 h)
{
	/* Tangents at h: b across the meridian, t down along it. */
	double across = hypot(h.x, h.y);
	vec3 b = across > 0 ? (vec3){-h.y / across, h.x / across, 0} : (vec3){0, 1, 0}, t = vec3_cross(b, h);
	double x = vec3_dot(t, light), y = vec3_dot(b, light);
	const double angle[3] = {atan2(y, x), atan2(hypot(x, y), vec3_dot(h, light)), atan2(across, h.z)};
	struct cell c[3];
	struct nodes n = {.count = 0};
	for (int i = 0; i < 3; i++)
		c[i] = find_cell(&m->axis[i], angle[i]);
	for (unsigned k = 0; k < 8; k++) {
		size_t node = 0;
		double weight = 1;
		for (unsigned i = 0; i < 3; i++) {
			bool next = k >> i & 1;
			node = node * m->axis[i].count + (next ? c[i].next : c[i].i);
			weight *= next ? c[i].fraction : 1 - c[i].fraction;
		}
		if (weight > 0) {
			n.value[n.count] = m->value + node * m->axis[3].count;
			n.weight[n.count++] = weight;
		}
	}
	return n;
}

static double eval_at_wavelength(const struct polarized *m, const struct nodes *n, double nm)
{
	struct cell c = find_cell(&m->axis[3], nm);
	double sum = 0;
	for (int i = 0; i < n->count; i++)
		sum += n->weight[i] *
		       ((1 - c.fraction) * (double)n->value[i][c.i] + c.fraction * (double)n->value[i][c.next]);
	return max_of(sum, 0);
}

/* Returns f for light that travels from `light` to `camera`. */
static spectrum eval_reflected(const struct polarized *m, const struct wavelengths *w, vec3 camera, vec3 light)
{
	vec3 h;
	double length, rgb[3] = {0, 0, 0};
	if (!microfacet_half_vector(camera, 1, light, &h, &length))
		return spectrum_constant(0);
	struct nodes n = find_nodes(m, light, h);
	if (m->nm != ALL_WAVELENGTHS)
		return spectrum_constant(eval_at_wavelength(m, &n, m->nm));
	if (!w->is_rgb) {
		spectrum f;
		for (int i = 0; i < SPECTRUM_LANES; i++)
			f.v[i] = eval_at_wavelength(m, &n, w->nm[i]);
		return f;
	}
	for (uint32_t k = 0; k < m->axis[3].count; k++) {
		double f = eval_at_wavelength(m, &n, m->axis[3].value[k]);
		for (int i = 0; i < 3; i++)
			rgb[i] += m->rgb[k][i] * f;
	}
	for (int i = 0; i < 3; i++)
		rgb[i] = max_of(rgb[i], 0);
	return spectrum_from_rgb(rgb);
}

/* ---- the material ---- */

static bool both_above(vec3 wo, vec3 wi)
{
	return wo.z >= COSINE_MIN && wi.z >= COSINE_MIN;
}

static spectrum polarized_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!both_above(wo, wi))
		return spectrum_constant(0);
	return p->transport == TRANSPORT_IMPORTANCE ? eval_reflected(b->data, p->wavelengths, wi, wo)
						    : eval_reflected(b->data, p->wavelengths, wo, wi);
}

static double polarized_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct polarized *m = b->data;
	vec3 h;
	double length;
	(void)p;
	if (!both_above(wo, wi) || !microfacet_half_vector(wo, 1, wi, &h, &length))
		return 0;
	double facet_pdf = 0.25 * microfacet_d(&m->facets, h) * microfacet_g1_over_cos(&m->facets, wo);
	return COSINE_SHARE * wi.z / WARP_PI + (1 - COSINE_SHARE) * facet_pdf;
}

static bool polarized_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			     struct bsdf_sample *out)
{
	const struct polarized *m = b->data;
	if (!(wo.z >= COSINE_MIN))
		return false;
	vec3 wi = u[2] < COSINE_SHARE ? warp_cosine_hemisphere(u[0], u[1])
				      : microfacet_sample_mirrored(&m->facets, wo, u[0], u[1]);
	return bsdf_sample_smooth(b, p, wo, wi, out);
}

/* ---- reading ---- */

static int read_table(const struct tensor_input *in, struct polarized *m)
{
	struct tensor t;
	int rc = tensor_input_find(in, "M", TENSOR_FLOATS, AXIS_COUNT + 2, &t);
	if (rc)
		return rc;
	for (int i = 0; i < AXIS_COUNT; i++)
		if (t.shape[i] != m->axis[i].count)
			return tensor_input_error(in, EINVAL, "M",
						  "has other sizes than phi_d, theta_d, theta_h and wvls");
	if (t.shape[AXIS_COUNT] != 4 || t.shape[AXIS_COUNT + 1] != 4)
		return tensor_input_error(in, EINVAL, "M", "needs matrices of 4 x 4");
	float *value = arena_alloc(in->arena, t.count / MUELLER_ELEMENTS, sizeof *value);
	if (!value)
		return tensor_input_error(in, ENOMEM, "M", "does not fit into memory");
	for (uint64_t i = 0; i < t.count / MUELLER_ELEMENTS; i++) {
		value[i] = tensor_is_usable(&t, MUELLER_ELEMENTS * i) ? (float)tensor_value(&t, MUELLER_ELEMENTS * i)
								      : missing_value;
		if (i % TICK_INTERVAL == 0)
			liveness_tick();
	}
	m->value = value;
	return 0;
}

static int read_material(const struct tensor_input *in, struct polarized *m)
{
	static const char *const names[AXIS_COUNT] = {"phi_d", "theta_d", "theta_h", "wvls"};
	double(*rgb)[3] = NULL;
	int rc = 0;
	for (int i = 0; i < AXIS_COUNT && !rc; i++)
		rc = tensor_read_axis(in, names[i], i < 3 ? TENSOR_FLOATS : TENSOR_SHORTS, i < 3 ? 2 : 1,
				      &m->axis[i].count, &m->axis[i].value);
	if (!rc)
		rc = tensor_rgb_weights(in, m->axis[3].value, m->axis[3].count, &rgb);
	m->rgb = (const double(*)[3])rgb;
	return rc ? rc : read_table(in, m);
}

static int polarized_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct polarized *m = b->data;
	struct asset_range a;
	m->nm = node_float(n, "wavelength", ALL_WAVELENGTHS);
	double alpha = node_float(n, "alpha_sample", 0.1);
	microfacet_init(&m->facets, true, alpha, alpha);
	int rc = asset_part_open(&a, n, build->assets, e);
	if (rc)
		return rc;
	const struct tensor_input in = {a.bytes, a.size, n, build->arena, e};
	rc = read_material(&in, m);
	asset_range_close(&a, build->assets);
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	b->is_nonreciprocal = true;
	b->min_alpha = b->mean_alpha = alpha;
	bsdf_add_color_kind(b, m->nm == ALL_WAVELENGTHS ? COLOR_KIND_OTHER : COLOR_KIND_CONSTANT);
	return rc;
}

const struct bsdf_ops bsdf_ops_measured_polarized = {
	.decl = PLUGIN(BSDF, "measured_polarized", {.name = "filename", .types = VALUE_STRING},
		       {"alpha_sample", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, MICROFACET_ALPHA_MIN, 1, NULL},
		       {"wavelength", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, ALL_WAVELENGTHS, 1e6, NULL}),
	.data_size = sizeof(struct polarized),
	.create = polarized_create,
	.eval = polarized_eval,
	.pdf_solid = polarized_pdf,
	.sample = polarized_sample,
};
