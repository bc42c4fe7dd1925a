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
struct place {
	vec3 p, direction, normal;	    /* weighted sums, except for p */
	double weight, height, least, most; /* sum of weights; weighted sum, least and largest of heights */
	bool seen, bent;		    /* some triangle has contributed; the place is on a crease or seam */
};

/* The change of the normals of the triangles around a border vertex, weighted by their angles. */
struct turn {
	vec3 sum;
	double weight;
};

struct displacer {
	const struct displacement *d;
	const struct sphere *sphere; /* NULL: the base mesh is the surface itself */
	struct mesh base, out;
	struct displace_grid grid;
	struct place *places;
	struct turn *turns;
	double highest; /* largest |height| */
};

/* The surface at a point before displacement, and the height there. */
struct sample {
	vec3 p, n;
	double u, v, h;
};

static vec3 mix(const double (*a)[3], const uint32_t t[3], const double b[3])
{
	return vec3_madd(vec3_madd(vec3_scale(b[0], mesh_load(a[t[0]])), b[1], mesh_load(a[t[1]])), b[2],
			 mesh_load(a[t[2]]));
}

static vec3 axis(const struct sphere *s, int k)
{
	return (vec3){s->to_world.m[0][k], s->to_world.m[1][k], s->to_world.m[2][k]};
}

/* Samples the sphere in the direction `out`. u is continuous beyond the octant's own quarter, and at the poles has the
 * value of its middle. */
static void sphere_sample(const struct sphere *ball, uint32_t octant, vec3 out, struct sample *s)
{
	vec3 w = vec3_normalize(out);
	double x = vec3_dot(w, axis(ball, 0)), y = vec3_dot(w, axis(ball, 1)), z = vec3_dot(w, axis(ball, 2));
	s->p = vec3_madd(ball->center, ball->radius, w);
	s->n = ball->flip_normals ? vec3_neg(w) : w;
	double middle = ((octant & 3) + 0.5) * M_PI / 2, c = cos(middle), k = sin(middle);
	double turn = hypot(x, y) > 1e-12 ? atan2(c * y - k * x, c * x + k * y) : 0;
	s->u = (middle + turn) / (2 * M_PI);
	s->v = acos(fmin(fmax(z, -1), 1)) / M_PI;
}

static void sample_at(const struct displacer *w, uint32_t triangle, double b1, double b2, struct sample *s)
{
	const struct mesh *m = &w->base;
	const uint32_t *t = m->index[triangle];
	const double b[3] = {1 - b1 - b2, b1, b2};
	vec3 n = mix((const double(*)[3])m->normal, t, b);
	s->u = s->v = 0;
	if (w->sphere) {
		sphere_sample(w->sphere, triangle, n, s);
	} else {
		double length = vec3_length(n);
		s->p = mix((const double(*)[3])m->position, t, b);
		s->n = length > 0 ? vec3_scale(1 / length, n) : mesh_load(m->normal[t[0]]);
		if (m->uv) {
			s->u = b[0] * m->uv[t[0]][0] + b[1] * m->uv[t[1]][0] + b[2] * m->uv[t[2]][0];
			s->v = b[0] * m->uv[t[0]][1] + b[1] * m->uv[t[1]][1] + b[2] * m->uv[t[2]][1];
		}
	}
	s->h = w->d->scale * w->d->height(w->d->user, s->u, s->v);
}

static vec3 tangential_part(vec3 v, vec3 n)
{
	return vec3_madd(v, -vec3_dot(v, n), n);
}

static vec3 normal_or(vec3 v, vec3 otherwise)
{
	double length = vec3_length(v);
	return length > 0 && isfinite(length) ? vec3_scale(1 / length, v) : otherwise;
}

/* Returns the normal of the displaced surface from central differences. The points may be outside the triangle: its
 * plane, normals and (u,v) are extrapolated. */
static vec3 displaced_normal(const struct displacer *w, uint32_t triangle, double b1, double b2,
			     const struct sample *at)
{
	double step = 1.0 / w->grid.parts;
	vec3 flat[2], moved[2];
	for (int k = 0; k < 2; k++) {
		struct sample a, b;
		double s1 = k == 0 ? step : 0, s2 = k == 1 ? step : 0;
		sample_at(w, triangle, b1 + s1, b2 + s2, &a);
		sample_at(w, triangle, b1 - s1, b2 - s2, &b);
		flat[k] = tangential_part(vec3_sub(a.p, b.p), at->n);
		moved[k] = vec3_madd(vec3_madd(flat[k], a.h - b.h, at->n), at->h, vec3_sub(a.n, b.n));
	}
	vec3 n = vec3_cross(moved[0], moved[1]);
	bool behind = vec3_dot(vec3_cross(flat[0], flat[1]), at->n) < 0;
	return normal_or(behind ? vec3_neg(n) : n, at->n);
}

static double corner_angle(const struct mesh *m, const uint32_t t[3], uint32_t k)
{
	vec3 p = mesh_load(m->position[t[k]]);
	return vec3_angle(vec3_sub(mesh_load(m->position[t[(k + 1) % 3]]), p),
			  vec3_sub(mesh_load(m->position[t[(k + 2) % 3]]), p));
}

static void add_to_place(struct place *c, double weight, const struct sample *s, vec3 normal)
{
	if (!c->seen)
		c->p = s->p;
	c->least = c->seen ? fmin(c->least, s->h) : s->h;
	c->most = c->seen ? fmax(c->most, s->h) : s->h;
	c->seen = true;
	c->direction = vec3_madd(c->direction, weight, s->n);
	c->normal = vec3_madd(c->normal, weight, normal);
	c->height += weight * s->h;
	c->weight += weight;
}

/* Interpolates the attributes of a vertex of the finer mesh in its triangle of the base mesh. */
static void mix_attributes(const struct displacer *w, uint32_t triangle, double b1, double b2, uint32_t vertex)
{
	const uint32_t *t = w->base.index[triangle];
	for (uint32_t i = 0; i < w->out.attribute_count; i++) {
		const struct attribute *from = &w->base.attributes[i], *to = &w->out.attributes[i];
		size_t n = from->channels;
		for (size_t k = 0; k < n && !from->per_face; k++)
			to->value[vertex * n + k] = (float)((1 - b1 - b2) * (double)from->value[t[0] * n + k] +
							    b1 * (double)from->value[t[1] * n + k] +
							    b2 * (double)from->value[t[2] * n + k]);
	}
}

static void copy_face(const struct displacer *w, uint32_t triangle, uint32_t to)
{
	for (uint32_t i = 0; i < w->out.attribute_count; i++) {
		const struct attribute *a = &w->base.attributes[i];
		size_t n = a->channels;
		if (a->per_face)
			memcpy(w->out.attributes[i].value + to * n, a->value + triangle * n, n * sizeof *a->value);
	}
}

static void put_vertex(struct displacer *w, uint32_t triangle, uint32_t i, uint32_t j)
{
	uint32_t parts = w->grid.parts;
	struct displace_point at = displace_grid_at(&w->grid, triangle, i, j);
	struct sample s;
	double b1 = (double)i / parts, b2 = (double)j / parts;
	sample_at(w, triangle, b1, b2, &s);
	vec3 normal = displaced_normal(w, triangle, b1, b2, &s);
	w->highest = fmax(w->highest, fabs(s.h));
	mix_attributes(w, triangle, b1, b2, at.vertex);
	if (w->out.uv) {
		w->out.uv[at.vertex][0] = s.u;
		w->out.uv[at.vertex][1] = s.v;
	}
	if (at.inside) {
		mesh_store(w->out.position[at.vertex], vec3_madd(s.p, s.h, s.n));
		mesh_store(w->out.normal[at.vertex], normal);
		return;
	}
	uint32_t corner = i == parts ? 1 : j == parts ? 2 : 0;
	bool is_corner = corner || i + j == 0;
	double weight = is_corner ? corner_angle(&w->base, w->base.index[triangle], corner) : M_PI;
	mesh_store(w->out.normal[at.vertex], s.n);
	add_to_place(&w->places[at.place], weight, &s, normal);
}

/* Moves a place by the mean height along the mean normal. Places without a mean normal, where opposite sheets touch, do
 * not move. */
static void settle_place(const struct displacer *w, struct place *c)
{
	double length = vec3_length(c->direction), height = c->height / c->weight;
	bool agree = length >= CREASE_COSINE * c->weight && c->most - c->least <= SEAM_HEIGHT * w->highest;
	c->bent = !agree;
	if (length > (1 - CREASE_COSINE) * c->weight)
		c->p = vec3_madd(c->p, height / length, c->direction);
}

static void settle_vertex(struct displacer *w, uint32_t triangle, uint32_t i, uint32_t j)
{
	struct displace_point at = displace_grid_at(&w->grid, triangle, i, j);
	if (at.inside)
		return;
	const struct place *c = &w->places[at.place];
	mesh_store(w->out.position[at.vertex], c->p);
	if (!c->bent)
		mesh_store(w->out.normal[at.vertex], normal_or(c->normal, mesh_load(w->out.normal[at.vertex])));
}

/* Calls `what` for every point on the border of every triangle, or for all points. */
static void each_point(struct displacer *w, bool all, void (*what)(struct displacer *, uint32_t, uint32_t, uint32_t))
{
	uint32_t n = w->grid.parts;
	for (uint32_t t = 0; t < w->base.triangle_count; t++)
		for (uint32_t i = 0; i <= n; i++) {
			liveness_tick();
			for (uint32_t j = 0; j <= n - i; j++) {
				if (!all && i > 0 && j > 0 && j < n - i)
					j = n - i;
				what(w, t, i, j);
			}
		}
}

static vec3 unit_area(const vec3 p[3])
{
	return normal_or(vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0])), (vec3){0, 0, 0});
}

static void add_turns(struct displacer *w, uint32_t triangle, const uint32_t ij[3][2],
		      const struct displace_point at[3])
{
	vec3 before[3], after[3];
	for (int k = 0; k < 3; k++) {
		struct sample s;
		sample_at(w, triangle, (double)ij[k][0] / w->grid.parts, (double)ij[k][1] / w->grid.parts, &s);
		before[k] = s.p;
		after[k] = mesh_load(w->out.position[at[k].vertex]);
	}
	vec3 turned = vec3_sub(unit_area(after), unit_area(before));
	for (int k = 0; k < 3; k++) {
		if (at[k].inside || !w->places[at[k].place].bent)
			continue;
		double angle =
			vec3_angle(vec3_sub(after[(k + 1) % 3], after[k]), vec3_sub(after[(k + 2) % 3], after[k]));
		struct turn *turn = &w->turns[at[k].vertex];
		turn->sum = vec3_madd(turn->sum, angle, turned);
		turn->weight += angle;
	}
}

static void put_triangle(struct displacer *w, uint32_t triangle, const uint32_t ij[3][2], uint32_t *index)
{
	struct displace_point at[3];
	bool bent = false;
	for (int k = 0; k < 3; k++) {
		at[k] = displace_grid_at(&w->grid, triangle, ij[k][0], ij[k][1]);
		index[k] = at[k].vertex;
		bent |= !at[k].inside && w->places[at[k].place].bent;
	}
	if (bent)
		add_turns(w, triangle, ij, at);
}

static void put_triangles(struct displacer *w)
{
	uint32_t n = w->grid.parts, count = 0;
	for (uint32_t t = 0; t < w->base.triangle_count; t++)
		for (uint32_t i = 0; i < n; i++) {
			liveness_tick();
			for (uint32_t j = 0; j < n - i; j++) {
				copy_face(w, t, count);
				put_triangle(w, t, (const uint32_t[3][2]){{i, j}, {i + 1, j}, {i, j + 1}},
					     w->out.index[count++]);
				if (i + j + 1 >= n)
					continue;
				copy_face(w, t, count);
				put_triangle(w, t, (const uint32_t[3][2]){{i + 1, j}, {i + 1, j + 1}, {i, j + 1}},
					     w->out.index[count++]);
			}
		}
	for (uint64_t i = 0; i < w->grid.border; i++) {
		vec3 n0 = mesh_load(w->out.normal[i]);
		if (w->turns[i].weight > 0)
			mesh_store(w->out.normal[i],
				   normal_or(vec3_madd(n0, 1 / w->turns[i].weight, w->turns[i].sum), n0));
	}
}

/* Adds the attributes of `from` to m, with all values 0. Returns false if out of memory. */
static bool same_attributes(struct mesh *m, const struct mesh *from, struct arena *arena)
{
	for (uint32_t i = 0; i < from->attribute_count; i++) {
		const struct attribute *a = &from->attributes[i];
		struct attribute *own =
			mesh_add_attribute(m, a->name, a->per_face, a->channels, from->attribute_count, arena);
		if (!own)
			return false;
		own->encoded = a->encoded;
		own->damaged = a->damaged;
	}
	return true;
}

static void split_attributes(struct mesh *m, const struct mesh *from, uint32_t triangle)
{
	for (uint32_t i = 0; i < m->attribute_count; i++) {
		const struct attribute *a = &from->attributes[i];
		float *to = m->attributes[i].value;
		size_t n = a->channels, size = n * sizeof *to;
		if (a->per_face)
			memcpy(to + triangle * n, a->value + triangle * n, size);
		for (size_t k = 0; k < 3 && !a->per_face; k++)
			memcpy(to + (3 * (size_t)triangle + k) * n, a->value + from->index[triangle][k] * n, size);
	}
}

/* Gives each corner its own vertex, since each flat triangle has its own normal. Returns false if out of memory. */
static bool split_flat(struct mesh *m, const struct mesh *from, struct arena *arena)
{
	if (!mesh_alloc(m, 3 * from->triangle_count, from->triangle_count, true, from->uv != NULL, arena) ||
	    !same_attributes(m, from, arena))
		return false;
	for (uint32_t i = 0; i < from->triangle_count; i++) {
		vec3 p[3];
		for (uint32_t k = 0; k < 3; k++)
			p[k] = mesh_load(from->position[from->index[i][k]]);
		split_attributes(m, from, i);
		for (uint32_t k = 0; k < 3; k++) {
			uint32_t v = 3 * i + k;
			m->index[i][k] = v;
			mesh_store(m->position[v], p[k]);
			mesh_store(m->normal[v], unit_area(p));
			if (from->uv)
				memcpy(m->uv[v], from->uv[from->index[i][k]], sizeof m->uv[v]);
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
		vec3 x = axis(s, 0), y = axis(s, 1), z = axis(s, 2);
		const vec3 round[4] = {x, y, vec3_neg(x), vec3_neg(y)};
		const vec3 c[3] = {t < 4 ? z : vec3_neg(z), round[t & 3], round[(t + 1) & 3]};
		bool mirrored = vec3_dot(vec3_cross(x, y), z) < 0, turn = ((t >= 4) != s->flip_normals) != mirrored;
		for (uint32_t k = 0; k < 3; k++) {
			mesh_store(m->normal[3 * t + k], c[k]);
			mesh_store(m->position[3 * t + k], vec3_madd(s->center, s->radius, c[k]));
			m->index[t][k] = 3 * t + (turn && k ? 3 - k : k);
		}
	}
	return true;
}

/* Moves all vertices and makes the triangles. Vertices that no triangle uses stay where they are. */
static int settle_places(struct displacer *w, const struct scene_node *n, struct error *e)
{
	for (uint32_t i = 0; i < w->base.vertex_count; i++) {
		memcpy(w->out.position[i], w->base.position[i], sizeof w->out.position[i]);
		memcpy(w->out.normal[i], w->base.normal[i], sizeof w->out.normal[i]);
	}
	each_point(w, true, put_vertex);
	for (uint64_t i = 0; i < w->grid.places; i++)
		if (w->places[i].seen)
			settle_place(w, &w->places[i]);
	each_point(w, false, settle_vertex);
	for (uint32_t i = 0; i < w->out.vertex_count; i++)
		for (int k = 0; k < 3; k++)
			if (!(fabs(w->out.position[i][k]) <= MESH_COORDINATE_MAX))
				return node_error(n, e, ERANGE, "displacement moves a vertex beyond %g",
						  MESH_COORDINATE_MAX);
	put_triangles(w);
	return 0;
}

static uint32_t parts_of(const struct displacement *d)
{
	return (uint32_t)fmin(fmax(round(ldexp(d->tessellation, (int)d->level)), 1), 1 << DISPLACE_LEVEL_MAX);
}

static int displace_triangles(struct displacer *w, struct shape_geometry *g, struct arena *arena, struct arena *scratch,
			      const struct scene_node *n, struct error *e)
{
	uint32_t parts = parts_of(w->d);
	uint64_t triangles = (g->kind == SHAPE_SPHERE ? 8 : (uint64_t)g->mesh.triangle_count) * parts * parts;
	if (triangles > MESH_TRIANGLES_MAX)
		return node_error(n, e, E2BIG, "displacement_level %u makes %llu triangles; at most %d are supported",
				  w->d->level, (unsigned long long)triangles, MESH_TRIANGLES_MAX);
	bool ok = true;
	w->base = g->mesh;
	if (g->kind == SHAPE_SPHERE)
		ok = make_octahedron(&w->base, w->sphere = &g->sphere, scratch);
	else if (!g->mesh.normal)
		ok = split_flat(&w->base, &g->mesh, scratch);
	ok = ok && displace_grid_init(&w->grid, &w->base, parts, scratch);
	ok = ok && w->grid.vertices <= UINT32_MAX;
	ok = ok &&
	     mesh_alloc(&w->out, (uint32_t)w->grid.vertices, (uint32_t)triangles, true, w->base.uv != NULL, arena);
	ok = ok && same_attributes(&w->out, &w->base, arena);
	w->places = ok ? arena_alloc(scratch, w->grid.places, sizeof *w->places) : NULL;
	w->turns = ok ? arena_alloc(scratch, w->grid.border, sizeof *w->turns) : NULL;
	if (!w->places || !w->turns)
		return node_error(n, e, ENOMEM, "out of memory for %llu triangles", (unsigned long long)triangles);
	int rc = settle_places(w, n, e);
	if (!rc)
		*g = (struct shape_geometry){.kind = SHAPE_MESH, .mesh = w->out};
	return rc;
}

int displace(struct shape_geometry *g, const struct displacement *d, struct arena *arena, const struct scene_node *n,
	     struct error *e)
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
