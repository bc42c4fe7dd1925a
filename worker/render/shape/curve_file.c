/* SPDX-License-Identifier: Apache-2.0 */
/*
 * curve_file_read and curve_file_read_hair open the file that the shape names and add its points one by one. The binary
 * form of hair files is "BINARY_HAIR", the number of vertices (32 bits), and three floats per vertex, all
 * little-endian; an infinity between vertices begins a new hair.
 *
 * Reading fails, with the name of the file and the line, if a number is missing, not finite or too large, if a radius
 * is negative, or if a curve has too few points; it also fails if the file has no curve, or if a binary file is
 * truncated.
 */
#include "worker/render/shape/curve_file.h"

#include "common/base/bytes.h"
#include "common/base/liveness.h"
#include "worker/render/text/number.h"
#include "worker/render/text/text_lines.h"
#include "worker/render/shape/mesh.h"

#include <string.h>

enum { POINTS_MAX = 1 << 27 };

struct curve_reader {
	const struct scene_node *node;
	const char *file_name;
	mat4 to_world;
	double radius;		 /* of all points; negative: each line has its own */
	uint32_t min_points;	 /* of a curve */
	bool drops_short_curves; /* curves with fewer points are left out */
	bool is_in_curve;
	struct curve_points *out;
	struct error *error;
};

void curve_points_free(struct curve_points *p)
{
	list_fini(&p->point_list);
	list_fini(&p->first_point_list);
}

static int out_of_memory(const struct curve_reader *r)
{
	return node_error(r->node, r->error, ENOMEM, "%s: out of memory", r->file_name);
}

static int add_curve_start(struct curve_reader *r)
{
	uint32_t *first = list_push(&r->out->first_point_list);
	if (!first)
		return out_of_memory(r);
	*first = (uint32_t)r->out->point_list.count;
	return 0;
}

static int add_point(struct curve_reader *r, const double p[4], int line)
{
	struct list *points = &r->out->point_list;
	int rc = r->is_in_curve ? 0 : add_curve_start(r);
	if (rc)
		return rc;
	if (points->count >= POINTS_MAX)
		return node_error(r->node, r->error, EFBIG, "%s: more than %d control points", r->file_name,
				  POINTS_MAX);
	vec3 world_position = mat4_point(&r->to_world, vec3_load(p));
	const double coordinates[] = {p[0], p[1], p[2], p[3], world_position.x, world_position.y, world_position.z};
	bool in_range = p[3] >= 0;
	for (size_t i = 0; i < sizeof coordinates / sizeof *coordinates; i++)
		in_range = in_range && fabs(coordinates[i]) <= MESH_COORDINATE_MAX;
	if (!in_range)
		return node_error(r->node, r->error, ERANGE, "%s:%d: control point (%g, %g, %g) of radius %g",
				  r->file_name, line, p[0], p[1], p[2], p[3]);
	double *new = list_push(points);
	if (!new)
		return out_of_memory(r);
	vec3_store(new, world_position);
	new[3] = p[3];
	r->is_in_curve = true;
	return 0;
}

static int end_curve(struct curve_reader *r, int line)
{
	struct list *points = &r->out->point_list, *firsts = &r->out->first_point_list;
	if (!r->is_in_curve)
		return 0;
	r->is_in_curve = false;
	uint32_t first = ((const uint32_t *)firsts->items)[firsts->count - 1], count = (uint32_t)points->count - first;
	if (count >= r->min_points)
		return 0;
	if (!r->drops_short_curves)
		return node_error(r->node, r->error, EINVAL, "%s:%d: a curve of %u control point%s; it needs %u",
				  r->file_name, line, count, count == 1 ? "" : "s", r->min_points);
	points->count = first;
	firsts->count--;
	return 0;
}

static int read_line(struct curve_reader *r, const struct text_line *l)
{
	enum { POINT_NUMBERS = 4 };
	const char *p = l->word, *end = l->rest + l->rest_length;
	double v[POINT_NUMBERS] = {0, 0, 0, r->radius};
	if (l->word_length == 0)
		return end_curve(r, l->number);
	int count = r->radius < 0 ? POINT_NUMBERS : POINT_NUMBERS - 1;
	for (int i = 0; i < count; i++) {
		while (p < end && number_is_blank(*p))
			p++;
		p = number_scan_printed(p, end, &v[i]);
		if (!p)
			return node_error(r->node, r->error, EINVAL, "%s:%d: a control point has %d numbers",
					  r->file_name, l->number, count);
	}
	return add_point(r, v, l->number);
}

static int read_text(struct curve_reader *r, const struct asset *a)
{
	struct text_lines lines = {(const char *)a->bytes, (const char *)a->bytes + a->size, 0};
	struct text_line l;
	int rc = 0;
	while (!rc && text_lines_next(&lines, &l)) {
		liveness_tick();
		rc = read_line(r, &l);
	}
	return rc ? rc : end_curve(r, lines.number);
}

static const char binary_magic[] = "BINARY_HAIR";
enum { BINARY_MAGIC_SIZE = sizeof binary_magic - 1, BINARY_HEADER_SIZE = BINARY_MAGIC_SIZE + 4 };

static int read_binary(struct curve_reader *r, const struct asset *a)
{
	const unsigned char *p = (const unsigned char *)a->bytes + BINARY_HEADER_SIZE,
			    *end = (const unsigned char *)a->bytes + a->size;
	uint32_t remaining = get32((const unsigned char *)a->bytes + BINARY_MAGIC_SIZE);
	int rc = 0;
	while (remaining > 0 && !rc) {
		double v[4] = {0, 0, 0, r->radius};
		liveness_tick();
		if (end - p >= 4 && isinf(get_float(p))) {
			rc = end_curve(r, 0);
			p += 4;
			continue;
		}
		if (end - p < 12)
			return node_error(r->node, r->error, EINVAL, "%s: ends before its last %u vertices",
					  r->file_name, remaining);
		for (int k = 0; k < 3; k++, p += 4)
			v[k] = (double)get_float(p);
		rc = add_point(r, v, 0);
		remaining--;
	}
	return rc ? rc : end_curve(r, 0);
}

static int read_file(struct curve_reader *r, const struct asset_source *assets)
{
	struct asset a;
	struct curve_points *out = r->out;
	*out = (struct curve_points){.point_list = {.item_size = sizeof *out->point},
				     .first_point_list = {.item_size = sizeof *out->first_point}};
	r->file_name = node_string(r->node, "filename", "");
	r->to_world = node_transform(r->node, "to_world");
	int rc = mesh_open_file(r->node, assets, &a, r->error);
	if (rc)
		return rc;
	bool binary =
		r->radius >= 0 && a.size >= BINARY_HEADER_SIZE && memcmp(a.bytes, binary_magic, BINARY_MAGIC_SIZE) == 0;
	rc = binary ? read_binary(r, &a) : read_text(r, &a);
	assets->close(assets->user, &a);
	out->curve_count = (uint32_t)out->first_point_list.count;
	if (!rc && out->curve_count == 0)
		rc = node_error(r->node, r->error, EINVAL, "%s: has no curve", r->file_name);
	if (!rc)
		rc = add_curve_start(r); /* the end of the last curve */
	if (rc) {
		curve_points_free(out);
		return rc;
	}
	out->point = out->point_list.items;
	out->first_point = out->first_point_list.items;
	out->point_count = (uint32_t)out->point_list.count;
	return 0;
}

int curve_file_read(const struct scene_node *n, const struct asset_source *assets, uint32_t min_points,
		    struct curve_points *out, struct error *e)
{
	return read_file(
		&(struct curve_reader){.node = n, .radius = -1, .min_points = min_points, .out = out, .error = e},
		assets);
}

int curve_file_read_hair(const struct scene_node *n, const struct asset_source *assets, double radius,
			 struct curve_points *out, struct error *e)
{
	return read_file(&(struct curve_reader){.node = n,
						.radius = radius,
						.min_points = 2,
						.drops_short_curves = true,
						.out = out,
						.error = e},
			 assets);
}
