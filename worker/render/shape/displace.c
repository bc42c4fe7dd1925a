/* SPDX-License-Identifier: Apache-2.0 */
/*
 * displace_triangles subdivides every triangle by the grid (displace_grid.h). At each point it samples position, normal
 * and height, moves the point, and computes the normal of the displaced surface from differences. Points on edges and
 * corners are accumulated at their place first and finalised afterwards, so that neighbouring triangles agree to the
 * bit.
 *
 * Fails if there are more triangles than a mesh may have (before memory is allocated), if a vertex moves too far or
 * heights are not finite, or if memory is out.
 */
#include "worker/render/shape/displace.h"

#include "common/base/liveness.h"
#include "worker/render/shape/displace_grid.h"

#include <string.h>

/* Normals that differ by less than a thousandth of a radian (rounding in files), and heights that differ by less than
 * SEAM_HEIGHT times the largest, do not count as a crease. */
#define CREASE_COSINE (1 - 1e-6)
#define SEAM_HEIGHT 1e-9

/* The contributions of the triangles around a place. */
struct displaced_place {
	vec3 position, direction_sum, normal_sum;	       /* sums are weighted */
	double weight_sum, height_sum, min_height, max_height; /* height_sum: weighted */
	bool has_samples, is_crease; /* some triangle has contributed; the place is on a crease or seam */
};

/* The change of the normals of the triangles around a border vertex, weighted by their angles. */
struct normal_delta {
	vec3 sum;
	double weight;
};

struct displacer {
	const struct displacement *d;
	const struct sphere *sphere; /* NULL: the base mesh is the surface itself */
	struct mesh base, out;
	struct displace_grid grid;
	struct displaced_place *places;
	struct normal_delta *normal_deltas;
	double max_abs_height; /* largest |height| */
};

/* The surface at a point before displacement, and the height there. */
struct surface_sample {
	vec3 p, n;
	double u, v, height;
};

static vec3 mix(const double (*a)[3], const uint32_t t[3], const double b[3])
{
	return vec3_madd(vec3_madd(vec3_scale(b[0], vec3_load(a[t[0]])), b[1], vec3_load(a[t[1]])), b[2],
			 vec3_load(a[t[2]]));
}

static vec3 sphere_axis(const struct sphere *s, int k)
{
	return (vec3){s->to_world.m[0][k], s->to_world.m[1][k], s->to_world.m[2][k]};
}

/* Samples the sphere in the direction `direction`. u is continuous beyond the octant's own quarter, and at the poles
 * has the value of its middle. */
static void sample_sphere(const struct sphere *sphere, uint32_t octant, vec3 direction, struct surface_sample *s)
{
	vec3 w = vec3_normalize(direction);
	double x = vec3_dot(w, sphere_axis(sphere, 0)), y = vec3_dot(w, sphere_axis(sphere, 1)),
	       z = vec3_dot(w, sphere_axis(sphere, 2));
	s->p = vec3_madd(sphere->center, sphere->radius, w);
	s->n = sphere->flips_normals ? vec3_neg(w) : w;
	double middle = ((octant & 3) + 0.5) * M_PI / 2, c = cos(middle), k = sin(middle);
	double offset_angle = hypot(x, y) > 1e-12 ? atan2(c * y - k * x, c * x + k * y) : 0;
	s->u = (middle + offset_angle) / (2 * M_PI);
	s->v = acos(fmin(fmax(z, -1), 1)) / M_PI;
}

static void sample_base(const struct displacer *w, uint32_t triangle, double b1, double b2, struct surface_sample *s)
{
	const struct mesh *m = &w->base;
	const uint32_t *t = m->index[triangle];
	const double b[3] = {1 - b1 - b2, b1, b2};
	vec3 n = mix((const double(*)[3])m->normal, t, b);
	s->u = s->v = 0;
	if (w->sphere) {
		sample_sphere(w->sphere, triangle, n, s);
	} else {
		double length = vec3_length(n);
		s->p = mix((const double(*)[3])m->position, t, b);
		s->n = length > 0 ? vec3_scale(1 / length, n) : vec3_load(m->normal[t[0]]);
		if (m->uv) {
			s->u = b[0] * m->uv[t[0]][0] + b[1] * m->uv[t[1]][0] + b[2] * m->uv[t[2]][0];
			s->v = b[0] * m->uv[t[0]][1] + b[1] * m->uv[t[1]][1] + b[2] * m->uv[t[2]][1];
		}
	}
	s->height = w->d->scale * w->d->height(w->d->user, s->u, s->v);
}

static vec3 tangential_part(vec3 v, vec3 n)
{
	return vec3_madd(v, -vec3_dot(v, n), n);
}

static vec3 normalize_or(vec3 v, vec3 fallback)
{
	double length = vec3_length(v);
	return length > 0 && isfinite(length) ? vec3_scale(1 / length, v) : fallback;
}

/* Returns the normal of the displaced surface from central differences. The points may be outside the triangle: its
 * plane, normals and (u,v) are extrapolated. */
static vec3 displaced_normal(const struct displacer *w, uint32_t triangle, double b1, double b2,
			     const struct surface_sample *center)
{
	double step = 1.0 / w->grid.parts_per_edge;
	vec3 base_difference[2], displaced_difference[2];
	for (int k = 0; k < 2; k++) {
		struct surface_sample a, b;
		double s1 = k == 0 ? step : 0, s2 = k == 1 ? step : 0;
		sample_base(w, triangle, b1 + s1, b2 + s2, &a);
		sample_base(w, triangle, b1 - s1, b2 - s2, &b);
		base_difference[k] = tangential_part(vec3_sub(a.p, b.p), center->n);
		displaced_difference[k] = vec3_madd(vec3_madd(base_difference[k], a.height - b.height, center->n),
						    center->height, vec3_sub(a.n, b.n));
	}
	vec3 n = vec3_cross(displaced_difference[0], displaced_difference[1]);
	bool is_reversed = vec3_dot(vec3_cross(base_difference[0], base_difference[1]), center->n) < 0;
	return normalize_or(is_reversed ? vec3_neg(n) : n, center->n);
}

static double corner_angle(const struct mesh *m, const uint32_t t[3], uint32_t k)
{
	vec3 p = vec3_load(m->position[t[k]]);
	return vec3_angle(vec3_sub(vec3_load(m->position[t[(k + 1) % 3]]), p),
			  vec3_sub(vec3_load(m->position[t[(k + 2) % 3]]), p));
}

static void add_to_place(struct displaced_place *c, double weight, const struct surface_sample *s, vec3 normal)
{
	if (!c->has_samples)
		c->position = s->p;
	c->min_height = c->has_samples ? fmin(c->min_height, s->height) : s->height;
	c->max_height = c->has_samples ? fmax(c->max_height, s->height) : s->height;
	c->has_samples = true;
	c->direction_sum = vec3_madd(c->direction_sum, weight, s->n);
	c->normal_sum = vec3_madd(c->normal_sum, weight, normal);
	c->height_sum += weight * s->height;
	c->weight_sum += weight;
}

/* Interpolates the attributes of a vertex of the finer mesh in its triangle of the base mesh. */
static void mix_attributes(const struct displacer *w, uint32_t triangle, double b1, double b2, uint32_t vertex)
{
	const uint32_t *t = w->base.index[triangle];
	for (uint32_t i = 0; i < w->out.attribute_count; i++) {
		const struct attribute *source = &w->base.attributes[i], *target = &w->out.attributes[i];
		size_t n = source->channels;
		for (size_t k = 0; k < n && !source->is_per_face; k++)
			target->value[vertex * n + k] = (float)((1 - b1 - b2) * (double)source->value[t[0] * n + k] +
								b1 * (double)source->value[t[1] * n + k] +
								b2 * (double)source->value[t[2] * n + k]);
	}
}

static void copy_face_attributes(const struct displacer *w, uint32_t triangle, uint32_t target)
{
	for (uint32_t i = 0; i < w->out.attribute_count; i++) {
		const struct attribute *a = &w->base.attributes[i];
		size_t n = a->channels;
		if (a->is_per_face)
			memcpy(w->out.attributes[i].value + target * n, a->value + triangle * n, n * sizeof *a->value);
	}
}

static void emit_vertex(struct displacer *w, uint32_t triangle, uint32_t i, uint32_t j)
{
	uint32_t parts = w->grid.parts_per_edge;
	struct displace_point point = displace_grid_point(&w->grid, triangle, i, j);
	struct surface_sample s;
	double b1 = (double)i / parts, b2 = (double)j / parts;
	sample_base(w, triangle, b1, b2, &s);
	vec3 normal = displaced_normal(w, triangle, b1, b2, &s);
	w->max_abs_height = fmax(w->max_abs_height, fabs(s.height));
	mix_attributes(w, triangle, b1, b2, point.vertex);
	if (w->out.uv) {
		w->out.uv[point.vertex][0] = s.u;
		w->out.uv[point.vertex][1] = s.v;
	}
	if (point.is_interior) {
		vec3_store(w->out.position[point.vertex], vec3_madd(s.p, s.height, s.n));
		vec3_store(w->out.normal[point.vertex], normal);
		return;
	}
	uint32_t corner = i == parts ? 1 : j == parts ? 2 : 0;
	bool is_corner = corner || i + j == 0;
	double weight = is_corner ? corner_angle(&w->base, w->base.index[triangle], corner) : M_PI;
	vec3_store(w->out.normal[point.vertex], s.n);
	add_to_place(&w->places[point.place], weight, &s, normal);
}

/* Moves a place by the mean height along the mean normal. Places without a mean normal, where opposite sheets touch, do
 * not move. */
static void finish_place(const struct displacer *w, struct displaced_place *c)
{
	double length = vec3_length(c->direction_sum), height = c->height_sum / c->weight_sum;
	bool agree = length >= CREASE_COSINE * c->weight_sum &&
		     c->max_height - c->min_height <= SEAM_HEIGHT * w->max_abs_height;
	c->is_crease = !agree;
	if (length > (1 - CREASE_COSINE) * c->weight_sum)
		c->position = vec3_madd(c->position, height / length, c->direction_sum);
}

static void finish_vertex(struct displacer *w, uint32_t triangle, uint32_t i, uint32_t j)
{
	struct displace_point point = displace_grid_point(&w->grid, triangle, i, j);
	if (point.is_interior)
		return;
	const struct displaced_place *c = &w->places[point.place];
	vec3_store(w->out.position[point.vertex], c->position);
	if (!c->is_crease)
		vec3_store(w->out.normal[point.vertex],
			   normalize_or(c->normal_sum, vec3_load(w->out.normal[point.vertex])));
}

/* Calls `visit` for every point on the border of every triangle, or for all points. */
static void for_each_point(struct displacer *w, bool include_interior,
			   void (*visit)(struct displacer *, uint32_t, uint32_t, uint32_t))
{
	uint32_t n = w->grid.parts_per_edge;
	for (uint32_t t = 0; t < w->base.triangle_count; t++)
		for (uint32_t i = 0; i <= n; i++) {
			liveness_tick();
			for (uint32_t j = 0; j <= n - i; j++) {
				if (!include_interior && i > 0 && j > 0 && j < n - i)
					j = n - i;
				visit(w, t, i, j);
			}
		}
}

static vec3 triangle_unit_normal(const vec3 p[3])
{
	return normalize_or(vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0])), (vec3){0, 0, 0});
}

static void add_normal_deltas(struct displacer *w, uint32_t triangle, const uint32_t ij[3][2],
			      const struct displace_point points[3])
{
	vec3 base[3], displaced[3];
	for (int k = 0; k < 3; k++) {
		struct surface_sample s;
		sample_base(w, triangle, (double)ij[k][0] / w->grid.parts_per_edge,
			    (double)ij[k][1] / w->grid.parts_per_edge, &s);
		base[k] = s.p;
		displaced[k] = vec3_load(w->out.position[points[k].vertex]);
	}
	vec3 delta = vec3_sub(triangle_unit_normal(displaced), triangle_unit_normal(base));
	for (int k = 0; k < 3; k++) {
		if (points[k].is_interior || !w->places[points[k].place].is_crease)
			continue;
		double angle = vec3_angle(vec3_sub(displaced[(k + 1) % 3], displaced[k]),
					  vec3_sub(displaced[(k + 2) % 3], displaced[k]));
		struct normal_delta *entry = &w->normal_deltas[points[k].vertex];
		entry->sum = vec3_madd(entry->sum, angle, delta);
		entry->weight += angle;
	}
}

static void emit_triangle(struct displacer *w, uint32_t triangle, const uint32_t ij[3][2], uint32_t *index)
{
	struct displace_point points[3];
	bool bent = false;
	for (int k = 0; k < 3; k++) {
		points[k] = displace_grid_point(&w->grid, triangle, ij[k][0], ij[k][1]);
		index[k] = points[k].vertex;
		bent |= !points[k].is_interior && w->places[points[k].place].is_crease;
	}
	if (bent)
		add_normal_deltas(w, triangle, ij, points);
}

static void emit_triangles(struct displacer *w)
{
	uint32_t n = w->grid.parts_per_edge, count = 0;
	for (uint32_t t = 0; t < w->base.triangle_count; t++)
		for (uint32_t i = 0; i < n; i++) {
			liveness_tick();
			for (uint32_t j = 0; j < n - i; j++) {
				copy_face_attributes(w, t, count);
				emit_triangle(w, t, (const uint32_t[3][2]){{i, j}, {i + 1, j}, {i, j + 1}},
					      w->out.index[count++]);
				if (i + j + 1 >= n)
					continue;
				copy_face_attributes(w, t, count);
				emit_triangle(w, t, (const uint32_t[3][2]){{i + 1, j}, {i + 1, j + 1}, {i, j + 1}},
					      w->out.index[count++]);
			}
		}
	for (uint64_t i = 0; i < w->grid.border_vertex_count; i++) {
		vec3 n0 = vec3_load(w->out.normal[i]);
		if (w->normal_deltas[i].weight > 0)
			vec3_store(w->out.normal[i],
				   normalize_or(vec3_madd(n0, 1 / w->normal_deltas[i].weight, w->normal_deltas[i].sum),
						n0));
	}
}

/* Adds the attributes of `source` to m, with all values 0. Returns false if out of memory. */
static bool add_empty_attributes(struct mesh *m, const struct mesh *source, struct arena *arena)
{
	for (uint32_t i = 0; i < source->attribute_count; i++) {
		const struct attribute *a = &source->attributes[i];
		struct attribute *copy =
			mesh_add_attribute(m, a->name, a->is_per_face, a->channels, source->attribute_count, arena);
		if (!copy)
			return false;
		copy->is_srgb = a->is_srgb;
		copy->has_invalid_value = a->has_invalid_value;
	}
	return true;
}

static void split_attributes(struct mesh *m, const struct mesh *source, uint32_t triangle)
{
	for (uint32_t i = 0; i < m->attribute_count; i++) {
		const struct attribute *a = &source->attributes[i];
		float *target = m->attributes[i].value;
		size_t n = a->channels, size = n * sizeof *target;
		if (a->is_per_face)
			memcpy(target + triangle * n, a->value + triangle * n, size);
		for (size_t k = 0; k < 3 && !a->is_per_face; k++)
			memcpy(target + (3 * (size_t)triangle + k) * n, a->value + source->index[triangle][k] * n,
			       size);
	}
}

/* Gives each corner its own vertex, since each flat triangle has its own normal. Returns false if out of memory. */
static bool split_corners(struct mesh *m, const struct mesh *source, struct arena *arena)
{
	if (!mesh_alloc(m, 3 * source->triangle_count, source->triangle_count, true, source->uv != NULL, arena) ||
	    !add_empty_attributes(m, source, arena))
		return false;
	for (uint32_t i = 0; i < source->triangle_count; i++) {
		vec3 p[3];
		for (uint32_t k = 0; k < 3; k++)
			p[k] = vec3_load(source->position[source->index[i][k]]);
		split_attributes(m, source, i);
		for (uint32_t k = 0; k < 3; k++) {
			uint32_t v = 3 * i + k;
			m->index[i][k] = v;
			vec3_store(m->position[v], p[k]);
			vec3_store(m->normal[v], triangle_unit_normal(p));
			if (source->uv)
				memcpy(m->uv[v], source->uv[source->index[i][k]], sizeof m->uv[v]);
		}
	}
	return true;
}

/* Makes an octahedron whose normals are the directions from the centre. Octants are numbered by their quarter of
 * longitude, from 0 in the upper half and from 4 in the lower half. */
static bool make_octahedron(struct mesh *m, const struct sphere *s, struct arena *arena)
{
	if (!mesh_alloc(m, 24, 8, true, true, arena))
		return false;
	for (uint32_t t = 0; t < 8; t++) {
		vec3 x = sphere_axis(s, 0), y = sphere_axis(s, 1), z = sphere_axis(s, 2);
		const vec3 equator[4] = {x, y, vec3_neg(x), vec3_neg(y)};
		const vec3 c[3] = {t < 4 ? z : vec3_neg(z), equator[t & 3], equator[(t + 1) & 3]};
		bool is_mirrored = vec3_dot(vec3_cross(x, y), z) < 0,
		     is_reversed = ((t >= 4) != s->flips_normals) != is_mirrored;
		for (uint32_t k = 0; k < 3; k++) {
			vec3_store(m->normal[3 * t + k], c[k]);
			vec3_store(m->position[3 * t + k], vec3_madd(s->center, s->radius, c[k]));
			m->index[t][k] = 3 * t + (is_reversed && k ? 3 - k : k);
		}
	}
	return true;
}

/* Moves all vertices and makes the triangles. Vertices that no triangle uses stay where they are. */
static int displace_vertices(struct displacer *w, const struct scene_node *n, struct error *e)
{
	for (uint32_t i = 0; i < w->base.vertex_count; i++) {
		memcpy(w->out.position[i], w->base.position[i], sizeof w->out.position[i]);
		memcpy(w->out.normal[i], w->base.normal[i], sizeof w->out.normal[i]);
	}
	for_each_point(w, true, emit_vertex);
	for (uint64_t i = 0; i < w->grid.place_count; i++)
		if (w->places[i].has_samples)
			finish_place(w, &w->places[i]);
	for_each_point(w, false, finish_vertex);
	for (uint32_t i = 0; i < w->out.vertex_count; i++)
		for (int k = 0; k < 3; k++)
			if (!(fabs(w->out.position[i][k]) <= MESH_COORDINATE_MAX))
				return node_error(n, e, ERANGE, "displacement moves a vertex beyond %g",
						  MESH_COORDINATE_MAX);
	emit_triangles(w);
	return 0;
}

static uint32_t parts_per_edge(const struct displacement *d)
{
	return (uint32_t)fmin(fmax(round(ldexp(d->tessellation, (int)d->level)), 1), 1 << DISPLACE_LEVEL_MAX);
}

static int displace_triangles(struct displacer *w, struct shape_geometry *g, struct arena *arena, struct arena *scratch,
			      const struct scene_node *n, struct error *e)
{
	uint32_t parts = parts_per_edge(w->d);
	uint64_t triangles = (g->kind == SHAPE_SPHERE ? 8 : (uint64_t)g->mesh.triangle_count) * parts * parts;
	if (triangles > MESH_TRIANGLES_MAX)
		return node_error(n, e, E2BIG, "displacement_level %u makes %llu triangles; at most %d are supported",
				  w->d->level, (unsigned long long)triangles, MESH_TRIANGLES_MAX);
	bool ok = true;
	w->base = g->mesh;
	if (g->kind == SHAPE_SPHERE)
		ok = make_octahedron(&w->base, w->sphere = &g->sphere, scratch);
	else if (!g->mesh.normal)
		ok = split_corners(&w->base, &g->mesh, scratch);
	ok = ok && displace_grid_init(&w->grid, &w->base, parts, scratch);
	ok = ok && w->grid.vertex_count <= UINT32_MAX;
	ok = ok &&
	     mesh_alloc(&w->out, (uint32_t)w->grid.vertex_count, (uint32_t)triangles, true, w->base.uv != NULL, arena);
	ok = ok && add_empty_attributes(&w->out, &w->base, arena);
	w->places = ok ? arena_alloc(scratch, w->grid.place_count, sizeof *w->places) : NULL;
	w->normal_deltas = ok ? arena_alloc(scratch, w->grid.border_vertex_count, sizeof *w->normal_deltas) : NULL;
	if (!w->places || !w->normal_deltas)
		return node_error(n, e, ENOMEM, "out of memory for %llu triangles", (unsigned long long)triangles);
	int rc = displace_vertices(w, n, e);
	if (!rc)
		*g = (struct shape_geometry){.kind = SHAPE_MESH, .mesh = w->out};
	return rc;
}

int displace_geometry(struct shape_geometry *g, const struct displacement *d, struct arena *arena,
		      const struct scene_node *n, struct error *e)
{
	if (g->kind == SHAPE_MESH && !g->mesh.uv && !d->is_constant)
		return node_error(n, e, EINVAL,
				  "displacement by a texture needs texture coordinates, but the mesh has none");
	struct displacer w = {.d = d};
	struct arena scratch = {0};
	int rc = displace_triangles(&w, g, arena, &scratch, n, e);
	arena_fini(&scratch);
	return rc;
}
