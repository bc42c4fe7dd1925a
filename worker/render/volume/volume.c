/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads volumes and evaluates them. In Mitsuba 3, the values of a grid are those of the centres of the cells of the
 * unit cube, which to_world transforms; with use_grid_bbox, the cube is first fitted to the file's box. In 0.6, the
 * outermost values lie on the faces of the file's box, or of the box from `min` to `max`, before to_world.
 *
 * Creation fails if the file cannot be read, if a value is negative, if a reflectance exceeds 1, or if the box has no
 * volume.
 */
#include "worker/render/volume/volume.h"

#include "worker/render/volume/grid_file.h"

#include <string.h>

#define BOX_CORNER VALUE_POINT, PARAM_UNDERSTOOD, -PARAM_LENGTH_MAX, PARAM_LENGTH_MAX, NULL

/* Upper bound of values that are not reflectances. */
#define VOLUME_VALUE_MAX 1e30

const struct plugin_decl volume_decls[] = {
	PLUGIN(VOLUME, "constvolume",
	       {"value", VALUE_COLOR | VALUE_STRING, PARAM_UNDERSTOOD, 0, VOLUME_VALUE_MAX, NULL},
	       {"to_world", UNDERSTOOD(VALUE_TRANSFORM)}),
	PLUGIN(VOLUME, "gridvolume", {"filename", UNDERSTOOD(VALUE_STRING)}, {"to_world", UNDERSTOOD(VALUE_TRANSFORM)},
	       {"use_grid_bbox", UNDERSTOOD(VALUE_BOOL | VALUE_DIALECT_3_ONLY)},
	       {"filter_type", VALUE_STRING | VALUE_DIALECT_3_ONLY, PARAM_UNDERSTOOD, 0, 0, "trilinear|nearest"},
	       {"wrap_mode", VALUE_STRING | VALUE_DIALECT_3_ONLY, PARAM_UNDERSTOOD, 0, 0, "clamp|repeat|mirror"},
	       {"min", BOX_CORNER},		      /* of 0.6 */
	       {"max", BOX_CORNER}, {"raw", IGNORED}, /* values are never decoded from sRGB */
	       {"max_value", IGNORED}, {"accel", IGNORED}, {"send_data", IGNORED}),
	{0, NULL, NULL, 0, 0},
};

/* ---- place ---- */

/* Finds the box to which to_world is applied. */
static void read_box(const struct scene_node *n, const struct grid_file *f, bool dialect_3, double box[2][3])
{
	const struct property *min = node_find_property(n, "min"), *max = node_find_property(n, "max");
	vec3 low = {0, 0, 0}, high = {1, 1, 1};
	if (min && max) {
		low = min->value.as.point;
		high = max->value.as.point;
	} else if (!dialect_3 || node_bool(n, "use_grid_bbox", false)) {
		low = (vec3){f->box[0][0], f->box[0][1], f->box[0][2]};
		high = (vec3){f->box[1][0], f->box[1][1], f->box[1][2]};
	}
	const double corner[2][3] = {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
	memcpy(box, corner, sizeof corner);
}

/* Finds the bounding box of the grid's cells that is parallel to the world's axes. Returns false if to_cells has no
 * inverse. */
static bool box_in_world(const struct grid *g, vec3 *min, vec3 *max)
{
	mat4 to_world;
	if (!mat4_invert(g->to_cells, &to_world))
		return false;
	*min = (vec3){INFINITY, INFINITY, INFINITY};
	*max = vec3_neg(*min);
	for (int k = 0; k < 8; k++) {
		vec3 p = mat4_point(&to_world, (vec3){k & 1 ? g->cell_max[0] : g->cell_min[0],
						      k & 2 ? g->cell_max[1] : g->cell_min[1],
						      k & 4 ? g->cell_max[2] : g->cell_min[2]});
		*min = (vec3){fmin(min->x, p.x), fmin(min->y, p.y), fmin(min->z, p.z)};
		*max = (vec3){fmax(max->x, p.x), fmax(max->y, p.y), fmax(max->z, p.z)};
	}
	return true;
}

static void set_world_box(struct grid *g, vec3 min, vec3 max)
{
	g->is_world_aligned = true;
	g->world_min = min;
	g->world_max = max;
	for (int k = 0; k < 8; k++) {
		vec3 p = mat4_point(&g->to_cells,
				    (vec3){k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z});
		const double x[3] = {p.x, p.y, p.z};
		for (int i = 0; i < 3; i++) {
			g->cell_min[i] = fmax(fmin(g->cell_min[i], x[i]), -GRID_CELL_MAX);
			g->cell_max[i] = fmin(fmax(g->cell_max[i], x[i]), GRID_CELL_MAX);
		}
	}
}

/* Returns whether some axis of the volume is not parallel to one of the world's, allowing for the rounding of sines and
 * cosines in a rotation. */
static bool is_rotated(const mat4 *m)
{
	for (int i = 0; i < 3; i++) {
		double x = fabs(m->m[i][0]), y = fabs(m->m[i][1]), z = fabs(m->m[i][2]), max = fmax(x, fmax(y, z));
		if ((x > 1e-12 * max) + (y > 1e-12 * max) + (z > 1e-12 * max) != 1)
			return true;
	}
	return false;
}

#define FLATTENED_MESSAGE "to_world flattens the volume (it has no inverse)"

static int place_grid(struct grid *g, const struct scene_node *n, double box[2][3], const struct volume_build *build,
		      struct error *e)
{
	double cells_per_unit[3], offset = build->is_dialect_3 && !g->is_nearest ? -0.5 : 0;
	mat4 to_world = node_transform(n, "to_world"), to_volume;
	for (int i = 0; i < 3; i++) {
		double cells = build->is_dialect_3 || g->is_nearest ? g->size[i] : g->size[i] - 1;
		bool is_bounded = isfinite(box[0][i]) && isfinite(box[1][i]);
		cells_per_unit[i] = is_bounded && box[1][i] > box[0][i] ? cells / (box[1][i] - box[0][i]) : 0;
		g->cell_min[i] = offset;
		g->cell_max[i] = cells + offset;
		if (!(isfinite(cells_per_unit[i]) && cells_per_unit[i] > 0))
			return node_error(n, e, EINVAL, "its box, or its grid, is flat along %c", "xyz"[i]);
	}
	if (!mat4_invert(to_world, &to_volume))
		return node_error(n, e, EINVAL, FLATTENED_MESSAGE);
	mat4 to_cells = mat4_mul(mat4_scale((vec3){cells_per_unit[0], cells_per_unit[1], cells_per_unit[2]}),
				 mat4_translate((vec3){-box[0][0], -box[0][1], -box[0][2]}));
	to_cells = mat4_mul(mat4_translate((vec3){offset, offset, offset}), mat4_mul(to_cells, to_volume));
	mat4 to_scene =
		mat4_mul(mat4_translate(build->world_center),
			 mat4_scale((vec3){1 / build->world_scale, 1 / build->world_scale, 1 / build->world_scale}));
	g->to_cells = mat4_mul(to_cells, to_scene);
	if (!build->is_dialect_3 || !is_rotated(&g->to_cells))
		return 0;
	/* Mitsuba 3 bounds a medium by the bounding box of its volume that is parallel to the world's axes. */
	vec3 min, max;
	if (!box_in_world(g, &min, &max))
		return node_error(n, e, EINVAL, FLATTENED_MESSAGE);
	set_world_box(g, min, max);
	return 0;
}

/* ---- reading ---- */

static int check_values(const struct scene_node *n, const struct grid_file *f, enum color_role role, struct error *e)
{
	double max = role == COLOR_REFLECTANCE ? 1 : VOLUME_VALUE_MAX;
	if (f->min_value >= 0 && f->max_value <= max)
		return 0;
	return node_error(n, e, ERANGE, "%s: its values go from %g to %g; [0, %g] is supported here",
			  node_string(n, "filename", ""), f->min_value, f->max_value, max);
}

static enum grid_wrap parse_wrap_mode(const struct scene_node *n, bool dialect_3)
{
	const char *mode = node_string(n, "wrap_mode", "clamp");
	if (!dialect_3)
		return GRID_ZERO;
	return strcmp(mode, "repeat") == 0 ? GRID_REPEAT : strcmp(mode, "mirror") == 0 ? GRID_MIRROR : GRID_CLAMP;
}

int volume_make_grid(struct grid *g, const struct scene_node *n, const struct grid_file *f,
		     const struct volume_build *build, struct error *e)
{
	double box[2][3];
	*g = (struct grid){.size = {(int)f->size[0], (int)f->size[1], (int)f->size[2]},
			   .channels = (int)f->channels,
			   .value = f->value,
			   .occupied_bricks = f->occupied_bricks,
			   .is_nearest = strcmp(node_string(n, "filter_type", "trilinear"), "nearest") == 0,
			   .wrap = parse_wrap_mode(n, build->is_dialect_3)};
	read_box(n, f, build->is_dialect_3, box);
	return place_grid(g, n, box, build, e);
}

static int read_grid(struct volume *v, const struct scene_node *n, enum color_role role,
		     const struct volume_build *build, struct error *e)
{
	struct grid_file f;
	int rc = grid_file_read_cached(build->cache, n, build->assets, build->arena, &f, e);
	if (!rc)
		rc = check_values(n, &f, role, e);
	if (rc)
		return rc;
	rc = color_from_rgb((const double[3]){1, 1, 1}, role, &v->color);
	v->min_value = f.min_value;
	v->max_value = f.max_value;
	for (int k = 0; k < GRID_CHANNELS_MAX && f.channels > 1 && !rc; k++) {
		const double rgb[3] = {k == 0, k == 1, k == 2};
		rc = color_from_rgb(rgb, COLOR_REFLECTANCE, &v->primary[k]);
	}
	struct grid *g = arena_alloc(build->arena, 1, sizeof *g);
	if (!rc && !g)
		rc = node_error(n, e, ENOMEM, "out of memory");
	if (!rc)
		rc = volume_make_grid(g, n, &f, build, e);
	v->grid = g;
	if (!rc && g->is_world_aligned && role != COLOR_REFLECTANCE && g->wrap != GRID_CLAMP)
		rc = node_error(n, e, ENOTSUP, "a rotated density cannot repeat itself (wrap_mode)");
	return rc;
}

static const float unit_value = 1;
static const unsigned char unit_occupied = 1;
static const struct grid unit_grid = {.size = {1, 1, 1},
				      .channels = 1,
				      .value = &unit_value,
				      .occupied_bricks = &unit_occupied,
				      .cell_max = {1, 1, 1},
				      .is_nearest = true,
				      .wrap = GRID_CLAMP};

/* Limits a constant colour to the unit cube; outside, the value is 0. */
static int add_cube(struct volume *v, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	double unit[2][3] = {{0, 0, 0}, {1, 1, 1}};
	struct grid *g = arena_alloc(build->arena, 1, sizeof *g);
	if (!g)
		return node_error(n, e, ENOMEM, "out of memory");
	*g = unit_grid;
	v->max_value = 1;
	v->grid = g;
	return place_grid(g, n, unit, build, e);
}

int volume_from_node(struct volume *v, const struct scene_node *n, const char *name, double fallback,
		     enum color_role role, bool in_cube, const struct volume_build *build, struct error *e)
{
	const struct property *p = node_find_property(n, name);
	bool nested = p && p->value.type == VALUE_NODE;
	*v = (struct volume){.color = color_constant(fallback)};
	if (nested) {
		n = p->value.as.node;
		if (strcmp(n->type, "gridvolume") == 0)
			return read_grid(v, n, role, build, e);
		p = node_find_property(n, "value");
		if (!p && !build->is_dialect_3)
			return node_error(n, e, EINVAL, "needs a value; --lenient leaves it out");
		v->color = color_constant(1);
	}
	struct error reason;
	int code = p ? color_from_value(&p->value, role, build->arena, &v->color, &reason) : 0;
	if (code)
		return node_error(n, e, -code, "%s: %s", nested ? "value" : name, reason.text);
	return in_cube ? add_cube(v, n, build, e) : 0;
}

/* Gives v a grid that consists of one cell of value 1, which is the given box. */
static int add_unit_cell(struct volume *v, vec3 min, vec3 max, const struct volume_build *build)
{
	struct grid *g = arena_alloc(build->arena, 1, sizeof *g);
	vec3 size = vec3_sub(max, min);
	if (!g)
		return -ENOMEM;
	*g = unit_grid;
	g->to_cells = mat4_mul(mat4_scale((vec3){1 / size.x, 1 / size.y, 1 / size.z}), mat4_translate(vec3_neg(min)));
	v->max_value = 1;
	v->grid = g;
	set_world_box(g, min, max);
	return 0;
}

int volume_adopt_bounds(struct volume *v, const struct volume *other, const struct scene_node *n,
			const struct volume_build *build, struct error *e)
{
	/* Without a grid, the box of the whole scene, whose radius is 1. */
	vec3 min = {-2, -2, -2}, max = {2, 2, 2};
	if (other->grid && !box_in_world(other->grid, &min, &max))
		return node_error(n, e, EINVAL, FLATTENED_MESSAGE);
	if (other->grid && other->grid->is_world_aligned) {
		min = other->grid->world_min;
		max = other->grid->world_max;
	}
	if (!v->grid)
		return other->grid && add_unit_cell(v, min, max, build) ? node_error(n, e, ENOMEM, "out of memory") : 0;
	if (v->grid->wrap != GRID_CLAMP)
		return node_error(n, e, ENOTSUP, "its grid cannot repeat itself (wrap_mode)");
	struct grid *g = arena_alloc(build->arena, 1, sizeof *g);
	if (!g)
		return node_error(n, e, ENOMEM, "out of memory");
	*g = *v->grid;
	v->grid = g;
	set_world_box(g, min, max);
	return 0;
}

static bool has_same_points(const struct grid *a, const struct grid *build)
{
	bool same = a->is_nearest == build->is_nearest && a->wrap == build->wrap;
	for (int i = 0; i < 3; i++)
		same = same && a->size[i] == build->size[i];
	return same && memcmp(&a->to_cells, &build->to_cells, sizeof a->to_cells) == 0;
}

/* Makes a grid of ones at the points of `points`, within the box of `box`. */
static int add_ones(struct grid *g, const struct grid *points, const struct grid *box, const struct volume_build *build)
{
	vec3 min, max;
	size_t count = (size_t)points->size[0] * (size_t)points->size[1] * (size_t)points->size[2];
	float *value = arena_alloc(build->arena, count, sizeof *value);
	*g = *points;
	g->channels = 1;
	g->value = value;
	unsigned char *bricks = arena_alloc(build->arena, grid_brick_count(g), 1);
	g->occupied_bricks = bricks;
	if (!value || !bricks || !box_in_world(box, &min, &max))
		return -ENOMEM;
	for (size_t i = 0; i < count; i++)
		value[i] = 1;
	memset(bricks, 1, grid_brick_count(g));
	set_world_box(g, box->is_world_aligned ? box->world_min : min, box->is_world_aligned ? box->world_max : max);
	return 0;
}

int volume_scale_by_area(struct volume *v, const struct grid area[2], const struct scene_node *n,
			 const struct volume_build *build, struct error *e)
{
	bool is_cube = v->grid && v->grid->value == &unit_value;
	struct grid *g = arena_alloc(build->arena, 1, sizeof *g);
	if (!g)
		return node_error(n, e, ENOMEM, "out of memory");
	if (!v->grid)
		return node_error(n, e, ENOTSUP, "S varies in space: needs a heterogeneous medium");
	if (is_cube ? area->wrap != GRID_CLAMP : !has_same_points(v->grid, area))
		return node_error(n, e, ENOTSUP,
				  "the grids of sigma_t and of S must have the same size, to_world, filter_type and "
				  "wrap_mode");
	if (is_cube && add_ones(g, area, v->grid, build))
		return node_error(n, e, ENOMEM, "out of memory");
	if (!is_cube)
		*g = *v->grid;
	g->area_matrix = area;
	v->grid = g;
	return 0;
}

/* ---- evaluation ---- */

double volume_min(const struct volume *v)
{
	double color = v->color.kind == COLOR_KIND_CONSTANT ? color_max(&v->color) : 0;
	return v->grid ? v->min_value * color : color;
}

double volume_max(const struct volume *v)
{
	return v->grid ? v->max_value * color_max(&v->color) : color_max(&v->color);
}

bool volume_is_colored(const struct volume *v)
{
	return v->color.kind != COLOR_KIND_CONSTANT || (v->grid && v->grid->channels > 1);
}

int volume_channel_weights(const struct volume *v, const struct wavelengths *w, spectrum weight[GRID_CHANNELS_MAX])
{
	spectrum sum = spectrum_constant(0);
	int channels = v->grid->channels;
	weight[0] = spectrum_constant(1);
	if (channels == 1)
		return 1;
	for (int k = 0; k < channels; k++) {
		weight[k] = color_eval(&v->primary[k], w);
		sum = spectrum_add(sum, weight[k]);
	}
	for (int k = 0; k < channels; k++)
		for (int i = 0; i < SPECTRUM_LANES; i++)
			weight[k].v[i] = sum.v[i] > 0 ? weight[k].v[i] / sum.v[i] : 1.0 / channels;
	return channels;
}

spectrum volume_eval(const struct volume *v, vec3 p, bool bounded, const struct wavelengths *w)
{
	spectrum color = color_eval(&v->color, w);
	if (!v->grid)
		return color;
	double value[GRID_CHANNELS_MAX];
	spectrum weight[GRID_CHANNELS_MAX], sum = spectrum_constant(0);
	if (!grid_eval(v->grid, p, value) && bounded)
		return sum;
	int channels = volume_channel_weights(v, w, weight);
	for (int k = 0; k < channels; k++)
		sum = spectrum_add(sum, spectrum_scale(value[k], weight[k]));
	return spectrum_mul(sum, color);
}
