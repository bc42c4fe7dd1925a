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

#define PLACE VALUE_POINT, PARAM_UNDERSTOOD, -PARAM_LENGTH_MAX, PARAM_LENGTH_MAX, NULL

/* Upper bound of values that are not reflectances. */
#define LARGEST 1e30

const struct plugin_decl volume_decls[] = {
	PLUGIN(VOLUME, "constvolume", {"value", VALUE_COLOR | VALUE_STRING, PARAM_UNDERSTOOD, 0, LARGEST, NULL},
	       {"to_world", UNDERSTOOD(VALUE_TRANSFORM)}),
	PLUGIN(VOLUME, "gridvolume", {"filename", UNDERSTOOD(VALUE_STRING)}, {"to_world", UNDERSTOOD(VALUE_TRANSFORM)},
	       {"use_grid_bbox", UNDERSTOOD(VALUE_BOOL | VALUE_OF_3)},
	       {"filter_type", VALUE_STRING | VALUE_OF_3, PARAM_UNDERSTOOD, 0, 0, "trilinear|nearest"},
	       {"wrap_mode", VALUE_STRING | VALUE_OF_3, PARAM_UNDERSTOOD, 0, 0, "clamp|repeat|mirror"},
	       {"min", PLACE},			 /* of 0.6 */
	       {"max", PLACE}, {"raw", IGNORED}, /* values are never decoded from sRGB */
	       {"max_value", IGNORED}, {"accel", IGNORED}, {"send_data", IGNORED}),
	{0, NULL, NULL, 0, 0},
};

/* ---- place ---- */

/* Finds the box to which to_world is applied. */
static void box_of(const struct scene_node *n, const struct grid_file *f, bool dialect_3, double box[2][3])
{
	const struct property *min = node_find(n, "min"), *max = node_find(n, "max");
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
static bool box_in_world(const struct grid *g, vec3 *least, vec3 *most)
{
	mat4 to_world;
	if (!mat4_invert(g->to_cells, &to_world))
		return false;
	*least = (vec3){INFINITY, INFINITY, INFINITY};
	*most = vec3_neg(*least);
	for (int k = 0; k < 8; k++) {
		vec3 p = mat4_point(&to_world, (vec3){k & 1 ? g->high[0] : g->low[0], k & 2 ? g->high[1] : g->low[1],
						      k & 4 ? g->high[2] : g->low[2]});
		*least = (vec3){fmin(least->x, p.x), fmin(least->y, p.y), fmin(least->z, p.z)};
		*most = (vec3){fmax(most->x, p.x), fmax(most->y, p.y), fmax(most->z, p.z)};
	}
	return true;
}

static void set_box(struct grid *g, vec3 least, vec3 most)
{
	g->turned = true;
	g->least = least;
	g->most = most;
	for (int k = 0; k < 8; k++) {
		vec3 p = mat4_point(&g->to_cells, (vec3){k & 1 ? most.x : least.x, k & 2 ? most.y : least.y,
							 k & 4 ? most.z : least.z});
		const double x[3] = {p.x, p.y, p.z};
		for (int i = 0; i < 3; i++) {
			g->low[i] = fmax(fmin(g->low[i], x[i]), -GRID_CELL_MAX);
			g->high[i] = fmin(fmax(g->high[i], x[i]), GRID_CELL_MAX);
		}
	}
}

/* Returns whether some axis of the volume is not parallel to one of the world's, allowing for the rounding of sines and
 * cosines in a rotation. */
static bool is_turned(const mat4 *m)
{
	for (int i = 0; i < 3; i++) {
		double x = fabs(m->m[i][0]), y = fabs(m->m[i][1]), z = fabs(m->m[i][2]), most = fmax(x, fmax(y, z));
		if ((x > 1e-12 * most) + (y > 1e-12 * most) + (z > 1e-12 * most) != 1)
			return true;
	}
	return false;
}

#define FLATTENED "to_world flattens the volume (it has no inverse)"

static int place_grid(struct grid *g, const struct scene_node *n, double box[2][3], const struct volume_build *b,
		      struct error *e)
{
	double per[3], offset = b->dialect_3 && !g->nearest ? -0.5 : 0;
	mat4 to_world = node_transform(n, "to_world"), to_volume;
	for (int i = 0; i < 3; i++) {
		double cells = b->dialect_3 || g->nearest ? g->size[i] : g->size[i] - 1;
		bool known = isfinite(box[0][i]) && isfinite(box[1][i]);
		per[i] = known && box[1][i] > box[0][i] ? cells / (box[1][i] - box[0][i]) : 0;
		g->low[i] = offset;
		g->high[i] = cells + offset;
		if (!(isfinite(per[i]) && per[i] > 0))
			return node_error(n, e, EINVAL, "its box, or its grid, is flat along %c", "xyz"[i]);
	}
	if (!mat4_invert(to_world, &to_volume))
		return node_error(n, e, EINVAL, FLATTENED);
	mat4 to_cells = mat4_mul(mat4_scale((vec3){per[0], per[1], per[2]}),
				 mat4_translate((vec3){-box[0][0], -box[0][1], -box[0][2]}));
	to_cells = mat4_mul(mat4_translate((vec3){offset, offset, offset}), mat4_mul(to_cells, to_volume));
	mat4 to_scene =
		mat4_mul(mat4_translate(b->center), mat4_scale((vec3){1 / b->scale, 1 / b->scale, 1 / b->scale}));
	g->to_cells = mat4_mul(to_cells, to_scene);
	if (!b->dialect_3 || !is_turned(&g->to_cells))
		return 0;
	/* Mitsuba 3 bounds a medium by the bounding box of its volume that is parallel to the world's axes. */
	vec3 least, most;
	if (!box_in_world(g, &least, &most))
		return node_error(n, e, EINVAL, FLATTENED);
	set_box(g, least, most);
	return 0;
}

/* ---- reading ---- */

static int check_values(const struct scene_node *n, const struct grid_file *f, enum color_role role, struct error *e)
{
	double most = role == COLOR_REFLECTANCE ? 1 : LARGEST;
	if (f->least >= 0 && f->largest <= most)
		return 0;
	return node_error(n, e, ERANGE, "%s: its values go from %g to %g; [0, %g] is supported here",
			  node_string(n, "filename", ""), f->least, f->largest, most);
}

static enum grid_outside outside_of(const struct scene_node *n, bool dialect_3)
{
	const char *mode = node_string(n, "wrap_mode", "clamp");
	if (!dialect_3)
		return GRID_ZERO;
	return strcmp(mode, "repeat") == 0 ? GRID_REPEAT : strcmp(mode, "mirror") == 0 ? GRID_MIRROR : GRID_CLAMP;
}

int volume_grid(struct grid *g, const struct scene_node *n, const struct grid_file *f, const struct volume_build *b,
		struct error *e)
{
	double box[2][3];
	*g = (struct grid){.size = {(int)f->size[0], (int)f->size[1], (int)f->size[2]},
			   .channels = (int)f->channels,
			   .value = f->value,
			   .full = f->full,
			   .nearest = strcmp(node_string(n, "filter_type", "trilinear"), "nearest") == 0,
			   .outside = outside_of(n, b->dialect_3)};
	box_of(n, f, b->dialect_3, box);
	return place_grid(g, n, box, b, e);
}

static int read_grid(struct volume *v, const struct scene_node *n, enum color_role role, const struct volume_build *b,
		     struct error *e)
{
	struct grid_file f;
	int rc = grid_file_share(b->cache, n, b->assets, b->arena, &f, e);
	if (!rc)
		rc = check_values(n, &f, role, e);
	if (rc)
		return rc;
	rc = color_from_rgb((const double[3]){1, 1, 1}, role, &v->color);
	v->least = f.least;
	v->largest = f.largest;
	for (int k = 0; k < GRID_CHANNELS_MAX && f.channels > 1 && !rc; k++) {
		const double rgb[3] = {k == 0, k == 1, k == 2};
		rc = color_from_rgb(rgb, COLOR_REFLECTANCE, &v->primary[k]);
	}
	struct grid *g = arena_alloc(b->arena, 1, sizeof *g);
	if (!rc && !g)
		rc = node_error(n, e, ENOMEM, "out of memory");
	if (!rc)
		rc = volume_grid(g, n, &f, b, e);
	v->grid = g;
	if (!rc && g->turned && role != COLOR_REFLECTANCE && g->outside != GRID_CLAMP)
		rc = node_error(n, e, ENOTSUP, "a rotated density cannot repeat itself (wrap_mode)");
	return rc;
}

static const float one = 1;
static const unsigned char full = 1;
static const struct grid one_cell = {.size = {1, 1, 1},
				     .channels = 1,
				     .value = &one,
				     .full = &full,
				     .high = {1, 1, 1},
				     .nearest = true,
				     .outside = GRID_CLAMP};

/* Limits a constant colour to the unit cube; outside, the value is 0. */
static int add_cube(struct volume *v, const struct scene_node *n, const struct volume_build *b, struct error *e)
{
	double unit[2][3] = {{0, 0, 0}, {1, 1, 1}};
	struct grid *g = arena_alloc(b->arena, 1, sizeof *g);
	if (!g)
		return node_error(n, e, ENOMEM, "out of memory");
	*g = one_cell;
	v->largest = 1;
	v->grid = g;
	return place_grid(g, n, unit, b, e);
}

int volume_from_node(struct volume *v, const struct scene_node *n, const char *name, double fallback,
		     enum color_role role, bool in_cube, const struct volume_build *b, struct error *e)
{
	const struct property *p = node_find(n, name);
	bool nested = p && p->value.type == VALUE_NODE;
	*v = (struct volume){.color = color_constant(fallback)};
	if (nested) {
		n = p->value.as.node;
		if (strcmp(n->type, "gridvolume") == 0)
			return read_grid(v, n, role, b, e);
		p = node_find(n, "value");
		if (!p && !b->dialect_3)
			return node_error(n, e, EINVAL, "needs a value; --lenient leaves it out");
		v->color = color_constant(1);
	}
	struct error reason;
	int code = p ? color_from_value(&p->value, role, b->arena, &v->color, &reason) : 0;
	if (code)
		return node_error(n, e, -code, "%s: %s", nested ? "value" : name, reason.text);
	return in_cube ? add_cube(v, n, b, e) : 0;
}

/* Gives v a grid that consists of one cell of value 1, which is the given box. */
static int add_cell(struct volume *v, vec3 least, vec3 most, const struct volume_build *b)
{
	struct grid *g = arena_alloc(b->arena, 1, sizeof *g);
	vec3 size = vec3_sub(most, least);
	if (!g)
		return -ENOMEM;
	*g = one_cell;
	g->to_cells = mat4_mul(mat4_scale((vec3){1 / size.x, 1 / size.y, 1 / size.z}), mat4_translate(vec3_neg(least)));
	v->largest = 1;
	v->grid = g;
	set_box(g, least, most);
	return 0;
}

int volume_cover(struct volume *v, const struct volume *other, const struct scene_node *n, const struct volume_build *b,
		 struct error *e)
{
	/* Without a grid, the box of the whole scene, whose radius is 1. */
	vec3 least = {-2, -2, -2}, most = {2, 2, 2};
	if (other->grid && !box_in_world(other->grid, &least, &most))
		return node_error(n, e, EINVAL, FLATTENED);
	if (other->grid && other->grid->turned) {
		least = other->grid->least;
		most = other->grid->most;
	}
	if (!v->grid)
		return other->grid && add_cell(v, least, most, b) ? node_error(n, e, ENOMEM, "out of memory") : 0;
	if (v->grid->outside != GRID_CLAMP)
		return node_error(n, e, ENOTSUP, "its grid cannot repeat itself (wrap_mode)");
	struct grid *g = arena_alloc(b->arena, 1, sizeof *g);
	if (!g)
		return node_error(n, e, ENOMEM, "out of memory");
	*g = *v->grid;
	v->grid = g;
	set_box(g, least, most);
	return 0;
}

static bool same_points(const struct grid *a, const struct grid *b)
{
	bool same = a->nearest == b->nearest && a->outside == b->outside;
	for (int i = 0; i < 3; i++)
		same = same && a->size[i] == b->size[i];
	return same && memcmp(&a->to_cells, &b->to_cells, sizeof a->to_cells) == 0;
}

/* Makes a grid of ones at the points of `at`, within the box of `box`. */
static int add_ones(struct grid *g, const struct grid *at, const struct grid *box, const struct volume_build *b)
{
	vec3 least, most;
	size_t count = (size_t)at->size[0] * (size_t)at->size[1] * (size_t)at->size[2];
	float *value = arena_alloc(b->arena, count, sizeof *value);
	*g = *at;
	g->channels = 1;
	g->value = value;
	unsigned char *bricks = arena_alloc(b->arena, grid_bricks(g), 1);
	g->full = bricks;
	if (!value || !bricks || !box_in_world(box, &least, &most))
		return -ENOMEM;
	for (size_t i = 0; i < count; i++)
		value[i] = 1;
	memset(bricks, 1, grid_bricks(g));
	set_box(g, box->turned ? box->least : least, box->turned ? box->most : most);
	return 0;
}

int volume_by_area(struct volume *v, const struct grid area[2], const struct scene_node *n,
		   const struct volume_build *b, struct error *e)
{
	bool cube = v->grid && v->grid->value == &one;
	struct grid *g = arena_alloc(b->arena, 1, sizeof *g);
	if (!g)
		return node_error(n, e, ENOMEM, "out of memory");
	if (!v->grid)
		return node_error(n, e, ENOTSUP, "S varies in space: needs a heterogeneous medium");
	if (cube ? area->outside != GRID_CLAMP : !same_points(v->grid, area))
		return node_error(n, e, ENOTSUP,
				  "the grids of sigma_t and of S must have the same size, to_world, filter_type and "
				  "wrap_mode");
	if (cube && add_ones(g, area, v->grid, b))
		return node_error(n, e, ENOMEM, "out of memory");
	if (!cube)
		*g = *v->grid;
	g->area = area;
	v->grid = g;
	return 0;
}

/* ---- evaluation ---- */

double volume_least(const struct volume *v)
{
	double color = v->color.shape == COLOR_SHAPE_CONSTANT ? color_max(&v->color) : 0;
	return v->grid ? v->least * color : color;
}

double volume_max(const struct volume *v)
{
	return v->grid ? v->largest * color_max(&v->color) : color_max(&v->color);
}

bool volume_is_coloured(const struct volume *v)
{
	return v->color.shape != COLOR_SHAPE_CONSTANT || (v->grid && v->grid->channels > 1);
}

int volume_weights(const struct volume *v, const struct wavelengths *w, spectrum weight[GRID_CHANNELS_MAX])
{
	spectrum sum = spectrum_of(0);
	int channels = v->grid->channels;
	weight[0] = spectrum_of(1);
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

spectrum volume_at(const struct volume *v, vec3 p, bool bounded, const struct wavelengths *w)
{
	spectrum color = color_eval(&v->color, w);
	if (!v->grid)
		return color;
	double value[GRID_CHANNELS_MAX];
	spectrum weight[GRID_CHANNELS_MAX], sum = spectrum_of(0);
	if (!grid_at(v->grid, p, value) && bounded)
		return sum;
	int channels = volume_weights(v, w, weight);
	for (int k = 0; k < channels; k++)
		sum = spectrum_add(sum, spectrum_scale(value[k], weight[k]));
	return spectrum_mul(sum, color);
}
