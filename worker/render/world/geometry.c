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
#include "worker/render/world/build_motion.h"
#include "worker/render/world/place_mesh.h"
#include "worker/render/world/shared_mesh.h"

#include <stdio.h>

/* Limit on the triangles of all shapes together; Embree needs about 150 bytes per triangle. */
enum { TRIANGLES_MAX = 1 << 28 };

/* Counters for the notes: triangles without area, which nothing hits and which are left out, meshes without triangles,
 * and files with materials that Mitsuba 0.6 would read because the shape has no BSDF in the scene. */
struct shape_counts {
	uint64_t flat_triangles;
	uint32_t flat_shapes, emptied_shapes; /* shapes that have triangles without area; those that have no others */
	const struct scene_node *first_flat_shape;
	uint32_t empty_meshes; /* meshes without any triangles */
	const struct scene_node *first_empty_mesh;
	uint64_t bad_normals;	    /* vertices whose normals are not finite */
	uint32_t bad_normal_meshes; /* meshes that have such */
	const struct scene_node *first_bad_normal_mesh;
	uint32_t unread_materials;
	const struct scene_node *first_material;
};

static void count_flat(struct shape_counts *f, const struct scene_node *n, uint64_t triangles, bool empty)
{
	if (triangles && !f->first_flat_shape)
		f->first_flat_shape = n;
	if (!triangles && empty && f->empty_meshes++ == 0)
		f->first_empty_mesh = n;
	f->flat_triangles += triangles;
	f->flat_shapes += triangles > 0;
	f->emptied_shapes += triangles > 0 && empty;
}

static void note_flat(struct world *w, const struct shape_counts *f)
{
	char first[NODE_TITLE_MAX], empty[64] = "";
	if (f->empty_meshes)
		snprintf(w->notes.empty_meshes, sizeof w->notes.empty_meshes,
			 "%u mesh%s without triangles %s left out (first: %s)", f->empty_meshes,
			 f->empty_meshes == 1 ? "" : "es", f->empty_meshes == 1 ? "is" : "are",
			 node_title(f->first_empty_mesh, first));
	if (!f->first_flat_shape)
		return;
	if (f->emptied_shapes)
		snprintf(empty, sizeof empty, "; %u of these shapes ha%s no others", f->emptied_shapes,
			 f->emptied_shapes == 1 ? "s" : "ve");
	snprintf(w->notes.flat_triangles, sizeof w->notes.flat_triangles,
		 "%llu triangle%s without area %s left out, in %u shape%s (first: %s)%s",
		 (unsigned long long)f->flat_triangles, f->flat_triangles == 1 ? "" : "s",
		 f->flat_triangles == 1 ? "is" : "are", f->flat_shapes, f->flat_shapes == 1 ? "" : "s",
		 node_title(f->first_flat_shape, first), empty);
}

static void count_bad_normals(struct shape_counts *c, const struct scene_node *n, uint32_t odd)
{
	if (odd && c->bad_normal_meshes++ == 0)
		c->first_bad_normal_mesh = n;
	c->bad_normals += odd;
}

static void note_bad_normals(struct world *w, const struct shape_counts *c)
{
	char first[NODE_TITLE_MAX];
	if (c->bad_normals)
		snprintf(w->notes.bad_normals, sizeof w->notes.bad_normals,
			 "%llu normal%s in %u mesh%s (first: %s) %s not finite and count%s as missing",
			 (unsigned long long)c->bad_normals, c->bad_normals == 1 ? "" : "s", c->bad_normal_meshes,
			 c->bad_normal_meshes == 1 ? "" : "es", node_title(c->first_bad_normal_mesh, first),
			 c->bad_normals == 1 ? "is" : "are", c->bad_normals == 1 ? "s" : "");
}

static void count_materials(struct shape_counts *c, const struct builder *b, const struct scene_node *n,
			    const struct shape_geometry *g)
{
	if (!g->has_materials || b->scene->is_dialect_3 || node_child(n, PLUGIN_BSDF, 0))
		return;
	if (c->unread_materials++ == 0)
		c->first_material = n;
}

static void note_materials(struct world *w, const struct shape_counts *c)
{
	char first[NODE_TITLE_MAX];
	if (c->unread_materials)
		snprintf(w->notes.unread_materials, sizeof w->notes.unread_materials,
			 "the files of %u mesh%s without a bsdf (first: %s) name materials, but no .mtl file that "
			 "has them; they are rendered in diffuse grey",
			 c->unread_materials, c->unread_materials == 1 ? "" : "es",
			 node_title(c->first_material, first));
}

/* Whether curves must be converted to tubes of triangles, because something needs triangles: displacement; an
 * emitter, whose points are drawn by area; instances and motion, which a placement moves. Curves without any radius
 * become triangles without area. */
static bool needs_triangles(const struct builder *b, const struct scene_node *n, const struct shape_geometry *g,
			    bool placed)
{
	return placed || build_is_displaced(b, n) || node_child(n, PLUGIN_EMITTER, 0) || !(g->curve.max_radius > 0);
}

/* Reads a shape. placed: instances or motion will place it. */
static int read_shape(struct builder *b, const struct scene_node *n, bool placed, struct shape_geometry *g,
		      uint64_t *dropped)
{
	liveness_tick();
	crash_set_context("building the scene", n->file, n->line);
	int rc = shape_build(n, b->assets, &b->scratch, g, dropped, b->e);
	if (!rc && g->kind == SHAPE_CURVE && needs_triangles(b, n, g, placed))
		rc = shape_curves_to_mesh(g, n, &b->scratch, dropped, b->e);
	if (rc || g->kind == SHAPE_CURVE || (g->kind == SHAPE_MESH && g->mesh.triangle_count == 0) ||
	    b->forced_effects.states[EFFECT_DISPLACEMENT] < 0)
		return rc;
	return displacement_apply(g, n, b->assets, b->scene->is_dialect_3, b->w->accuracy.tessellation, &b->scratch,
				  b->e);
}

/* Adds a shape to the counters. */
static int count_geometry(struct builder *b, const struct scene_node *n, const struct shape_geometry *g,
			  uint64_t dropped, struct shape_counts *counts)
{
	count_flat(counts, n, dropped, g->kind == SHAPE_MESH && g->mesh.triangle_count == 0);
	count_materials(counts, b, n, g);
	count_bad_normals(counts, n, g->mesh.invalid_normal_count);
	b->triangle_count += g->mesh.triangle_count + g->curve.chain_point_count;
	return b->triangle_count <= TRIANGLES_MAX
		       ? 0
		       : node_error(n, b->e, E2BIG, "with this shape, the scene has more than %d triangles",
				    TRIANGLES_MAX);
}

/* Finds the mesh that an instance shares; the first instance that needs it reads it. *out is NULL if the
 * instance is built on its own. */
static int find_shared_mesh(struct builder *b, const struct listed_shape *l, struct shared_mesh **meshes,
			    struct shape_counts *counts, struct shared_mesh **out)
{
	*out = NULL;
	if (!shared_mesh_is_allowed(b, l))
		return 0;
	struct shared_mesh *m = meshes[l->first_use];
	int rc = 0;
	if (!m) {
		uint64_t dropped = 0;
		m = meshes[l->first_use] = arena_alloc(&b->scratch, 1, sizeof *m);
		if (!m)
			return build_out_of_memory(b->e);
		rc = read_shape(b, l->node, true, &m->geometry, &dropped);
		if (!rc)
			shared_mesh_decide(m, l->animation != NULL);
		if (!rc && m->is_shared)
			rc = count_geometry(b, l->node, &m->geometry, dropped, counts);
	} else if (l->animation && !m->is_shared) { /* the instances before it do not move */
		shared_mesh_decide(m, true);
		if (m->is_shared)
			rc = count_geometry(b, l->node, &m->geometry, 0, counts);
	}
	*out = m->is_shared ? m : NULL;
	return rc;
}

/* Adds the next shape to the world, unless it has nothing to hit. */
static int read_listed_shape(struct builder *b, const struct listed_shape *l, struct shared_mesh **meshes,
			     struct shape_counts *counts)
{
	uint32_t id = b->w->shape_count;
	struct shape_geometry *g = &b->geometry[id];
	const struct scene_node *n = l->node;
	int rc = find_shared_mesh(b, l, meshes, counts, &b->shared_meshes[id]);
	if (!rc && b->shared_meshes[id]) {
		*g = b->shared_meshes[id]->geometry;
		rc = l->animation ? 0 : shared_mesh_box(b->shared_meshes[id], l->instance, &b->shape_boxes[id], b->e);
	} else if (!rc) {
		uint64_t dropped = 0;
		n = shape_placed_node(l, &b->scratch);
		rc = n ? read_shape(b, n, l->animation != NULL, g, &dropped) : build_out_of_memory(b->e);
		if (!rc)
			rc = count_geometry(b, n, g, dropped, counts);
		if (!rc && g->kind == SHAPE_MESH && g->mesh.triangle_count == 0) {
			b->has_dropped_emitter |= n->emits_light;
			return 0;
		}
		if (rc)
			return rc;
		b->shape_boxes[id] = build_bounding_box(g);
	}
	if (!rc && l->animation)
		rc = build_motion_begin(b, l, id,
					b->shared_meshes[id] ? b->shared_meshes[id]->box : b->shape_boxes[id]);
	if (rc)
		return rc;
	b->shape_nodes[id] = n;
	b->instances[id] = l->instance;
	box_grow(&b->scene_box, b->shape_boxes[id].min);
	box_grow(&b->scene_box, b->shape_boxes[id].max);
	b->w->shape_count++;
	return 0;
}

int build_read_shapes(struct builder *b)
{
	struct listed_shape *list;
	uint32_t list_count;
	struct arena *a = &b->scratch;
	int rc = shape_list_make(b->scene, b->w->settings.shutter_open, b->w->settings.shutter_close, a, b->report,
				 &list, &list_count, b->e);
	if (rc)
		return rc;
	struct shared_mesh **meshes = arena_alloc(a, list_count, sizeof(void *));
	b->geometry = arena_alloc(a, list_count, sizeof *b->geometry);
	b->shape_boxes = arena_alloc(a, list_count, sizeof *b->shape_boxes);
	b->shape_nodes = arena_alloc(a, list_count, sizeof(void *));
	b->shared_meshes = arena_alloc(a, list_count, sizeof(void *));
	b->instances = arena_alloc(a, list_count, sizeof(void *));
	b->motions = arena_alloc(a, list_count, sizeof(void *));
	if (!meshes || !b->geometry || !b->shape_boxes || !b->shape_nodes || !b->shared_meshes || !b->instances ||
	    !b->motions)
		return build_out_of_memory(b->e);
	b->scene_box = box_empty();
	struct shape_counts counts = {0};
	for (uint32_t i = 0; i < list_count; i++) /* shapes of one instance are adjacent */
		b->w->instance_count += list[i].instance && (i == 0 || list[i].instance != list[i - 1].instance);
	for (uint32_t i = 0; i < list_count && !rc; i++)
		if ((rc = read_listed_shape(b, &list[i], meshes, &counts)))
			rc = build_record_problem(b, rc);
	if (rc)
		return rc;
	note_flat(b->w, &counts);
	note_bad_normals(b->w, &counts);
	note_materials(b->w, &counts);
	crash_set_context("building the scene", NULL, 0);
	if (b->w->shape_count == 0)
		b->scene_box.min = b->scene_box.max = (vec3){0, 0, 0};
	return 0;
}

/* Points on a shape as large as the scene have errors of a few 2^-53 of its size. If the smallest shape
 * is a few thousand times as large as these errors, integrators agree; at 2^-44 of the scene's size, path
 * and bdpt differed by 2 %. */
#define RELATIVE_SIZE_MIN 0x1p-42

/* Whether p lies in the box, or not farther than `margin` from it along each axis. */
static bool is_in_box(const struct box *b, vec3 p, double margin)
{
	return p.x >= b->min.x - margin && p.x <= b->max.x + margin && p.y >= b->min.y - margin &&
	       p.y <= b->max.y + margin && p.z >= b->min.z - margin && p.z <= b->max.z + margin;
}

static void note_scales(struct builder *b)
{
	uint32_t small = 0, large = 0;
	char little[NODE_TITLE_MAX], big[NODE_TITLE_MAX];
	for (uint32_t i = 1; i < b->w->shape_count; i++) {
		if (box_extent(&b->shape_boxes[i]) < box_extent(&b->shape_boxes[small]))
			small = i;
		if (box_extent(&b->shape_boxes[i]) > box_extent(&b->shape_boxes[large]))
			large = i;
	}
	if (b->w->shape_count > 0 && box_extent(&b->shape_boxes[small]) < RELATIVE_SIZE_MIN * box_extent(&b->scene_box))
		snprintf(b->w->notes.small_shape, sizeof b->w->notes.small_shape,
			 "%s is too small for a scene with %s: double precision does not suffice for both, and its "
			 "image may be wrong",
			 node_title(b->shape_nodes[small], little), node_title(b->shape_nodes[large], big));
}

/* Whether a triangle lies at a distance of less than `limit` from p, but not at 0. */
static bool has_triangle_near(const struct mesh *m, vec3 p, double limit)
{
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		struct box box = box_empty();
		vec3 a = vec3_load(m->position[m->index[i][0]]), side[2];
		for (int k = 0; k < 3; k++)
			box_grow(&box, vec3_load(m->position[m->index[i][k]]));
		if (!is_in_box(&box, p, limit))
			continue;
		for (int k = 0; k < 2; k++)
			side[k] = vec3_sub(vec3_load(m->position[m->index[i][k + 1]]), a);
		double distance = fabs(vec3_dot(vec3_normalize(vec3_cross(side[0], side[1])), vec3_sub(p, a)));
		if (distance > 0 && distance < limit)
			return true;
	}
	return false;
}

/* Rays are traced in floats that start as far before the camera as errors of the scene's size demand, so that nearer
 * hits drown: a plane at 2^-46 of the scene's size vanished. Curves and instances are not looked at. */
static void note_shapes_near_camera(struct builder *b)
{
	struct world *w = b->w;
	vec3 eye = vec3_madd(w->center, 1 / w->scale, w->camera.position);
	double limit = RELATIVE_SIZE_MIN * box_extent(&b->scene_box);
	char title[NODE_TITLE_MAX];
	for (uint32_t i = 0; i < w->shape_count && !*w->notes.near_camera; i++) {
		const struct shape_geometry *g = &b->geometry[i];
		double distance = fabs(vec3_length(vec3_sub(eye, g->sphere.center)) - g->sphere.radius);
		bool is_near = g->kind == SHAPE_SPHERE ? distance > 0 && distance < limit
						       : g->kind == SHAPE_MESH && !b->shared_meshes[i] &&
								 is_in_box(&b->shape_boxes[i], eye, limit) &&
								 has_triangle_near(&g->mesh, eye, limit);
		if (is_near)
			snprintf(w->notes.near_camera, sizeof w->notes.near_camera,
				 "the camera is too near to %s for a scene as large as this: rays may miss it",
				 node_title(b->shape_nodes[i], title));
	}
}

int build_rescale(struct builder *b)
{
	struct world *w = b->w;
	struct weighted_value *scratch = arena_alloc(&b->scratch, w->shape_count, sizeof *scratch);
	if (!scratch)
		return build_out_of_memory(b->e);
	if (!isfinite(vec3_length(vec3_sub(b->scene_box.max, b->scene_box.min))))
		return error_set(b->e, EINVAL, "the scene's extent is not finite");
	note_scales(b);
	int rc = w->settings.is_unplaced ? scene_settings_place_sensor(&w->settings, b->scene->file, b->scene_box.min,
								       b->scene_box.max, b->e)
					 : 0;
	if (rc)
		return rc;
	w->center = world_origin_choose(&b->scene_box, b->shape_boxes, w->shape_count, scratch);
	vec3 above = vec3_sub(b->scene_box.max, w->center), below = vec3_sub(w->center, b->scene_box.min);
	double r = vec3_length((vec3){fmax(above.x, below.x), fmax(above.y, below.y), fmax(above.z, below.z)});
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
		note_shapes_near_camera(b);
	return rc ? rc : build_motion_set_camera(b);
}

/* ---- curves: their points are rounded to float, like the vertices of meshes, and shared by the cones on both sides,
 * so that a chain has no gaps; cones are computed from the points on demand. ---- */

static bool alloc_curves(struct curves *out, const struct curve *c, struct arena *a)
{
	uint32_t points = c->chain_point_count, cones = points - c->curve_count;
	out->is_open = c->is_spline;
	out->points = arena_alloc(a, points, sizeof *out->points);
	out->v = arena_alloc(a, points, sizeof *out->v);
	out->cone = arena_alloc(a, cones, sizeof *out->cone);
	out->u_start = arena_alloc(a, cones, sizeof *out->u_start);
	out->tangent = c->is_spline ? arena_alloc(a, points, sizeof *out->tangent) : NULL;
	return out->points && out->v && out->cone && out->u_start && (out->tangent || !c->is_spline);
}

static void add_curve_point(struct curves *out, const struct world *w, const struct chain_point *p)
{
	uint32_t i = out->point_count++;
	vec3 center = vec3_scale(w->scale, vec3_sub(p->center, w->center));
	float radius = (float)(w->scale * p->radius);
	out->points[i][0] = (float)center.x;
	out->points[i][1] = (float)center.y;
	out->points[i][2] = (float)center.z;
	out->points[i][3] = radius;
	out->v[i] = (float)p->v;
	out->max_radius = radius > out->max_radius ? radius : out->max_radius;
	if (!out->tangent)
		return;
	out->tangent[i][0] = (float)p->tangent.x;
	out->tangent[i][1] = (float)p->tangent.y;
	out->tangent[i][2] = (float)p->tangent.z;
}

static void add_curve_chain(struct curves *out, const struct world *w, const struct chain_point *p, size_t count)
{
	for (size_t k = 0; k < count; k++) {
		add_curve_point(out, w, &p[k]);
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
	struct list points = {.item_size = sizeof(struct chain_point)};
	int rc = out && alloc_curves(out, c, &b->w->arena) ? 0 : -ENOMEM;
	for (uint32_t i = 0; i < c->curve_count && !rc; i++) {
		rc = curve_make_chain(c, i, &points);
		if (!rc)
			add_curve_chain(out, b->w, points.items, points.count);
		liveness_tick();
	}
	list_fini(&points);
	if (rc)
		return build_out_of_memory(b->e);
	if (!(out->max_radius > 0)) /* no piece has a radius */
		return 0;
	curves_compute_u_starts(out);
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
	g->normal_sign = s->flips_normals ? -1 : 1;
	g->sphere_axes.s = vec3_normalize(mat4_vector(&s->to_world, (vec3){1, 0, 0}));
	g->sphere_axes.t = vec3_normalize(mat4_vector(&s->to_world, (vec3){0, 1, 0}));
	g->sphere_axes.n = vec3_normalize(mat4_vector(&s->to_world, (vec3){0, 0, 1}));
}

/* Places shape i. *is_empty: rounded to float, no part of the shape has an area. */
static int place_shape(struct builder *b, uint32_t i, double min_wide_extent, bool *is_empty)
{
	struct world *w = b->w;
	struct shape_geometry *geometry = &b->geometry[i];
	struct geom_shape *g = &w->shapes[i];
	*is_empty = false;
	if (b->shared_meshes[i])
		return shared_mesh_place(b, b->shared_meshes[i], b->instances[i], i);
	g->unit = w->scale;
	if (geometry->kind == SHAPE_SPHERE) {
		place_sphere(b, g, &geometry->sphere);
		return b->motions[i] ? build_motion_place_sphere(b, i) : 0;
	}
	if (geometry->kind == SHAPE_CURVE) {
		int rc = place_curves(b, g, &geometry->curve, b->shape_nodes[i]);
		*is_empty = !rc && !g->curves;
		return rc;
	}
	int rc = build_place_mesh(b, g, &geometry->mesh, b->shape_nodes[i], w->center, w->scale);
	*is_empty = !rc && g->triangle_count == 0;
	return rc || *is_empty ? rc : build_keep_unrounded(b, g, &geometry->mesh, min_wide_extent);
}

/* Moves all data of shape `from` to index `to` <= `from`. */
static void move_shape(struct builder *b, uint32_t from, uint32_t to)
{
	if (from == to)
		return;
	b->geometry[to] = b->geometry[from];
	b->shape_boxes[to] = b->shape_boxes[from];
	b->shape_nodes[to] = b->shape_nodes[from];
	b->shared_meshes[to] = b->shared_meshes[from];
	b->instances[to] = b->instances[from];
	b->motions[to] = b->motions[from];
}

static void note_tiny_shapes(struct world *w, uint32_t count, const struct scene_node *first)
{
	char title[NODE_TITLE_MAX];
	if (count)
		snprintf(w->notes.tiny_shapes, sizeof w->notes.tiny_shapes,
			 "%u shape%s too small for the scene to have an area %s left out (first: %s)", count,
			 count == 1 ? "" : "s", count == 1 ? "is" : "are", node_title(first, title));
}

int build_place_shapes(struct builder *b)
{
	struct world *w = b->w;
	w->shapes = arena_alloc(&w->arena, w->shape_count, sizeof *w->shapes);
	w->shape_bindings = arena_alloc(&w->arena, w->shape_count, sizeof *w->shape_bindings);
	if (!w->shapes || !w->shape_bindings)
		return build_out_of_memory(b->e);
	double min_wide_extent = w->scale * world_origin_min_wide_extent(&b->scene_box, b->shape_boxes, w->shape_count);
	uint32_t kept = 0;
	const struct scene_node *first_empty = NULL;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		bool is_empty;
		liveness_tick();
		move_shape(b, i, kept);
		int rc = place_shape(b, kept, min_wide_extent, &is_empty);
		if (rc)
			return rc;
		if (!is_empty) {
			kept++;
			continue;
		}
		b->has_dropped_emitter |= b->shape_nodes[kept]->emits_light;
		first_empty = first_empty ? first_empty : b->shape_nodes[kept];
		w->shapes[kept] = (struct geom_shape){0};
	}
	note_tiny_shapes(w, w->shape_count - kept, first_empty);
	w->shape_count = kept;
	return 0;
}
