/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The shapes of a world. build_read_shapes reads them in double; build_rescale chooses the world's origin and scale,
 * which also apply to the camera; build_place_shapes rounds the shapes to float, and keeps those that are too large for
 * that relative to small ones in double as well.
 *
 * Errors name the object's place in the scene file. Triangles without area, meshes without triangles, shapes that are
 * too small relative to others and materials that are not read are counted and noted; they are not errors.
 */
#include "worker/render/world/geometry.h"

#include "common/base/crash.h"
#include "common/base/liveness.h"
#include "worker/render/geom/curves.h"
#include "worker/render/world/displacement.h"
#include "worker/render/world/moving.h"
#include "worker/render/world/place_mesh.h"
#include "worker/render/world/shared_mesh.h"

#include <stdio.h>

/* Limit on the triangles of all shapes together; Embree needs about 150 bytes per triangle. */
enum { TRIANGLES_MAX = 1 << 28 };

/* Counters for the notes: triangles without area, which nothing hits and which are left out, meshes without triangles,
 * and files with materials that Mitsuba 0.6 would read because the shape has no BSDF in the scene. */
struct counted {
	uint64_t triangles;
	uint32_t shapes, empty; /* shapes that have triangles without area; those that have no others */
	const struct scene_node *first;
	uint32_t without; /* meshes without any triangles */
	const struct scene_node *first_without;
	uint64_t odd;	  /* vertices whose normals are not finite */
	uint32_t strange; /* meshes that have such */
	const struct scene_node *first_strange;
	uint32_t materials;
	const struct scene_node *first_material;
};

static void count_flat(struct counted *f, const struct scene_node *n, uint64_t triangles, bool empty)
{
	if (triangles && !f->first)
		f->first = n;
	if (!triangles && empty && f->without++ == 0)
		f->first_without = n;
	f->triangles += triangles;
	f->shapes += triangles > 0;
	f->empty += triangles > 0 && empty;
}

static void note_flat(struct world *w, const struct counted *f)
{
	char first[NODE_TITLE_MAX], empty[64] = "";
	if (f->without)
		snprintf(w->notes.without, sizeof w->notes.without,
			 "%u mesh%s without triangles %s left out (first: %s)", f->without, f->without == 1 ? "" : "es",
			 f->without == 1 ? "is" : "are", node_title(f->first_without, first));
	if (!f->first)
		return;
	if (f->empty)
		snprintf(empty, sizeof empty, "; %u of these shapes ha%s no others", f->empty,
			 f->empty == 1 ? "s" : "ve");
	snprintf(w->notes.flat, sizeof w->notes.flat,
		 "%llu triangle%s without area %s left out, in %u shape%s (first: %s)%s",
		 (unsigned long long)f->triangles, f->triangles == 1 ? "" : "s", f->triangles == 1 ? "is" : "are",
		 f->shapes, f->shapes == 1 ? "" : "s", node_title(f->first, first), empty);
}

static void count_odd(struct counted *c, const struct scene_node *n, uint32_t odd)
{
	if (odd && c->strange++ == 0)
		c->first_strange = n;
	c->odd += odd;
}

static void note_odd(struct world *w, const struct counted *c)
{
	char first[NODE_TITLE_MAX];
	if (c->odd)
		snprintf(w->notes.normals, sizeof w->notes.normals,
			 "%llu normal%s in %u mesh%s (first: %s) %s not finite and count%s as missing",
			 (unsigned long long)c->odd, c->odd == 1 ? "" : "s", c->strange, c->strange == 1 ? "" : "es",
			 node_title(c->first_strange, first), c->odd == 1 ? "is" : "are", c->odd == 1 ? "s" : "");
}

static void count_materials(struct counted *c, const struct builder *b, const struct scene_node *n,
			    const struct shape_geometry *g)
{
	if (!g->materials || b->scene->dialect_3 || node_child(n, PLUGIN_BSDF, 0))
		return;
	if (c->materials++ == 0)
		c->first_material = n;
}

static void note_materials(struct world *w, const struct counted *c)
{
	char first[NODE_TITLE_MAX];
	if (c->materials)
		snprintf(w->notes.materials, sizeof w->notes.materials,
			 "the files of %u mesh%s without a bsdf (first: %s) name materials, but no .mtl file that "
			 "has them; they are rendered in diffuse grey",
			 c->materials, c->materials == 1 ? "" : "es", node_title(c->first_material, first));
}

/* Whether curves must be converted to tubes of triangles, because something needs triangles: displacement; an
 * emitter, whose points are drawn by area; instances and motion, which a placement moves. Curves without any radius
 * become triangles without area. */
static bool needs_triangles(const struct builder *b, const struct scene_node *n, const struct shape_geometry *g,
			    bool placed)
{
	return placed || build_is_displaced(b, n) || node_child(n, PLUGIN_EMITTER, 0) || !(g->curve.thickest > 0);
}

/* Reads a shape. placed: instances or motion will place it. */
static int read_shape(struct builder *b, const struct scene_node *n, bool placed, struct shape_geometry *g,
		      uint64_t *dropped)
{
	liveness_tick();
	crash_place("building the scene", n->file, n->line);
	int rc = shape_build(n, b->assets, &b->scratch, g, dropped, b->e);
	if (!rc && g->kind == SHAPE_CURVE && needs_triangles(b, n, g, placed))
		rc = shape_curve_mesh(g, n, &b->scratch, dropped, b->e);
	if (rc || g->kind == SHAPE_CURVE || (g->kind == SHAPE_MESH && g->mesh.triangle_count == 0) ||
	    b->forced.of[EFFECT_DISPLACEMENT] < 0)
		return rc;
	return displacement_apply(g, n, b->assets, b->scene->dialect_3, b->w->accuracy.tessellation, &b->scratch, b->e);
}

/* Adds a shape to the counters. */
static int take_geometry(struct builder *b, const struct scene_node *n, const struct shape_geometry *g,
			 uint64_t dropped, struct counted *counted)
{
	count_flat(counted, n, dropped, g->kind == SHAPE_MESH && g->mesh.triangle_count == 0);
	count_materials(counted, b, n, g);
	count_odd(counted, n, g->mesh.odd);
	b->triangles += g->mesh.triangle_count + g->curve.chain_points;
	return b->triangles <= TRIANGLES_MAX
		       ? 0
		       : node_error(n, b->e, E2BIG, "with this shape, the scene has more than %d triangles",
				    TRIANGLES_MAX);
}

/* Finds the mesh that an instance shares; the first instance that needs it reads it. *out is NULL if the
 * instance is built on its own. */
static int find_shared(struct builder *b, const struct listed_shape *l, struct shared_mesh **meshes,
		       struct counted *counted, struct shared_mesh **out)
{
	*out = NULL;
	if (!shared_mesh_may(b, l))
		return 0;
	struct shared_mesh *m = meshes[l->first];
	int rc = 0;
	if (!m) {
		uint64_t dropped = 0;
		m = meshes[l->first] = arena_alloc(&b->scratch, 1, sizeof *m);
		if (!m)
			return build_out_of_memory(b->e);
		rc = read_shape(b, l->node, true, &m->geometry, &dropped);
		if (!rc)
			shared_mesh_read(m, l->moves != NULL);
		if (!rc && m->shared)
			rc = take_geometry(b, l->node, &m->geometry, dropped, counted);
	} else if (l->moves && !m->shared) { /* the instances before it do not move */
		shared_mesh_read(m, true);
		if (m->shared)
			rc = take_geometry(b, l->node, &m->geometry, 0, counted);
	}
	*out = m->shared ? m : NULL;
	return rc;
}

/* Adds the next shape to the world, unless it has nothing to hit. */
static int read_listed(struct builder *b, const struct listed_shape *l, struct shared_mesh **meshes,
		       struct counted *counted)
{
	uint32_t id = b->w->shape_count;
	struct shape_geometry *g = &b->geometry[id];
	const struct scene_node *n = l->node;
	int rc = find_shared(b, l, meshes, counted, &b->shared[id]);
	if (!rc && b->shared[id]) {
		*g = b->shared[id]->geometry;
		rc = l->moves ? 0 : shared_mesh_box(b->shared[id], l->instance, &b->boxes[id], b->e);
	} else if (!rc) {
		uint64_t dropped = 0;
		n = shape_placed(l, &b->scratch);
		rc = n ? read_shape(b, n, l->moves != NULL, g, &dropped) : build_out_of_memory(b->e);
		if (!rc)
			rc = take_geometry(b, n, g, dropped, counted);
		if (!rc && g->kind == SHAPE_MESH && g->mesh.triangle_count == 0) {
			b->lost_light |= n->shines;
			return 0;
		}
		if (rc)
			return rc;
		b->boxes[id] = build_box_of(g);
	}
	if (!rc && l->moves)
		rc = moving_begin(b, l, id, b->shared[id] ? b->shared[id]->box : b->boxes[id]);
	if (rc)
		return rc;
	b->shape_nodes[id] = n;
	b->instances[id] = l->instance;
	box_grow(&b->all, b->boxes[id].low);
	box_grow(&b->all, b->boxes[id].high);
	b->w->shape_count++;
	return 0;
}

int build_read_shapes(struct builder *b)
{
	struct listed_shape *list;
	uint32_t listed;
	struct arena *a = &b->scratch;
	int rc = shape_list(b->scene, b->w->settings.shutter_open, b->w->settings.shutter_close, a, b->found, &list,
			    &listed, b->e);
	if (rc)
		return rc;
	struct shared_mesh **meshes = arena_alloc(a, listed, sizeof(void *));
	b->geometry = arena_alloc(a, listed, sizeof *b->geometry);
	b->boxes = arena_alloc(a, listed, sizeof *b->boxes);
	b->shape_nodes = arena_alloc(a, listed, sizeof(void *));
	b->shared = arena_alloc(a, listed, sizeof(void *));
	b->instances = arena_alloc(a, listed, sizeof(void *));
	b->motions = arena_alloc(a, listed, sizeof(void *));
	if (!meshes || !b->geometry || !b->boxes || !b->shape_nodes || !b->shared || !b->instances || !b->motions)
		return build_out_of_memory(b->e);
	b->all = box_empty();
	struct counted counted = {0};
	for (uint32_t i = 0; i < listed; i++) /* shapes of one instance are adjacent */
		b->w->instance_count += list[i].instance && (i == 0 || list[i].instance != list[i - 1].instance);
	for (uint32_t i = 0; i < listed && !rc; i++)
		if ((rc = read_listed(b, &list[i], meshes, &counted)))
			rc = build_go_on(b, rc);
	if (rc)
		return rc;
	note_flat(b->w, &counted);
	note_odd(b->w, &counted);
	note_materials(b->w, &counted);
	crash_place("building the scene", NULL, 0);
	if (b->w->shape_count == 0)
		b->all.low = b->all.high = (vec3){0, 0, 0};
	return 0;
}

/* Points on a shape as large as the scene have errors of a few 2^-53 of its size. If the smallest shape
 * is a few thousand times as large as these errors, integrators agree; at 2^-44 of the scene's size, path
 * and bdpt differed by 2 %. */
#define LEAST_SCALE 0x1p-42

/* Whether p lies in the box, or not farther than `margin` from it along each axis. */
static bool is_in(const struct box *b, vec3 p, double margin)
{
	return p.x >= b->low.x - margin && p.x <= b->high.x + margin && p.y >= b->low.y - margin &&
	       p.y <= b->high.y + margin && p.z >= b->low.z - margin && p.z <= b->high.z + margin;
}

static void note_scales(struct builder *b)
{
	uint32_t small = 0, large = 0;
	char little[NODE_TITLE_MAX], big[NODE_TITLE_MAX];
	for (uint32_t i = 1; i < b->w->shape_count; i++) {
		if (box_extent(&b->boxes[i]) < box_extent(&b->boxes[small]))
			small = i;
		if (box_extent(&b->boxes[i]) > box_extent(&b->boxes[large]))
			large = i;
	}
	if (b->w->shape_count > 0 && box_extent(&b->boxes[small]) < LEAST_SCALE * box_extent(&b->all))
		snprintf(b->w->notes.scales, sizeof b->w->notes.scales,
			 "%s is too small for a scene with %s: double precision does not suffice for both, and its "
			 "image may be wrong",
			 node_title(b->shape_nodes[small], little), node_title(b->shape_nodes[large], big));
}

/* Whether a triangle lies at a distance of less than `limit` from p, but not at 0. */
static bool has_triangle_near(const struct mesh *m, vec3 p, double limit)
{
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		struct box box = box_empty();
		vec3 a = mesh_load(m->position[m->index[i][0]]), side[2];
		for (int k = 0; k < 3; k++)
			box_grow(&box, mesh_load(m->position[m->index[i][k]]));
		if (!is_in(&box, p, limit))
			continue;
		for (int k = 0; k < 2; k++)
			side[k] = vec3_sub(mesh_load(m->position[m->index[i][k + 1]]), a);
		double away = fabs(vec3_dot(vec3_normalize(vec3_cross(side[0], side[1])), vec3_sub(p, a)));
		if (away > 0 && away < limit)
			return true;
	}
	return false;
}

/* Rays are traced in floats that start as far before the camera as errors of the scene's size demand, so that nearer
 * hits drown: a plane at 2^-46 of the scene's size vanished. Curves and instances are not looked at. */
static void note_close(struct builder *b)
{
	struct world *w = b->w;
	vec3 eye = vec3_madd(w->center, 1 / w->scale, w->camera.position);
	double limit = LEAST_SCALE * box_extent(&b->all);
	char title[NODE_TITLE_MAX];
	for (uint32_t i = 0; i < w->shape_count && !*w->notes.close; i++) {
		const struct shape_geometry *g = &b->geometry[i];
		double away = fabs(vec3_length(vec3_sub(eye, g->sphere.center)) - g->sphere.radius);
		bool near = g->kind == SHAPE_SPHERE
				    ? away > 0 && away < limit
				    : g->kind == SHAPE_MESH && !b->shared[i] && is_in(&b->boxes[i], eye, limit) &&
					      has_triangle_near(&g->mesh, eye, limit);
		if (near)
			snprintf(w->notes.close, sizeof w->notes.close,
				 "the camera is too near to %s for a scene as large as this: rays may miss it",
				 node_title(b->shape_nodes[i], title));
	}
}

int build_rescale(struct builder *b)
{
	struct world *w = b->w;
	struct weighted_value *room = arena_alloc(&b->scratch, w->shape_count, sizeof *room);
	if (!room)
		return build_out_of_memory(b->e);
	if (!isfinite(vec3_length(vec3_sub(b->all.high, b->all.low))))
		return error_set(b->e, EINVAL, "the scene's extent is not finite");
	note_scales(b);
	int rc = w->settings.unplaced
			 ? scene_settings_place(&w->settings, b->scene->file, b->all.low, b->all.high, b->e)
			 : 0;
	if (rc)
		return rc;
	w->center = origin_choose(&b->all, b->boxes, w->shape_count, room);
	vec3 over = vec3_sub(b->all.high, w->center), under = vec3_sub(w->center, b->all.low);
	double r = vec3_length((vec3){fmax(over.x, under.x), fmax(over.y, under.y), fmax(over.z, under.z)});
	int exponent = 0;
	if (r > 0)
		frexp(r, &exponent);
	w->scale = ldexp(1, -exponent);
	/* Rounding to float moves vertices by up to 2^-24 of their size; the sphere must still contain them. */
	w->radius = (r > 0 ? r * w->scale : 1) * (1 + 0x1p-20);
	rc = camera_init(&w->camera, &w->settings, w->center, w->scale, b->e);
	for (uint32_t i = 0; rc && i < b->scene->object_count; i++) {
		const struct scene_node *n = b->scene->objects[i];
		if (n->cls == PLUGIN_SENSOR)
			return error_prefix(b->e, rc, "%s:%d: <sensor>", n->file, n->line);
	}
	if (!rc)
		note_close(b);
	return rc ? rc : moving_camera(b);
}

/* ---- curves: their points are rounded to float, like the vertices of meshes, and shared by the cones on both sides,
 * so that a chain has no gaps; cones are computed from the points on demand. ---- */

static bool alloc_curves(struct curves *out, const struct curve *c, struct arena *a)
{
	uint32_t points = c->chain_points, cones = points - c->curves;
	out->open = c->spline;
	out->point = arena_alloc(a, points, sizeof *out->point);
	out->v = arena_alloc(a, points, sizeof *out->v);
	out->cone = arena_alloc(a, cones, sizeof *out->cone);
	out->start = arena_alloc(a, cones, sizeof *out->start);
	out->tangent = c->spline ? arena_alloc(a, points, sizeof *out->tangent) : NULL;
	return out->point && out->v && out->cone && out->start && (out->tangent || !c->spline);
}

static void put_point(struct curves *out, const struct world *w, const struct chain_point *p)
{
	uint32_t i = out->point_count++;
	vec3 at = vec3_scale(w->scale, vec3_sub(p->center, w->center));
	float radius = (float)(w->scale * p->radius);
	out->point[i][0] = (float)at.x;
	out->point[i][1] = (float)at.y;
	out->point[i][2] = (float)at.z;
	out->point[i][3] = radius;
	out->v[i] = (float)p->v;
	out->thickest = radius > out->thickest ? radius : out->thickest;
	if (!out->tangent)
		return;
	out->tangent[i][0] = (float)p->tangent.x;
	out->tangent[i][1] = (float)p->tangent.y;
	out->tangent[i][2] = (float)p->tangent.z;
}

static void put_chain(struct curves *out, const struct world *w, const struct chain_point *p, size_t count)
{
	for (size_t k = 0; k < count; k++) {
		put_point(out, w, &p[k]);
		if (k > 0)
			out->cone[out->count++] = (out->point_count - 2) << CURVE_SHIFT |
						  (k == 1 ? (uint32_t)CURVE_BEGINS : 0) |
						  (k == count - 1 ? (uint32_t)CURVE_ENDS : 0);
	}
}

/* Leaves g->curves NULL if no piece has a radius in float. */
static int place_curves(struct builder *b, struct geom_shape *g, const struct curve *c, const struct scene_node *n)
{
	struct curves *out = arena_alloc(&b->w->arena, 1, sizeof *out);
	struct list points = {.size = sizeof(struct chain_point)};
	int rc = out && alloc_curves(out, c, &b->w->arena) ? 0 : -ENOMEM;
	for (uint32_t i = 0; i < c->curves && !rc; i++) {
		rc = curve_chain(c, i, &points);
		if (!rc)
			put_chain(out, b->w, points.items, points.count);
		liveness_tick();
	}
	list_free(&points);
	if (rc)
		return build_out_of_memory(b->e);
	if (!(out->thickest > 0)) /* no piece has a radius */
		return 0;
	curves_lay(out);
	g->curves = out;
	g->normal_sign = node_bool(n, "flip_normals", false) ? -1 : 1;
	return 0;
}

static void place_sphere(struct builder *b, struct geom_shape *g, const struct sphere *s)
{
	const struct world *w = b->w;
	g->is_sphere = true;
	g->center = vec3_scale(w->scale, vec3_sub(s->center, w->center));
	g->radius = w->scale * s->radius;
	g->normal_sign = s->flip_normals ? -1 : 1;
	g->sphere_axes.s = vec3_normalize(mat4_vector(&s->to_world, (vec3){1, 0, 0}));
	g->sphere_axes.t = vec3_normalize(mat4_vector(&s->to_world, (vec3){0, 1, 0}));
	g->sphere_axes.n = vec3_normalize(mat4_vector(&s->to_world, (vec3){0, 0, 1}));
}

/* Places shape i. *gone: rounded to float, no part of the shape has an area. */
static int place_shape(struct builder *b, uint32_t i, double wide_from, bool *gone)
{
	struct world *w = b->w;
	struct shape_geometry *from = &b->geometry[i];
	struct geom_shape *g = &w->shapes[i];
	*gone = false;
	if (b->shared[i])
		return shared_mesh_place(b, b->shared[i], b->instances[i], i);
	g->unit = w->scale;
	if (from->kind == SHAPE_SPHERE) {
		place_sphere(b, g, &from->sphere);
		return b->motions[i] ? moving_place_sphere(b, i) : 0;
	}
	if (from->kind == SHAPE_CURVE) {
		int rc = place_curves(b, g, &from->curve, b->shape_nodes[i]);
		*gone = !rc && !g->curves;
		return rc;
	}
	int rc = build_place_mesh(b, g, &from->mesh, b->shape_nodes[i], w->center, w->scale);
	*gone = !rc && g->triangle_count == 0;
	return rc || *gone ? rc : build_keep_unrounded(b, g, &from->mesh, wide_from);
}

/* Moves all data of shape `from` to index `to` <= `from`. */
static void move_shape(struct builder *b, uint32_t from, uint32_t to)
{
	if (from == to)
		return;
	b->geometry[to] = b->geometry[from];
	b->boxes[to] = b->boxes[from];
	b->shape_nodes[to] = b->shape_nodes[from];
	b->shared[to] = b->shared[from];
	b->instances[to] = b->instances[from];
	b->motions[to] = b->motions[from];
}

static void note_gone(struct world *w, uint32_t gone, const struct scene_node *first)
{
	char title[NODE_TITLE_MAX];
	if (gone)
		snprintf(w->notes.gone, sizeof w->notes.gone,
			 "%u shape%s too small for the scene to have an area %s left out (first: %s)", gone,
			 gone == 1 ? "" : "s", gone == 1 ? "is" : "are", node_title(first, title));
}

int build_place_shapes(struct builder *b)
{
	struct world *w = b->w;
	w->shapes = arena_alloc(&w->arena, w->shape_count, sizeof *w->shapes);
	w->parts = arena_alloc(&w->arena, w->shape_count, sizeof *w->parts);
	if (!w->shapes || !w->parts)
		return build_out_of_memory(b->e);
	double wide_from = w->scale * origin_wide_from(&b->all, b->boxes, w->shape_count);
	uint32_t kept = 0;
	const struct scene_node *first_gone = NULL;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		bool gone;
		liveness_tick();
		move_shape(b, i, kept);
		int rc = place_shape(b, kept, wide_from, &gone);
		if (rc)
			return rc;
		if (!gone) {
			kept++;
			continue;
		}
		b->lost_light |= b->shape_nodes[kept]->shines;
		first_gone = first_gone ? first_gone : b->shape_nodes[kept];
		w->shapes[kept] = (struct geom_shape){0};
	}
	note_gone(w, w->shape_count - kept, first_gone);
	w->shape_count = kept;
	return 0;
}
