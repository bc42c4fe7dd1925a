/* SPDX-License-Identifier: Apache-2.0 */
/*
 * read_shapes() makes geometry in double, rescale() moves the scene into the unit sphere, place_shapes() makes floats
 * of it, then BSDFs, emitters, camera, effects and what they leave out, and last Embree's structure. render_check stops
 * before Embree.
 *
 * Failures have the object's place and leave nothing behind: the world is one arena. Triangles without an area, shapes
 * too small beside others and surfaces that coincide are counted and said, not errors.
 */
#include "worker/render/world/world.h"

#include "common/base/crash.h"
#include "common/base/mem.h"
#include "common/base/liveness.h"
#include "worker/render/scene/asset_keeper.h"
#include "worker/render/shape/group.h"
#include "worker/render/shape/mesh.h"
#include "worker/render/texture/attribute_table.h"
#include "worker/render/texture/picture_cache.h"
#include "worker/render/world/coincident.h"
#include "worker/render/world/displacement.h"
#include "worker/render/world/origin.h"
#include "worker/render/world/visibility_bounds.h"

#include <stdio.h>
#include <string.h>

/* Of all shapes together: Embree takes about 150 bytes for each. */
enum { TRIANGLES_MAX = 1 << 28 };

/* What building needs and the world does not. */
struct builder {
	struct world *w;
	const struct scene *scene;
	const struct asset_source *assets;
	struct arena scratch;
	struct shape_geometry *geometry;
	const struct scene_node **shape_nodes, **bsdf_nodes, **emitter_nodes;
	struct effects_choice forced;
	struct attribute_pool attributes;
	struct emitter_surface *surfaces;
	struct box all, *boxes; /* boxes: one a shape */
	struct error *e;
};

static int out_of_memory(struct error *e)
{
	return error_set(e, ENOMEM, "out of memory while building the scene");
}

static struct box box_of(const struct shape_geometry *g)
{
	struct box b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
	if (g->kind == SHAPE_SPHERE) {
		vec3 r = {g->sphere.radius, g->sphere.radius, g->sphere.radius};
		return (struct box){vec3_sub(g->sphere.center, r), vec3_add(g->sphere.center, r)};
	}
	for (uint32_t i = 0; i < g->mesh.vertex_count; i++)
		box_grow(&b, (vec3){g->mesh.position[i][0], g->mesh.position[i][1], g->mesh.position[i][2]});
	return b;
}

static bool is_displaced(const struct builder *b, const struct scene_node *shape)
{
	return b->forced.of[EFFECT_DISPLACEMENT] >= 0 && displacement_of(shape);
}

/* Triangles without an area: nothing meets them, and they are left out. */
struct flat {
	uint64_t triangles;
	uint32_t shapes, empty; /* that have some; that have nothing else */
	const struct scene_node *first;
};

static void count_flat(struct flat *f, const struct scene_node *n, uint64_t triangles, bool empty)
{
	if (triangles && !f->first)
		f->first = n;
	f->triangles += triangles;
	f->shapes += triangles > 0;
	f->empty += empty;
}

static void note_flat(struct world *w, const struct flat *f)
{
	if (f->first)
		snprintf(
			w->flat, sizeof w->flat,
			"%llu triangles without an area are left out, in %u shapes (first: the %.24s in line %d); %u of these "
			"shapes have no others",
			(unsigned long long)f->triangles, f->shapes, f->first->type, f->first->line, f->empty);
}

/* Shapes of the scene, their geometry in double, and the box around them. A shape with nothing to meet is none. */
static int read_shapes(struct builder *b)
{
	const struct scene *s = b->scene;
	struct world *w = b->w;
	int rc = shape_list(s, &b->scratch, &b->shape_nodes, &w->shape_count, b->e);
	if (rc)
		return rc;
	b->geometry = arena_alloc(&b->scratch, w->shape_count, sizeof *b->geometry);
	b->boxes = arena_alloc(&b->scratch, w->shape_count, sizeof *b->boxes);
	if (!b->geometry || !b->boxes)
		return out_of_memory(b->e);
	b->all = (struct box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
	uint64_t triangles = 0;
	uint32_t listed = w->shape_count;
	struct flat flat = {0};
	w->shape_count = 0;
	for (uint32_t i = 0; i < listed; i++) {
		const struct scene_node *n = b->shape_nodes[i];
		struct shape_geometry *g = &b->geometry[w->shape_count];
		uint64_t dropped = 0;
		tick();
		crash_place("building the scene", n->file, n->line);
		rc = shape_build(n, b->assets, &b->scratch, g, &dropped, b->e);
		if (rc)
			return rc;
		bool empty = g->kind == SHAPE_MESH && g->mesh.triangle_count == 0;
		count_flat(&flat, n, dropped, empty);
		if (empty)
			continue;
		if (b->forced.of[EFFECT_DISPLACEMENT] >= 0)
			rc = displacement_apply(g, n, b->assets, s->dialect_3, w->accuracy.tessellation, &b->scratch,
						b->e);
		if (rc)
			return rc;
		triangles += g->mesh.triangle_count;
		if (triangles > TRIANGLES_MAX)
			return node_error(n, b->e, E2BIG, "the scene has more than %d triangles with it",
					  TRIANGLES_MAX);
		b->shape_nodes[w->shape_count] = n;
		b->boxes[w->shape_count] = box_of(g);
		box_grow(&b->all, b->boxes[w->shape_count].low);
		box_grow(&b->all, b->boxes[w->shape_count].high);
		w->shape_count++;
	}
	note_flat(w, &flat);
	crash_place("building the scene", NULL, 0);
	if (w->shape_count == 0)
		b->all.low = b->all.high = (vec3){0, 0, 0};
	return 0;
}

/* Points of a shape as large as the scene are off by a few 2^-53 of that. Where the smallest shape is a few thousand
 * times as large as these roundings integrators agree; at 2^-44 of the scene path and bdpt differed by 2 %. */
#define LEAST_SCALE 0x1p-42

static void note_scales(struct builder *b)
{
	uint32_t small = 0, large = 0;
	for (uint32_t i = 1; i < b->w->shape_count; i++) {
		if (box_extent(&b->boxes[i]) < box_extent(&b->boxes[small]))
			small = i;
		if (box_extent(&b->boxes[i]) > box_extent(&b->boxes[large]))
			large = i;
	}
	if (b->w->shape_count > 0 && box_extent(&b->boxes[small]) < LEAST_SCALE * box_extent(&b->all))
		snprintf(
			b->w->scales, sizeof b->w->scales,
			"the %.24s in line %d is so much smaller than the scene, with the %.24s in line %d, that numbers are too short for both: what is "
			"seen of it can be wrong",
			b->shape_nodes[small]->type, b->shape_nodes[small]->line, b->shape_nodes[large]->type,
			b->shape_nodes[large]->line);
}

static int rescale(struct builder *b)
{
	struct world *w = b->w;
	struct weighed *room = arena_alloc(&b->scratch, w->shape_count, sizeof *room);
	if (!room)
		return out_of_memory(b->e);
	if (!isfinite(vec3_length(vec3_sub(b->all.high, b->all.low))))
		return error_set(b->e, EINVAL, "the scene's extent is not finite");
	note_scales(b);
	w->center = origin_choose(&b->all, b->boxes, w->shape_count, room);
	vec3 over = vec3_sub(b->all.high, w->center), under = vec3_sub(w->center, b->all.low);
	double r = vec3_length((vec3){fmax(over.x, under.x), fmax(over.y, under.y), fmax(over.z, under.z)});
	int exponent = 0;
	if (r > 0)
		frexp(r, &exponent);
	w->scale = ldexp(1, -exponent);
	/* Rounding to float moves vertices by parts in 2^24: the sphere is to hold them all the same. */
	w->radius = (r > 0 ? r * w->scale : 1) * (1 + 0x1p-20);
	int rc = camera_init(&w->camera, &w->settings, w->center, w->scale, b->e);
	for (uint32_t i = 0; rc && i < b->scene->object_count; i++) {
		const struct scene_node *n = b->scene->objects[i];
		if (n->cls == PLUGIN_SENSOR)
			return error_prefix(b->e, rc, "%s:%d: <sensor>", n->file, n->line);
	}
	return rc;
}

static vec3 to_world_space(const struct world *w, const double p[3])
{
	return vec3_scale(w->scale, vec3_sub((vec3){p[0], p[1], p[2]}, w->center));
}

static vec3 float3(const float p[3])
{
	return (vec3){(double)p[0], (double)p[1], (double)p[2]};
}

static void put_float3(float out[3], vec3 v)
{
	out[0] = (float)v.x;
	out[1] = (float)v.y;
	out[2] = (float)v.z;
}

/* Keeps the triangles that still have an area in float, wound so that their normal agrees with the vertex normals.
 * Those of a displaced shape are left as they are: where one overhangs, its outside is still its neighbours'. */
static uint32_t take_triangles(struct geom_shape *g, struct mesh *m, bool displaced)
{
	uint32_t kept = 0;
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		const uint32_t *t = m->index[i];
		vec3 v0 = float3(g->position[t[0]]);
		vec3 n = vec3_cross(vec3_sub(float3(g->position[t[1]]), v0), vec3_sub(float3(g->position[t[2]]), v0));
		if (!(vec3_dot(n, n) > 0))
			continue;
		bool turn = false;
		if (g->normal && !displaced) {
			vec3 sum = vec3_add(float3(g->normal[t[0]]),
					    vec3_add(float3(g->normal[t[1]]), float3(g->normal[t[2]])));
			turn = vec3_dot(sum, n) < 0;
		}
		mesh_move_face(m, i, kept);
		g->index[kept][0] = t[0];
		g->index[kept][1] = t[turn ? 2 : 1];
		g->index[kept++][2] = t[turn ? 1 : 2];
	}
	return kept;
}

static int place_mesh(struct builder *b, struct geom_shape *g, struct mesh *m, const struct scene_node *n)
{
	struct arena *arena = &b->w->arena;
	uint32_t vertices = m->vertex_count;
	g->vertex_count = vertices;
	/* One vertex more than there are: Embree reads 16 bytes from the start of each. */
	g->position = arena_alloc(arena, (size_t)vertices + 1, sizeof *g->position);
	g->index = arena_alloc(arena, m->triangle_count, sizeof *g->index);
	g->normal = m->normal ? arena_alloc(arena, vertices, sizeof *g->normal) : NULL;
	g->uv = m->uv ? arena_alloc(arena, vertices, sizeof *g->uv) : NULL;
	if (!g->position || !g->index || (m->normal && !g->normal) || (m->uv && !g->uv))
		return out_of_memory(b->e);
	for (uint32_t i = 0; i < vertices; i++) {
		put_float3(g->position[i], to_world_space(b->w, m->position[i]));
		if (g->normal)
			put_float3(g->normal[i], (vec3){m->normal[i][0], m->normal[i][1], m->normal[i][2]});
		if (g->uv) {
			g->uv[i][0] = (float)m->uv[i][0];
			g->uv[i][1] = (float)m->uv[i][1];
		}
	}
	g->triangle_count = take_triangles(g, m, is_displaced(b, n));
	if (g->triangle_count == 0)
		return node_error(n, b->e, EINVAL, "no triangle of this shape has an area at the scene's scale");
	return 0;
}

static int place_shapes(struct builder *b)
{
	struct world *w = b->w;
	w->shapes = arena_alloc(&w->arena, w->shape_count, sizeof *w->shapes);
	w->parts = arena_alloc(&w->arena, w->shape_count, sizeof *w->parts);
	if (!w->shapes || !w->parts)
		return out_of_memory(b->e);
	for (uint32_t i = 0; i < w->shape_count; i++) {
		struct shape_geometry *from = &b->geometry[i];
		struct geom_shape *g = &w->shapes[i];
		tick();
		g->unit = w->scale;
		if (from->kind == SHAPE_SPHERE) {
			const struct sphere *s = &from->sphere;
			g->is_sphere = true;
			g->center = vec3_scale(w->scale, vec3_sub(s->center, w->center));
			g->radius = w->scale * s->radius;
			g->normal_sign = s->flip_normals ? -1 : 1;
			g->sphere_axes.s = vec3_normalize(mat4_vector(&s->to_world, (vec3){1, 0, 0}));
			g->sphere_axes.t = vec3_normalize(mat4_vector(&s->to_world, (vec3){0, 1, 0}));
			g->sphere_axes.n = vec3_normalize(mat4_vector(&s->to_world, (vec3){0, 0, 1}));
			continue;
		}
		int rc = place_mesh(b, g, &from->mesh, b->shape_nodes[i]);
		if (rc)
			return rc;
	}
	return 0;
}

static struct attribute_table attributes_of(struct builder *b, uint32_t shape)
{
	const struct shape_geometry *from = &b->geometry[shape];
	const struct geom_shape *g = &b->w->shapes[shape];
	struct attribute_table t = {.shape = b->shape_nodes[shape], .pool = &b->attributes};
	if (from->kind == SHAPE_MESH) {
		t.vertex_count = g->vertex_count;
		t.triangle_count = g->triangle_count;
		t.index = (const uint32_t(*)[3])g->index;
		t.count = from->mesh.attribute_count;
		t.attributes = from->mesh.attributes;
	}
	return t;
}

/* One BSDF a node, however many shapes refer to it, unless it looks at the shape's attributes: then one a shape. A
 * shape that names none is grey, or black where it shines. */
static int create_bsdfs(struct builder *b)
{
	struct world *w = b->w;
	/* One more for what no path meets. */
	w->bsdfs = arena_alloc(&w->arena, (size_t)w->shape_count + 1, sizeof *w->bsdfs);
	b->bsdf_nodes = arena_alloc(&b->scratch, w->shape_count, sizeof(void *));
	bool *of_one_shape = arena_alloc(&b->scratch, w->shape_count, sizeof *of_one_shape);
	if (!w->bsdfs || !b->bsdf_nodes || !of_one_shape)
		return out_of_memory(b->e);
	struct bsdf_build build = {b->assets, &w->arena, b->scene->dialect_3, w->accuracy.roughness, NULL};
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct scene_node *n = node_child(b->shape_nodes[i], PLUGIN_BSDF, 0);
		const struct scene_node *light = node_child(b->shape_nodes[i], PLUGIN_EMITTER, 0), *key = n ? n : light;
		uint32_t k = 0;
		while (k < w->bsdf_count && (b->bsdf_nodes[k] != key || of_one_shape[k]))
			k++;
		w->parts[i].bsdf = k;
		if (k < w->bsdf_count) {
			w->shapes[i].relief = w->bsdfs[k].relief;
			continue;
		}
		b->bsdf_nodes[k] = key;
		w->bsdf_count++;
		struct attribute_table attributes = attributes_of(b, i);
		build.attributes = &attributes;
		int rc = 0;
		if (n)
			rc = bsdf_create(&w->bsdfs[k], n, &build, b->e);
		else if (light)
			bsdf_black(&w->bsdfs[k]);
		else
			bsdf_default(&w->bsdfs[k]);
		if (!rc)
			rc = bsdf_mirror_back(&w->bsdfs[k], &w->arena, b->e);
		if (rc)
			return rc;
		of_one_shape[k] = attributes.asked;
		w->shapes[i].relief = w->bsdfs[k].relief;
	}
	return 0;
}

static struct emitter_surface emitter_surface_of(const struct geom_shape *g)
{
	return (struct emitter_surface){
		.is_sphere = g->is_sphere,
		.center = g->center,
		.radius = g->radius,
		.normal_sign = g->normal_sign,
		.sphere_axes = g->sphere_axes,
		.triangle_count = g->triangle_count,
		.position = (const float(*)[3])g->position,
		.index = (const uint32_t(*)[3])g->index,
		.uv = (const float(*)[2])g->uv,
	};
}

static int power_error(const struct scene_node *n, struct error *e)
{
	return node_error(n, e, ERANGE, "its power is not finite");
}

static int create_emitters(struct builder *b)
{
	struct world *w = b->w;
	const struct scene *s = b->scene;
	uint32_t limit = w->shape_count + s->object_count;
	w->emitters = arena_alloc(&w->arena, limit, sizeof *w->emitters);
	w->emitter_shape = arena_alloc(&w->arena, limit, sizeof *w->emitter_shape);
	b->emitter_nodes = arena_alloc(&b->scratch, limit, sizeof(void *));
	if (!w->emitters || !w->emitter_shape || !b->emitter_nodes)
		return out_of_memory(b->e);
	struct emitter_build build = {b->assets, &w->arena, s->dialect_3, NULL, NULL, w->center, w->scale};
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct scene_node *n = node_child(b->shape_nodes[i], PLUGIN_EMITTER, 0);
		w->parts[i].emitter = -1;
		if (!n)
			continue;
		struct emitter_surface surface = emitter_surface_of(&w->shapes[i]);
		struct attribute_table attributes = attributes_of(b, i);
		build.surface = &surface;
		build.attributes = &attributes;
		int rc = emitter_create(&w->emitters[w->emitter_count], n, &build, b->e);
		if (rc)
			return rc;
		if (!isfinite(w->emitters[w->emitter_count].power))
			return power_error(n, b->e);
		w->emitter_shape[w->emitter_count] = i;
		b->emitter_nodes[w->emitter_count] = n;
		w->parts[i].emitter = (int32_t)w->emitter_count++;
	}
	w->environment = -1;
	build.surface = NULL;
	build.attributes = NULL;
	for (uint32_t i = 0; i < s->object_count; i++) {
		const struct scene_node *n = s->objects[i];
		/* An area emitter that stands by itself is there for shapes to refer to. */
		if (n->cls != PLUGIN_EMITTER || (n->id && emitter_needs_surface(n)))
			continue;
		struct emitter *em = &w->emitters[w->emitter_count];
		int rc = emitter_create(em, n, &build, b->e);
		if (rc)
			return rc;
		bool environment = em->infinite && !em->delta;
		if (environment && w->environment >= 0)
			return node_error(n, b->e, EINVAL, "a second environment: one is supported");
		if (em->infinite)
			em->power *= M_PI * w->radius * w->radius;
		if (!isfinite(em->power))
			return power_error(n, b->e);
		if (environment)
			w->environment = (int32_t)w->emitter_count;
		b->emitter_nodes[w->emitter_count] = n;
		w->emitter_shape[w->emitter_count++] = UINT32_MAX;
	}
	return 0;
}

static int choose_emitters(struct builder *b)
{
	struct world *w = b->w;
	w->emitter_pdf = arena_alloc(&w->arena, (size_t)w->emitter_count + 1, sizeof(double));
	w->emitter_cdf = arena_alloc(&w->arena, (size_t)w->emitter_count + 1, sizeof(double));
	if (!w->emitter_pdf || !w->emitter_cdf)
		return out_of_memory(b->e);
	double total = 0;
	for (uint32_t i = 0; i < w->emitter_count; i++)
		total += w->emitters[i].power;
	if (!isfinite(total))
		return error_set(b->e, EINVAL, "the emitters' power is not finite");
	for (uint32_t i = 0; i < w->emitter_count && total > 0; i++) {
		w->emitter_pdf[i] = w->emitters[i].power / total;
		w->emitter_cdf[i + 1] = w->emitter_cdf[i] + w->emitter_pdf[i];
	}
	return 0;
}

/* The colour that the grey value 1 stands for: the common illuminant's, as an emitter of rgb 1 or of a constant 1 has
 * it. By the midpoint rule; the density with which wavelengths are drawn cancels. */
static void set_grey(struct world *w)
{
	for (int i = 0; i < 3; i++)
		w->grey_xyz[i] = 0;
	int samples = 4700;
	double range = WAVELENGTH_MAX - WAVELENGTH_MIN;
	for (int i = 0; i < samples; i++) {
		struct wavelengths wl = {.grey = false};
		double nm = WAVELENGTH_MIN + (i + 0.5) * range / samples;
		for (int k = 0; k < SPECTRUM_LANES; k++)
			wl.nm[k] = nm;
		double xyz[3], l = w->effects.illuminant == COLOR_SHAPE_D65 ? color_d65(nm) : 1;
		spectrum_to_xyz(spectrum_of(l * wavelength_pdf(nm) * range), &wl, xyz);
		for (int k = 0; k < 3; k++)
			w->grey_xyz[k] += xyz[k] / samples;
	}
}

static int build_accel(struct builder *b)
{
	struct world *w = b->w;
	/* The meshes as they were read are half as large as what Embree is about to need. */
	arena_fini(&b->scratch);
	struct accel_shape *s = coincident_shapes(w, &b->scratch);
	if (!s)
		return out_of_memory(b->e);
	return accel_new(&w->accel, s, w->shape_count, w->coincidence, b->e);
}

static int find_coincidence(struct builder *b)
{
	struct accel_shape *s = coincident_shapes(b->w, &b->scratch);
	return s ? coincident_find(b->w, b->shape_nodes, s, b->e) : out_of_memory(b->e);
}

static int find_effects(struct builder *b, uint32_t max_depth)
{
	struct world *w = b->w;
	enum visibility_bounds *reached = arena_alloc(&b->scratch, w->shape_count, sizeof *reached);
	struct weighed *room = arena_alloc(&b->scratch, w->shape_count, sizeof *room);
	if (!reached || !room)
		return out_of_memory(b->e);
	const struct effects_source src = {b->scene,  b->shape_nodes, b->bsdf_nodes, b->emitter_nodes,
					   max_depth, b->boxes,	      room};
	effects_analyse(w, &src, &b->forced, reached);
	return effects_apply(w, &b->forced, reached, b->e);
}

/* All but Embree: every effect is known before that is built. */
static int prepare(struct builder *b, const struct render_options *o)
{
	int rc = effects_parse(o ? o->effects : "", &b->forced, b->e);
	if (!rc)
		rc = accuracy_settings_read(o ? o->accuracy : NULL, &b->w->accuracy, b->e);
	if (!rc)
		rc = scene_settings_read(b->scene, o ? o->width : 0, o ? o->height : 0, (uint32_t)b->w->accuracy.sensor,
					 &b->w->settings, b->e);
	if (!rc)
		rc = read_shapes(b);
	if (!rc)
		rc = rescale(b);
	if (!rc)
		rc = place_shapes(b);
	if (!rc)
		rc = create_bsdfs(b);
	if (!rc)
		rc = create_emitters(b);
	if (!rc)
		rc = find_coincidence(b);
	if (!rc)
		rc = find_effects(b, o ? o->max_depth : 0);
	if (!rc)
		rc = choose_emitters(b);
	if (!rc && !b->w->effects.colour)
		set_grey(b->w);
	return rc;
}

static int new_world(struct world **out, bool with_accel, const struct scene *s, const struct asset_source *assets,
		     const struct render_options *o, struct error *e)
{
	*out = NULL;
	struct asset_keeper keeper = {.inner = assets};
	struct asset_source kept = asset_keeper_source(&keeper);
	struct builder b = {.scene = s, .assets = &kept, .e = e, .w = mem_alloc(1, sizeof *b.w)};
	if (!b.w)
		return out_of_memory(e);
	struct picture_cache decoded = {.arena = &b.w->arena};
	kept.decoded = &decoded;
	crash_place("building the scene", NULL, 0);
	int rc = prepare(&b, o);
	asset_keeper_fini(&keeper);
	crash_place("building Embree's tree", NULL, 0);
	if (!rc && with_accel)
		rc = build_accel(&b);
	crash_place(NULL, NULL, 0);
	arena_fini(&b.scratch);
	if (rc)
		world_free(b.w);
	else
		*out = b.w;
	return rc;
}

int world_new(struct world **out, const struct scene *s, const struct asset_source *assets,
	      const struct render_options *o, struct error *e)
{
	return new_world(out, true, s, assets, o, e);
}

int render_check(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		 struct render_summary *out, struct error *e)
{
	struct world *w;
	int rc = new_world(&w, false, s, assets, o, e);
	if (!rc)
		world_summary(w, out);
	world_free(w);
	return rc;
}
