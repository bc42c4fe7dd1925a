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
	const char *name;
	mat4 to_world;
	double radius;	 /* of all points; negative: each line has its own */
	uint32_t least;	 /* least number of points of a curve */
	bool drop_short; /* curves with fewer points are left out */
	bool begun;	 /* a curve has been begun */
	struct curve_points *out;
	struct error *error;
};

void curve_points_free(struct curve_points *p)
{
	list_free(&p->points);
	list_free(&p->firsts);
}

static int out_of_memory(const struct curve_reader *r)
{
	return node_error(r->node, r->error, ENOMEM, "%s: out of memory", r->name);
}

static int add_start(struct curve_reader *r)
{
	uint32_t *first = list_push(&r->out->firsts);
	if (!first)
		return out_of_memory(r);
	*first = (uint32_t)r->out->points.count;
	return 0;
}

static int add_point(struct curve_reader *r, const double p[4], int line)
{
	struct list *points = &r->out->points;
	int rc = r->begun ? 0 : add_start(r);
	if (rc)
		return rc;
	if (points->count >= POINTS_MAX)
		return node_error(r->node, r->error, EFBIG, "%s: more than %d control points", r->name, POINTS_MAX);
	vec3 at = mat4_point(&r->to_world, mesh_load(p));
	const double sizes[] = {p[0], p[1], p[2], p[3], at.x, at.y, at.z};
	bool good = p[3] >= 0;
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
		good = good && fabs(sizes[i]) <= MESH_COORDINATE_MAX;
	if (!good)
		return node_error(r->node, r->error, ERANGE, "%s:%d: control point (%g, %g, %g) of radius %g", r->name,
				  line, p[0], p[1], p[2], p[3]);
	double *new = list_push(points);
	if (!new)
		return out_of_memory(r);
	mesh_store(new, at);
	new[3] = p[3];
	r->begun = true;
	return 0;
}

static int end_curve(struct curve_reader *r, int line)
{
	struct list *points = &r->out->points, *firsts = &r->out->firsts;
	if (!r->begun)
		return 0;
	r->begun = false;
	uint32_t first = ((const uint32_t *)firsts->items)[firsts->count - 1], count = (uint32_t)points->count - first;
	if (count >= r->least)
		return 0;
	if (!r->drop_short)
		return node_error(r->node, r->error, EINVAL, "%s:%d: a curve of %u control point%s; it needs %u",
				  r->name, line, count, count == 1 ? "" : "s", r->least);
	points->count = first;
	firsts->count--;
	return 0;
}

static int read_line(struct curve_reader *r, const struct text_line *l)
{
	enum { NUMBERS = 4 };
	const char *p = l->word, *end = l->rest + l->rest_length;
	double v[NUMBERS] = {0, 0, 0, r->radius};
	if (l->word_length == 0)
		return end_curve(r, l->number);
	int count = r->radius < 0 ? NUMBERS : NUMBERS - 1;
	for (int i = 0; i < count; i++) {
		while (p < end && number_is_blank(*p))
			p++;
		p = number_scan_printed(p, end, &v[i]);
		if (!p)
			return node_error(r->node, r->error, EINVAL, "%s:%d: a control point has %d numbers", r->name,
					  l->number, count);
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

static const char binary_name[] = "BINARY_HAIR";
enum { BINARY_NAME = sizeof binary_name - 1, BINARY_HEAD = BINARY_NAME + 4 };

static int read_binary(struct curve_reader *r, const struct asset *a)
{
	const unsigned char *p = (const unsigned char *)a->bytes + BINARY_HEAD,
			    *end = (const unsigned char *)a->bytes + a->size;
	uint32_t left = get32((const unsigned char *)a->bytes + BINARY_NAME);
	int rc = 0;
	while (left > 0 && !rc) {
		double v[4] = {0, 0, 0, r->radius};
		liveness_tick();
		if (end - p >= 4 && isinf(get_float(p))) {
			rc = end_curve(r, 0);
			p += 4;
			continue;
		}
		if (end - p < 12)
			return node_error(r->node, r->error, EINVAL, "%s: ends before its last %u vertices", r->name,
					  left);
		for (int k = 0; k < 3; k++, p += 4)
			v[k] = (double)get_float(p);
		rc = add_point(r, v, 0);
		left--;
	}
	return rc ? rc : end_curve(r, 0);
}

static int read_file(struct curve_reader *r, const struct asset_source *assets)
{
	struct asset a;
	struct curve_points *out = r->out;
	*out = (struct curve_points){.points = {.size = sizeof *out->point}, .firsts = {.size = sizeof *out->first}};
	r->name = node_string(r->node, "filename", "");
	r->to_world = node_transform(r->node, "to_world");
	int rc = mesh_open(r->node, assets, &a, r->error);
	if (rc)
		return rc;
	bool binary = r->radius >= 0 && a.size >= BINARY_HEAD && memcmp(a.bytes, binary_name, BINARY_NAME) == 0;
	rc = binary ? read_binary(r, &a) : read_text(r, &a);
	assets->close(assets->user, &a);
	out->curves = (uint32_t)out->firsts.count;
	if (!rc && out->curves == 0)
		rc = node_error(r->node, r->error, EINVAL, "%s: has no curve", r->name);
	if (!rc)
		rc = add_start(r); /* the end of the last curve */
	if (rc) {
		curve_points_free(out);
		return rc;
	}
	out->point = out->points.items;
	out->first = out->firsts.items;
	out->count = (uint32_t)out->points.count;
	return 0;
}

int curve_file_read(const struct scene_node *n, const struct asset_source *assets, uint32_t least,
		    struct curve_points *out, struct error *e)
{
	return read_file(&(struct curve_reader){.node = n, .radius = -1, .least = least, .out = out, .error = e},
			 assets);
}

int curve_file_read_hair(const struct scene_node *n, const struct asset_source *assets, double radius,
			 struct curve_points *out, struct error *e)
{
	return read_file(
		&(struct curve_reader){
			.node = n, .radius = radius, .least = 2, .drop_short = true, .out = out, .error = e},
		assets);
}
