/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Builds a world in the order of build_all_but_accel(): settings; geometry in double, moved into the unit sphere and
 * rounded to float (geometry.c); BSDFs, media and emitters; effects and what they make unnecessary. Last comes Embree's
 * tree, which world_check does not build for large scenes.
 *
 * Errors name the object's place in the scene file and leave nothing behind, because the world is one arena. Coinciding
 * surfaces are reported as notes, not errors.
 */
#include "worker/render/world/build.h"

#include "common/base/crash.h"
#include "common/base/mem.h"
#include "worker/render/bsdf/diffuse.h"
#include "worker/render/bsdf/twosided.h"
#include "worker/render/geom/curves.h"
#include "worker/render/asset/asset_keeper.h"
#include "worker/render/shape/obj_read.h"
#include "worker/render/texture/picture_cache.h"
#include "worker/render/world/build_media.h"
#include "worker/render/world/build_coincidence.h"
#include "worker/render/world/effects_analyse.h"
#include "worker/render/world/effects_apply.h"
#include "worker/render/world/effects_text.h"
#include "worker/render/world/emitter_choice.h"
#include "worker/render/world/geometry.h"
#include "worker/render/world/build_motion.h"
#include "worker/render/world/node_table.h"
#include "worker/render/world/refracting.h"
#include "worker/render/world/smooth_tangents.h"
#include "worker/render/world/visibility_notes.h"
#include "worker/render/world/visibility_bounds.h"

#include <string.h>

/* Bytes that Embree needs per triangle, per segment of a curve, and per shape, including the data of accel.c. */
enum { EMBREE_TRIANGLE_BYTES = 150, EMBREE_SEGMENT_BYTES = 140, EMBREE_SHAPE_BYTES = 320 };

static struct attribute_table make_attribute_table(struct builder *b, uint32_t shape)
{
	const struct shape_geometry *geometry = &b->geometry[shape];
	const struct geom_shape *g = &b->w->shapes[shape];
	struct attribute_table t = {.shape = b->shape_nodes[shape], .pool = &b->attributes};
	if (geometry->kind == SHAPE_MESH) {
		t.vertex_count = g->vertex_count;
		t.triangle_count = g->triangle_count;
		t.index = (const uint32_t(*)[3])g->index;
		t.position = (const float(*)[3])g->position;
		t.unrounded = (const double(*)[3])g->unrounded;
		t.count = geometry->mesh.attribute_count;
		t.attributes = geometry->mesh.attributes;
		const vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
		for (int k = 0; k < 3; k++)
			t.axis[k] = vec3_scale(1 / g->unit,
					       g->placement ? placement_vector(g->placement, axis[k]) : axis[k]);
	}
	return t;
}

static bool backs_are_black(const struct builder *b)
{
	double backs = b->w->accuracy.backs;
	return backs > SETTING_BACKS_AUTO ? backs > SETTING_BACKS_LIT : b->scene->has_black_backs;
}

/* In Mitsuba 0.6 a shape that bounds a medium and has no BSDF lets light through: makes the node of a `null` for it. */
static const struct scene_node *make_null_bsdf_node(struct builder *b, const struct scene_node *shape)
{
	struct scene_node *n = arena_alloc(&b->scratch, 1, sizeof *n);
	if (n)
		*n = (struct scene_node){.cls = PLUGIN_BSDF, .type = "null", .file = shape->file, .line = shape->line};
	return n;
}

static void set_volumes(struct builder *b)
{
	b->volumes = (struct volume_build){.assets = b->assets,
					   .arena = &b->w->arena,
					   .cache = &b->grids,
					   .is_dialect_3 = b->scene->is_dialect_3,
					   .world_center = b->w->center,
					   .world_scale = b->w->scale};
}

/* Uses BSDF number `bsdf` for a shape. There is one BSDF per node, however many shapes refer to it, unless it
 * uses the shape's attributes: then there is one per mesh, which instances share, or one per shape if it shows edges.
 * The default is grey; black for emitters; and, in 0.6, `null` for shapes that bound media. */
static void set_bsdf(struct world *w, uint32_t shape, uint32_t bsdf)
{
	struct geom_shape *g = &w->shapes[shape];
	w->shape_bindings[shape].bsdf = bsdf;
	g->relief = w->bsdfs[bsdf].relief;
	g->culls_backfaces = g->curves && g->normal_sign > 0 && w->bsdfs[bsdf].culls_backfaces;
}

static int create_bsdfs(struct builder *b)
{
	struct world *w = b->w;
	/* One more BSDF is for shapes that no path meets. */
	w->bsdfs = arena_alloc(&w->arena, (size_t)w->shape_count + 1, sizeof *w->bsdfs);
	b->bsdf_nodes = arena_alloc(&b->scratch, w->shape_count, sizeof(void *));
	struct node_table numbers; /* meshes are identified by their index arrays */
	if (!w->bsdfs || !b->bsdf_nodes || node_table_init(&numbers, w->shape_count, &b->scratch))
		return build_out_of_memory(b->e);
	struct boundary_table *boundaries = NULL;
	const struct scene_node *null = NULL;
	struct bsdf_build build = {.assets = b->assets,
				   .arena = &w->arena,
				   .is_dialect_3 = b->scene->is_dialect_3,
				   .min_roughness = w->accuracy.roughness,
				   .has_black_backs = backs_are_black(b),
				   .volumes = &b->volumes,
				   .boundary_tables = &boundaries};
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct scene_node *shape = b->shape_nodes[i], *n = node_child(shape, PLUGIN_BSDF, 0),
					*light = node_child(shape, PLUGIN_EMITTER, 0);
		if (!n && !light && !b->scene->is_dialect_3 &&
		    (node_ref(shape, "interior") || node_ref(shape, "exterior"))) {
			null = null ? null : make_null_bsdf_node(b, shape);
			if (!null)
				return build_out_of_memory(b->e);
			n = null;
		}
		const struct scene_node *key = n ? n : light;
		uint32_t k;
		if (node_table_find(&numbers, key, NULL, &k) ||
		    (w->shapes[i].index && node_table_find(&numbers, key, w->shapes[i].index, &k))) {
			set_bsdf(w, i, k);
			continue;
		}
		k = w->bsdf_count++;
		b->bsdf_nodes[k] = key;
		struct attribute_table attributes = make_attribute_table(b, i);
		struct relief_map *bends = NULL;
		build.attributes = &attributes;
		build.relief_maps = &bends;
		int rc = 0;
		if (n)
			rc = bsdf_create(&w->bsdfs[k], n, &build, b->e);
		else if (light)
			bsdf_make_black(&w->bsdfs[k]);
		else
			bsdf_make_default(&w->bsdfs[k]);
		if (!rc)
			rc = bsdf_mirror_back(&w->bsdfs[k], &build, b->e);
		if (rc && (rc = build_record_problem(b, rc)))
			return rc;
		if (attributes.probes_per_triangle != TRIANGLE_PROBES_EDGES)
			node_table_add(&numbers, key, attributes.probes_per_triangle ? w->shapes[i].index : NULL, k);
		set_bsdf(w, i, k);
	}
	return 0;
}

static struct emitter_surface make_emitter_surface(const struct geom_shape *g)
{
	return (struct emitter_surface){
		.is_sphere = g->is_sphere,
		.center = g->center,
		.radius = g->radius,
		.normal_sign = g->normal_sign,
		.sphere_axes = g->sphere_axes,
		.triangle_count = g->triangle_count,
		.position = (const float(*)[3])g->position,
		.unrounded = (const double(*)[3])g->unrounded,
		.index = (const uint32_t(*)[3])g->index,
		.uv = (const float(*)[2])g->uv,
		.motion = surface_is_moving(g) ? &g->placement->movement->motion : NULL,
	};
}

static int power_error(const struct scene_node *n, struct error *e)
{
	return node_error(n, e, ERANGE, "its power is not finite");
}

static struct emitter_build make_emitter_build(const struct builder *b)
{
	struct world *w = b->w;
	return (struct emitter_build){.assets = b->assets,
				      .arena = &w->arena,
				      .is_dialect_3 = b->scene->is_dialect_3,
				      .world_center = w->center,
				      .world_scale = w->scale,
				      .volumes = &b->volumes,
				      .shutter_open = w->settings.shutter_open,
				      .shutter_close = w->settings.shutter_close};
}

static int create_emitters(struct builder *b)
{
	struct world *w = b->w;
	const struct scene *s = b->scene;
	uint32_t limit = w->shape_count + s->object_count;
	w->emitters = arena_alloc(&w->arena, limit, sizeof *w->emitters);
	w->emitter_shapes = arena_alloc(&w->arena, limit, sizeof *w->emitter_shapes);
	b->emitter_nodes = arena_alloc(&b->scratch, limit, sizeof(void *));
	if (!w->emitters || !w->emitter_shapes || !b->emitter_nodes)
		return build_out_of_memory(b->e);
	struct emitter_build build = make_emitter_build(b);
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct scene_node *n = node_child(b->shape_nodes[i], PLUGIN_EMITTER, 0);
		w->shape_bindings[i].emitter = -1;
		if (!n || emitter_is_volumetric(n))
			continue;
		struct emitter_surface surface = make_emitter_surface(&w->shapes[i]);
		struct attribute_table attributes = make_attribute_table(b, i);
		build.surface = &surface;
		build.attributes = &attributes;
		int rc = emitter_create(&w->emitters[w->emitter_count], n, &build, b->e);
		if (!rc && !isfinite(w->emitters[w->emitter_count].power))
			rc = power_error(n, b->e);
		if (rc && (rc = build_record_problem(b, rc)))
			return rc;
		w->emitter_shapes[w->emitter_count] = i;
		b->emitter_nodes[w->emitter_count] = n;
		w->shape_bindings[i].emitter = (int32_t)w->emitter_count++;
	}
	w->environment = -1;
	build.surface = NULL;
	build.attributes = NULL;
	for (uint32_t i = 0; i < s->object_count; i++) {
		const struct scene_node *n = s->objects[i];
		/* An area emitter outside of shapes exists only for shapes to refer to. */
		if (n->cls != PLUGIN_EMITTER || (n->id && emitter_needs_surface(n)))
			continue;
		struct emitter *em = &w->emitters[w->emitter_count];
		int rc = emitter_create(em, n, &build, b->e);
		bool environment = em->is_infinite && !em->is_delta;
		if (!rc && environment && w->environment >= 0)
			rc = node_error(n, b->e, EINVAL,
					"a scene may have one environment only; remove this one or the one before");
		if (!rc) {
			rc = build_motion_set_emitter(b, em, n);
		}
		if (em->is_infinite)
			em->power *= M_PI * w->radius * w->radius;
		if (!rc && !isfinite(em->power))
			rc = power_error(n, b->e);
		if (rc && (rc = build_record_problem(b, rc)))
			return rc;
		if (environment)
			w->environment = (int32_t)w->emitter_count;
		b->emitter_nodes[w->emitter_count] = n;
		w->emitter_shapes[w->emitter_count++] = UINT32_MAX;
	}
	return 0;
}

static int compute_emitter_probabilities(struct builder *b)
{
	struct world *w = b->w;
	w->emitter_pdf = arena_alloc(&w->arena, (size_t)w->emitter_count + 1, sizeof(double));
	w->emitter_cdf = arena_alloc(&w->arena, (size_t)w->emitter_count + 1, sizeof(double));
	if (!w->emitter_pdf || !w->emitter_cdf)
		return build_out_of_memory(b->e);
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

/* Computes the colour of the grey value 1: that of the emitters' common spectrum, as for an emitter with rgb 1 or a
 * constant spectrum 1. Uses the midpoint rule; the density with which wavelengths are drawn cancels. */
static void compute_grey_xyz(struct world *w)
{
	for (int i = 0; i < 3; i++)
		w->grey_xyz[i] = 0;
	int samples = 4700;
	double range = WAVELENGTH_MAX - WAVELENGTH_MIN;
	for (int i = 0; i < samples; i++) {
		struct wavelengths wl = {.is_grey = false};
		double nm = WAVELENGTH_MIN + (i + 0.5) * range / samples;
		for (int k = 0; k < SPECTRUM_LANES; k++)
			wl.nm[k] = nm;
		double xyz[3], l = w->effects.illuminant == COLOR_KIND_D65 ? color_d65(nm) : 1;
		spectrum_to_xyz(spectrum_constant(l * wavelength_pdf(nm) * range), &wl, xyz);
		for (int k = 0; k < 3; k++)
			w->grey_xyz[k] += xyz[k] / samples;
	}
}

static int build_accel(struct builder *b)
{
	struct world *w = b->w;
	/* The meshes as they were read take half of the memory that Embree is about to need, so they are freed
	 * first. */
	arena_fini(&b->scratch);
	struct accel_shape *s = build_coincidence_make_shapes(w, &b->scratch);
	if (!s)
		return build_out_of_memory(b->e);
	return accel_new(&w->accel, s, w->shape_count, w->coincidence, b->e);
}

static int find_coincidence(struct builder *b)
{
	struct accel_shape *s = build_coincidence_make_shapes(b->w, &b->scratch);
	return s ? build_coincidence_find(b->w, b->shape_nodes, s, b->e) : build_out_of_memory(b->e);
}

/* Adds the box of shape i, converted to world lengths. It is slightly enlarged because the shape was rounded to
 * floats. */
static void add_shape_to_box(const struct builder *b, uint32_t i, struct box *box)
{
	const struct world *w = b->w;
	const double slack = 0x1p-16 * w->radius;
	for (int side = 0; side < 2; side++) {
		double offset = side ? slack : -slack;
		vec3 p = side ? b->shape_boxes[i].max : b->shape_boxes[i].min;
		box_grow(box, vec3_add(vec3_scale(w->scale, vec3_sub(p, w->center)), (vec3){offset, offset, offset}));
	}
}

/* Computes w->see_through_bounds and w->refracting_bounds. */
static void compute_shadow_bounds(struct builder *b)
{
	struct world *w = b->w;
	w->see_through_bounds = w->refracting_bounds = box_empty();
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct bsdf *bsdf = &w->bsdfs[w->shape_bindings[i].bsdf];
		if (w->effects.transparent_shadows && bsdf_passes_connections(bsdf))
			add_shape_to_box(b, i, &w->see_through_bounds);
		if (w->effects.refracted_shadows && bsdf_refracts_connections(bsdf))
			add_shape_to_box(b, i, &w->refracting_bounds);
	}
}

static int find_effects(struct builder *b, uint32_t max_depth)
{
	struct world *w = b->w;
	enum visibility *visibility = arena_alloc(&b->scratch, w->shape_count, sizeof *visibility);
	struct weighted_value *scratch = arena_alloc(&b->scratch, w->shape_count, sizeof *scratch);
	struct bsdf_visibility *bsdf_visibility = arena_alloc(&b->scratch, w->bsdf_count, sizeof *bsdf_visibility);
	if (!visibility || !scratch || !bsdf_visibility)
		return build_out_of_memory(b->e);
	const struct effects_source src = {.scene = b->scene,
					   .shape_nodes = b->shape_nodes,
					   .bsdf_nodes = b->bsdf_nodes,
					   .emitter_nodes = b->emitter_nodes,
					   .sensor = scene_sensor(b->scene, (uint32_t)w->accuracy.sensor),
					   .max_depth = max_depth,
					   .boxes = b->shape_boxes,
					   .scratch = scratch,
					   .bsdf_visibility = bsdf_visibility};
	effects_analyse(w, &src, &b->forced_effects, visibility);
	int rc = effects_apply(w, &b->forced_effects, visibility, b->e);
	if (rc)
		return rc;
	compute_shadow_bounds(b);
	return w->effects.refracted_shadows && refracting_points_make(w) < 0 ? build_out_of_memory(b->e) : 0;
}

/* Builds everything except Embree's tree, before which all effects must be known. */
static int build_all_but_accel(struct builder *b, const struct render_options *o)
{
	int rc = effects_parse(o ? o->effects : "", &b->forced_effects, b->e);
	if (!rc)
		rc = accuracy_settings_read(o ? o->accuracy : NULL, &b->w->accuracy, b->e);
	if (!rc && b->w->accuracy.colour > 0 &&
	    (b->forced_effects.states[EFFECT_WAVELENGTH] > 0 || b->forced_effects.states[EFFECT_DISPERSION] > 0))
		rc = error_set(b->e, EINVAL,
			       "effects: `wavelength` and `dispersion` need spectra, and colours are rgb");
	if (!rc)
		rc = scene_settings_read(b->scene, o ? o->width : 0, o ? o->height : 0, (uint32_t)b->w->accuracy.sensor,
					 &b->w->settings, b->e);
	if (!rc)
		rc = build_read_shapes(b);
	if (!rc)
		rc = build_rescale(b);
	if (!rc)
		rc = build_place_shapes(b);
	set_volumes(b);
	if (!rc)
		rc = create_bsdfs(b);
	if (!rc)
		rc = build_media(b);
	if (!rc)
		rc = create_emitters(b);
	if (b->report && b->report->problem_count)
		return rc;
	if (!rc)
		rc = smooth_tangents_make(b->w, &b->scratch, b->e);
	if (!rc)
		rc = find_coincidence(b);
	if (!rc)
		rc = find_effects(b, o ? o->max_depth : 0);
	if (!rc)
		rc = compute_emitter_probabilities(b);
	if (!rc) {
		world_note_nothing_visible(b->w, b->shape_boxes);
		world_note_no_light(b->w, b->has_dropped_emitter);
		build_note_endless_medium(b);
	}
	if (!rc && !b->w->effects.colour)
		compute_grey_xyz(b->w);
	return rc;
}

/* Whether backs are as the kind of file decides, not the user, and either black or other than in Mitsuba 0.6. */
static bool should_check_backs(const struct builder *b)
{
	return b->w->accuracy.backs <= SETTING_BACKS_AUTO && (b->scene->has_black_backs || !b->scene->is_dialect_3);
}

static uint32_t segment_count(const struct geom_shape *g)
{
	return g->curves ? g->curves->count : 0;
}

/* Whether Embree's tree is quick to build. A check does not need it, but reporting black backs is
 * worth a fraction of a second. */
static bool is_quick_to_build(const struct world *w)
{
	enum { QUICK = 1 << 18 };
	uint64_t triangles = 0;
	for (uint32_t i = 0; i < w->shape_count; i++)
		triangles += w->shapes[i].triangle_count + segment_count(&w->shapes[i]);
	return triangles <= QUICK;
}

static int new_world(struct world **out, bool with_accel, const struct scene *s, const struct asset_source *assets,
		     const struct render_options *o, struct report *report, struct error *e)
{
	*out = NULL;
	struct asset_keeper keeper = {.inner_source = assets};
	struct asset_source keeping_source = asset_keeper_source(&keeper);
	struct builder b = {
		.scene = s, .assets = &keeping_source, .report = report, .e = e, .w = mem_alloc(1, sizeof *b.w)};
	if (!b.w)
		return build_out_of_memory(e);
	struct picture_cache decoded = {.arena = &b.w->arena};
	struct obj_cache parsed = {.name = NULL};
	keeping_source.picture_cache = &decoded;
	keeping_source.obj_cache = &parsed;
	crash_set_context("building the scene", NULL, 0);
	int rc = build_all_but_accel(&b, o);
	world_note_negative_pixels(b.w, &decoded.raised);
	obj_cache_fini(&parsed);
	asset_keeper_fini(&keeper);
	crash_set_context("building Embree's tree", NULL, 0);
	bool is_complete = !rc && !(report && report->problem_count),
	     check_backs = is_complete && should_check_backs(&b);
	if (is_complete && (with_accel || (check_backs && is_quick_to_build(b.w))))
		rc = build_accel(&b);
	if (!rc && b.w->accel)
		rc = build_scattering(&b);
	if (!rc && b.w->accel && with_accel && emitter_choice_make(b.w) < 0)
		rc = build_out_of_memory(e);
	if (!rc && check_backs && b.w->accel)
		world_note_black_backs(b.w, s->has_black_backs);
	crash_set_context(NULL, NULL, 0);
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
	return new_world(out, true, s, assets, o, NULL, e);
}

int world_check(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		struct render_summary *out, struct error *e)
{
	struct world *w;
	int rc = new_world(&w, false, s, assets, o, NULL, e);
	if (!rc)
		world_summary(w, out);
	world_free(w);
	return rc;
}

int world_check_all(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		    struct report *report, struct render_summary *out, struct error *e)
{
	struct world *w;
	int rc = new_world(&w, false, s, assets, o, report, e);
	if (!rc && !report->problem_count)
		world_summary(w, out);
	world_free(w);
	return rc == REPORT_FULL ? 0 : rc;
}

/* ---- finished worlds ---- */

double world_brightness_bound(const struct world *w)
{
	double max = 0;
	for (uint32_t i = 0; i < w->emitter_count; i++)
		max = fmax(max, w->emitters[i].brightness_bound);
	for (uint32_t i = 0; i < w->media_count; i++) /* light emitted along the scene's diameter */
		if (w->media[i].is_emissive)
			max = fmax(max, 2 * emission_max(&w->media[i].emission));
	return 3 * max; /* X + Y + Z */
}

bool world_has_beam(const struct world *w)
{
	for (uint32_t i = 0; i < w->emitter_count; i++)
		if (w->emitters[i].is_beam && w->emitters[i].power > 0)
			return true;
	return false;
}

void world_summary(const struct world *w, struct render_summary *out)
{
	*out = (struct render_summary){.settings = w->settings,
				       .useful_depth = w->effects.max_depth,
				       .effect_line_count = w->effects.effect_line_count,
				       .shapes = w->shape_count,
				       .instances = w->instance_count,
				       .sharing_shapes = w->sharing_shape_count,
				       .shared_meshes = w->shared_mesh_count,
				       .brightness_bound = world_brightness_bound(w),
				       .has_beam = world_has_beam(w),
				       .has_rolling_shutter = world_has_rolling_shutter(w),
				       .coincidence_notes = w->coincidence_notes,
				       .notes = w->notes};
	memcpy(out->effect_lines, w->effects.effect_lines, sizeof out->effect_lines);
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct geom_shape *g = &w->shapes[i];
		out->triangles += g->triangle_count;
		out->segments += segment_count(g);
		if (!g->placement || g->placement->first_shape == i)
			out->stored_triangles += g->triangle_count;
	}
	out->memory_bytes = w->arena.used + EMBREE_TRIANGLE_BYTES * out->stored_triangles +
			    EMBREE_SEGMENT_BYTES * out->segments + EMBREE_SHAPE_BYTES * w->shape_count;
}

int world_set_accuracy(struct world *w, const char *text, bool *can_apply, struct error *e)
{
	struct accuracy_settings accuracy;
	const struct render_setting *k;
	int rc = accuracy_settings_read(text, &accuracy, e);
	*can_apply = rc == 0;
	for (size_t i = 0; *can_apply && (k = render_setting_at(i)) != NULL; i++) {
		char old[32], new[32];
		accuracy_settings_print_value(&w->accuracy, i, old, sizeof old);
		accuracy_settings_print_value(&accuracy, i, new, sizeof new);
		*can_apply = k->scope != SETTING_WORLD || strcmp(old, new) == 0;
	}
	if (*can_apply)
		w->accuracy = accuracy;
	return rc;
}

size_t world_embree_bytes(const struct world *w)
{
	return accel_bytes(w->accel);
}

void world_free(struct world *w)
{
	if (!w)
		return;
	accel_free(w->accel);
	coincide_free(w->coincidence);
	arena_fini(&w->arena);
	mem_free(w);
}
