/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An equirectangular environment map. Local +y is up (the top row), the middle column is in direction +z, and the
 * column a quarter from the left in direction +x: u = atan2(x, -z) / 2 pi, v = acos(y) / pi, in both dialects. Pixel
 * centres are at half-integers, except that in 3.x the centres of the first and last rows are the poles, and the other
 * rows are at equal angles between them.
 *
 * Sampling: the radiance is bilinear between pixel centres, so the cells of the density also lie between pixel centres
 * (and between the outer rows and the poles, unless these coincide). Within a cell the density is constant per solid
 * angle and proportional to the mean luminance of its four corners, so it is positive wherever there is light. The
 * probabilities of the cells of a row are multiples of 2^-31, at least one unit if there is light, and are stored as
 * running sums, which both sampling and density use.
 *
 * to_world may stretch the map: a direction d of the world sees the image in the local direction A d, where A is the
 * inverse of to_world's matrix, scaled to determinant 1. The map from d to A d / |A d| multiplies solid angles by |A
 * d|^-3, and with them densities.
 *
 * Creation fails if to_world is flat, or if the file is not an image. For a map without light, the power is 0 and
 * sampling fails.
 */
#include "worker/render/emitter/envmap.h"

#include "common/base/color.h"
#include "common/base/mem.h"
#include "worker/render/math/search.h"

#include <errno.h>
#include <string.h>

/* The smallest volume that to_world's columns may span, if scaled so that the longest has length 1; with a smaller one,
 * few pixels would fill the sphere. */
#define ENVMAP_VOLUME_MIN 1e-6

static vec3 to_local(const struct envmap *m, vec3 d)
{
	return (vec3){vec3_dot(m->axes.inverse_row[0], d), vec3_dot(m->axes.inverse_row[1], d),
		      vec3_dot(m->axes.inverse_row[2], d)};
}

static vec3 to_world(const struct envmap *m, vec3 d)
{
	return vec3_madd(vec3_madd(vec3_scale(d.x, m->axes.axis[0]), d.y, m->axes.axis[1]), d.z, m->axes.axis[2]);
}

/* Returns the local solid angle per solid angle in the world, at the world's direction d of any length. */
static double jac_local_from_world(const struct envmap *m, vec3 d)
{
	double length = m->axes.is_stretched ? vec3_length(to_local(m, d)) / vec3_length(d) : 1;
	return 1 / (length * length * length);
}

static void uv_from_direction(const struct envmap *m, vec3 direction, double *u, double *v)
{
	vec3 d = to_local(m, direction);
	double longitude = atan2(d.x, -d.z) / (2 * M_PI);
	*u = longitude < 0 ? longitude + 1 : longitude;
	*v = atan2(hypot(d.x, d.z), d.y) / M_PI;
}

spectrum envmap_radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	(void)w;
	const struct envmap *m = em->data;
	double u, v, rgb[3];
	uv_from_direction(m, x->p, &u, &v);
	if (m->has_rows_at_poles)
		v = (v * m->rows + 0.5) / (m->rows + 1);
	raster_eval(&m->raster, u, v, rgb);
	return spectrum_scale(m->scale, color_eval_rgb_illuminant(rgb, wl));
}

/* Angle of the upper edge of the row from the pole. */
static double row_edge_angle(const struct envmap *m, uint32_t row)
{
	if (m->has_rows_at_poles)
		return M_PI * row / m->rows;
	return row == 0 ? 0 : row == m->rows ? M_PI : M_PI * (row - 0.5) / (m->rows - 1);
}

static double row_cosine_height(const struct envmap *m, uint32_t row) /* in the cosine, without cancellation */
{
	double upper = row_edge_angle(m, row), lower = row_edge_angle(m, row + 1);
	return 2 * sin(0.5 * (upper + lower)) * sin(0.5 * (lower - upper));
}

static const uint32_t *row_cells(const struct envmap *m, uint32_t row)
{
	return m->cell_cdf + (size_t)row * (m->columns + 1);
}

/* Finds the cell of the density that contains direction d; across: fraction of the way across the cell. */
static void find_cell(const struct envmap *m, vec3 d, uint32_t *row, uint32_t *column, double *across)
{
	double u, v;
	uv_from_direction(m, d, &u, &v);
	/* Cell 0 of a row begins at the centre of pixel 0; the half pixel before belongs to the last cell. */
	double c = u * m->columns - 0.5, r = m->has_rows_at_poles ? v * m->rows : v * (m->rows - 1) + 0.5;
	*column = c < 0 || c >= m->columns ? m->columns - 1 : (uint32_t)c;
	*row = r >= m->rows ? m->rows - 1 : (uint32_t)r;
	*across = (c < 0 ? c + m->columns : c) - *column;
}

double envmap_pdf_point(const struct emitter *em, const struct emitter_point *x)
{
	const struct envmap *m = em->data;
	uint32_t row, column;
	double across;
	find_cell(m, x->p, &row, &column, &across);
	const uint32_t *cells = row_cells(m, row);
	if (cells[m->columns] == 0)
		return 0;
	double probability =
		(m->row_cdf[row + 1] - m->row_cdf[row]) * (cells[column + 1] - cells[column]) / cells[m->columns];
	return probability / (row_cosine_height(m, row) * 2 * M_PI / m->columns) * jac_local_from_world(m, x->p);
}

void envmap_point_inverse(const struct emitter *em, const struct emitter_point *x, double u[2])
{
	const struct envmap *m = em->data;
	uint32_t row, column;
	double across;
	find_cell(m, x->p, &row, &column, &across);
	const uint32_t *cells = row_cells(m, row);
	vec3 d = to_local(m, x->p);
	/* Share of the cell above d, as a difference of cosines computed from angles. */
	double angle = atan2(hypot(d.x, d.z), d.y), edge = row_edge_angle(m, row);
	double down = 2 * sin(0.5 * (angle + edge)) * sin(0.5 * (angle - edge)) / row_cosine_height(m, row);
	u[0] = cells[m->columns] ? (cells[column] + across * (cells[column + 1] - cells[column])) / cells[m->columns]
				 : 0;
	u[1] = m->row_cdf[row] + down * (m->row_cdf[row + 1] - m->row_cdf[row]);
	for (int i = 0; i < 2; i++)
		u[i] = fmin(fmax(u[i], 0), 1 - 0x1p-53);
}

bool envmap_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf_point)
{
	const struct envmap *m = em->data;
	if (!(em->power > 0))
		return false;
	uint32_t row = search_find_cell(m->row_cdf, m->rows, u[1]);
	const uint32_t *cells = row_cells(m, row);
	double target = u[0] * cells[m->columns];
	uint32_t column = search_count(cells, m->columns, target);
	double width = cells[column + 1] - cells[column], height = m->row_cdf[row + 1] - m->row_cdf[row];
	if (!(width > 0 && height > 0))
		return false;
	double across = (target - cells[column]) / width, down = (u[1] - m->row_cdf[row]) / height;
	double phi = 2 * M_PI * ((column + 0.5 + across) / m->columns);
	/* 1 - the cosine of the angle from the pole */
	double from_pole = 2 * pow(sin(0.5 * row_edge_angle(m, row)), 2) + down * row_cosine_height(m, row);
	double sine = sqrt(fmax(0, from_pole * (2 - from_pole)));
	vec3 d = to_world(m, (vec3){sine * sin(phi), 1 - from_pole, -sine * cos(phi)});
	*x = (struct emitter_point){.p = vec3_normalize(d), .is_infinite = true};
	*pdf_point = envmap_pdf_point(em, x);
	return *pdf_point > 0;
}

/* Returns the solid angle in the world per local solid angle, in the middle of the cell. */
static double cell_stretch(const struct envmap *m, uint32_t row, uint32_t column)
{
	double theta = 0.5 * (row_edge_angle(m, row) + row_edge_angle(m, row + 1)),
	       phi = 2 * M_PI * (column + 1.0) / m->columns;
	return 1 /
	       jac_local_from_world(m, to_world(m, (vec3){sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi)}));
}

/* The luminances of one row of the image's pixels. */
struct luminance_row {
	uint32_t row; /* UINT32_MAX: none is loaded yet */
	double *luminance;
};

static void load_row(const struct envmap *m, uint32_t row, struct luminance_row *out)
{
	if (out->row == row)
		return;
	for (uint32_t c = 0; c < m->columns; c++) {
		double rgb[3];
		raster_pixel(&m->raster, c, row, rgb);
		out->luminance[c] = rec709_luminance(rgb);
	}
	out->row = row;
}

/* Computes the weight of each cell of a row: the mean luminance of its corners, times the solid angle in the world per
 * local solid angle. pixels: the rows of pixels above and below the row of cells; each is loaded only once if `row`
 * counts up. */
static void weigh_cells(const struct envmap *m, uint32_t row, struct luminance_row pixels[2], double *weight)
{
	uint32_t below = row + m->has_rows_at_poles, above = below == 0 ? 0 : below - 1;
	below = below < m->raster.image.height ? below : m->raster.image.height - 1;
	if (pixels[1].row == above) {
		struct luminance_row last = pixels[0];
		pixels[0] = pixels[1];
		pixels[1] = last;
	}
	load_row(m, above, &pixels[0]);
	load_row(m, below, &pixels[1]);
	const double *a = pixels[0].luminance, *b = pixels[1].luminance;
	for (uint32_t c = 0; c < m->columns; c++) {
		uint32_t next = c + 1 == m->columns ? 0 : c + 1;
		weight[c] = 0.25 * (a[c] + a[next] + b[c] + b[next]);
		if (m->axes.is_stretched)
			weight[c] *= cell_stretch(m, row, c);
	}
}

/* Fills the tables of the density. *integral: that of the luminance over the sphere. -ENOMEM. */
static int build_density(struct envmap *m, double *integral)
{
	size_t columns = m->columns;
	double *weight = mem_alloc(3 * columns, sizeof *weight), total = 0;
	if (!weight)
		return -ENOMEM;
	struct luminance_row pixels[2] = {{UINT32_MAX, weight + columns}, {UINT32_MAX, weight + 2 * columns}};
	for (uint32_t row = 0; row < m->rows; row++) {
		uint32_t *cells = m->cell_cdf + (size_t)row * (m->columns + 1);
		double sum = 0, unit = 0x1p31;
		weigh_cells(m, row, pixels, weight);
		for (uint32_t c = 0; c < m->columns; c++)
			sum += weight[c];
		for (uint32_t c = 0; c < m->columns; c++)
			cells[c + 1] =
				cells[c] + (weight[c] > 0 ? (uint32_t)fmax(1, floor(weight[c] / sum * unit)) : 0);
		m->row_cdf[row] = total;
		total += sum * row_cosine_height(m, row) * 2 * M_PI / m->columns;
	}
	mem_free(weight);
	m->row_cdf[m->rows] = total;
	for (uint32_t row = 0; row <= m->rows && total > 0; row++)
		m->row_cdf[row] /= total;
	*integral = total;
	return 0;
}

/* Computes the axes of to_world, scaled so that their determinant is 1, and the rows of the inverse of that matrix. */
static int axes_from_stretch(const struct scene_node *n, const mat4 *to_world, struct envmap_axes *a, struct error *e)
{
	double longest = 0;
	for (int c = 0; c < 3; c++) {
		a->axis[c] = (vec3){to_world->m[0][c], to_world->m[1][c], to_world->m[2][c]};
		longest = fmax(longest, vec3_length(a->axis[c]));
	}
	for (int c = 0; c < 3; c++)
		a->axis[c] = vec3_scale(1 / longest, a->axis[c]);
	double volume = vec3_dot(a->axis[0], vec3_cross(a->axis[1], a->axis[2]));
	if (!(fabs(volume) >= ENVMAP_VOLUME_MIN))
		return node_error(n, e, EINVAL, "to_world of an environment is flat, or nearly so");
	double unit = cbrt(fabs(volume)), sign = volume < 0 ? -1 : 1;
	for (int c = 0; c < 3; c++)
		a->axis[c] = vec3_scale(1 / unit, a->axis[c]);
	for (int c = 0; c < 3; c++)
		a->inverse_row[c] = vec3_scale(sign, vec3_cross(a->axis[(c + 1) % 3], a->axis[(c + 2) % 3]));
	a->is_stretched = true;
	return 0;
}

/* Computes the axes for a to_world that preserves angles. */
static void axes_from_rotation(const mat4 *to_world, struct envmap_axes *a)
{
	for (int c = 0; c < 3; c++)
		a->axis[c] = vec3_normalize((vec3){to_world->m[0][c], to_world->m[1][c], to_world->m[2][c]});
	/* Orthonormalise, since files give few digits. */
	double sign = vec3_dot(vec3_cross(a->axis[0], a->axis[1]), a->axis[2]) < 0 ? -1 : 1;
	a->axis[1] = vec3_normalize(vec3_madd(a->axis[1], -vec3_dot(a->axis[0], a->axis[1]), a->axis[0]));
	a->axis[2] = vec3_scale(sign, vec3_cross(a->axis[0], a->axis[1]));
	memcpy(a->inverse_row, a->axis, sizeof a->inverse_row);
	a->is_stretched = false;
}

int envmap_read_axes(const struct scene_node *n, struct envmap_axes *a, struct error *e)
{
	mat4 t = node_transform(n, "to_world");
	if (!mat4_is_conformal(&t))
		return axes_from_stretch(n, &t, a, e);
	axes_from_rotation(&t, a);
	return 0;
}

int envmap_init(struct emitter *em, const struct raster *picture, bool has_rows_at_poles, double scale,
		const struct envmap_axes *axes, const struct scene_node *n, const struct emitter_build *build,
		struct error *e)
{
	struct envmap *m = em->data;
	m->raster = *picture;
	m->axes = *axes;
	m->raster.wrap_u = RASTER_REPEAT;
	m->raster.wrap_v = RASTER_CLAMP;
	m->scale = scale;
	m->columns = m->raster.image.width;
	m->has_rows_at_poles = has_rows_at_poles && m->raster.image.height > 1;
	m->rows = m->has_rows_at_poles ? m->raster.image.height - 1 : m->raster.image.height + 1;
	m->row_cdf = arena_alloc(build->arena, (size_t)m->rows + 1, sizeof *m->row_cdf);
	m->cell_cdf = arena_alloc(build->arena, (size_t)m->rows * ((size_t)m->columns + 1), sizeof *m->cell_cdf);
	double integral = 0;
	if (!m->row_cdf || !m->cell_cdf || build_density(m, &integral))
		return node_error(n, e, ENOMEM, "out of memory for the density of %u x %u cells", m->columns, m->rows);
	const struct color white = {.kind = COLOR_KIND_D65, .scale = m->scale, .is_times_d65 = true};
	em->is_infinite = true;
	em->is_textured = true;
	em->color_kind = raster_is_grey(&m->raster) ? COLOR_KIND_D65 : COLOR_KIND_OTHER;
	em->power = integral * color_mean(&white);
	em->brightness_bound = raster_max(&m->raster) * color_max(&white);
	return 0;
}

static int envmap_create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build,
			 struct error *e)
{
	struct raster picture = {.is_nearest = false};
	struct envmap_axes axes;
	int code = envmap_read_axes(n, &axes, e);
	if (!code)
		code = raster_read(&picture, n, build->assets, &(struct raster_options){0, HUGE_VAL, false, IMAGE_ALL},
				   build->arena, e);
	return code ? code
		    : envmap_init(em, &picture, build->is_dialect_3, node_float(n, "scale", 1), &axes, n, build, e);
}

static void set_transform(struct emitter *em, const mat4 *to_world)
{
	struct envmap *m = em->data;
	axes_from_rotation(to_world, &m->axes);
}

const struct emitter_ops emitter_ops_envmap = {
	.decl = PLUGIN(EMITTER, "envmap", RASTER_PARAMS,
		       {.name = "scale", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = PARAM_LIGHT_MAX},
		       {.name = "to_world", .types = VALUE_TRANSFORM_OR_ANIMATION},
		       {.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED},
		       {.name = "mis_compensation", .types = VALUE_BOOL, .status = PARAM_IGNORED}),
	.create = envmap_create,
	ENVMAP_OPS,
	.set_transform = set_transform,
};
