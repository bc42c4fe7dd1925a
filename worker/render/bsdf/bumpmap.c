/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Puts a BSDF on a surface whose shading normals are bent by a height map (`bumpmap`) or given by an image or one
 * colour (`normalmap`). The BSDF that results is the nested one: the geometry bends the normals
 * (worker/render/geom/relief.h), so that half vectors and their derivatives take them into account.
 *
 * A map inside another bends the normals that the outer one gives.
 *
 * Creation fails unless one texture (for `normalmap`, a texture or a colour) and one BSDF are nested, and if more than
 * NESTED_MAX maps are nested in each other.
 */
#include "common/base/color.h"
#include "worker/render/bsdf/create.h"

#include <string.h>

enum { NESTED_MAX = 8 };

/* ---- shadows of bumps */

/*
 * The shadow that bumps cast on each other. A bent normal lights parts of the surface that face away from the light,
 * and this light ends abruptly at the terminator. The bumps are therefore treated as microfacets whose slopes are as
 * wide as the normal is bent, and light at grazing angles is reduced by Smith's factor for the direction of light
 * alone, G = 2 / (1 + sqrt(1 + a^2 tan^2 l)) with a^2 = min(tan^2 b / 8, 1), where l and b are the angles of the light
 * and of the bent normal to the surface's normal without relief (Conty Estevez, Lecocq, Stein: A Microfacet-Based
 * Shadowing Function to Solve the Bump Terminator Problem. Ray Tracing Gems, ch. 12, 2019). Not reciprocal. Densities
 * stay as they are, since G lies between 0 and 1.
 */
struct shadowed {
	struct bsdf inner;
	/* Before and after bending; low NULL: no relief, high NULL: the inner BSDF's. */
	const struct relief *low, *high;
};

static double tangent_squared(double cosine)
{
	double c2 = cosine * cosine;
	return fmax(1 - c2, 0) / c2;
}

/* Returns G. At 90 degrees to the unbent normal G is 0, or 1 if the normal is not bent. */
static double shadowing_factor(const struct shadowed *s, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct relief_frames *at = &p->relief_frames;
	if (!at->get_frame)
		return 1;
	vec3 light = p->transport == TRANSPORT_RADIANCE ? wi : wo, n = at->get_frame(at->context, s->low).n;
	double bend = s->high ? vec3_dot(n, at->get_frame(at->context, s->high).n) : n.z;
	double a2 = fmin(tangent_squared(bend) / 8, 1);
	return a2 > 0 ? 2 / (1 + sqrt(1 + a2 * tangent_squared(vec3_dot(n, light)))) : 1;
}

static spectrum shadowed_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct shadowed *s = b->data;
	return spectrum_scale(shadowing_factor(s, p, wo, wi), s->inner.ops->eval(&s->inner, p, wo, wi));
}

static double shadowed_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct shadowed *s = b->data;
	return s->inner.ops->pdf_solid(&s->inner, p, wo, wi);
}

/* The value is that of radiance, with wi towards the light. */
static spectrum shadowed_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct shadowed *s = b->data;
	struct bsdf_point radiance = *p;
	radiance.transport = TRANSPORT_RADIANCE;
	return spectrum_scale(shadowing_factor(s, &radiance, wo, wi), bsdf_eval_halfvec(&s->inner, p, wo, wi));
}

static spectrum shadowed_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				    double *probability)
{
	const struct shadowed *s = b->data;
	spectrum weight = bsdf_eval_delta(&s->inner, p, wo, mode, wi, probability);
	return spectrum_is_zero(weight) ? weight : spectrum_scale(shadowing_factor(s, p, wo, *wi), weight);
}

static bool shadowed_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			    struct bsdf_sample *out)
{
	const struct shadowed *s = b->data;
	if (!s->inner.ops->sample(&s->inner, p, wo, u, out))
		return false;
	out->f = spectrum_scale(shadowing_factor(s, p, wo, out->wi), out->f);
	return true;
}

static const struct bsdf_ops shadowed_ops = {
	.decl.type = "bump_shadow",
	.eval = shadowed_eval,
	.pdf_solid = shadowed_pdf,
	.eval_halfvec = shadowed_eval_halfvec,
	.eval_delta = shadowed_eval_delta,
	.sample = shadowed_sample,
};

/* Wraps b, which has the relief r or one inside it, so that f of all its lobes is scaled by G. */
static int add_shadowing(struct bsdf *b, const struct relief *r, const struct scene_node *n,
			 const struct bsdf_build *build, struct error *e)
{
	struct shadowed *s = arena_alloc(build->arena, 1, sizeof *s);
	if (!s)
		return node_error(n, e, ENOMEM, "out of memory");
	*s = (struct shadowed){.inner = *b, .low = r->base, .high = b->relief == r ? NULL : r};
	b->uses_relief_frames = true;
	b->ops = &shadowed_ops;
	b->data = s;
	return 0;
}

/* ---- bent normals */

struct relief_map {
	struct relief relief;
	const struct scene_node *node; /* the node of the texture; NULL: one colour */
	struct texture texture;
	double scale;		 /* factor of heights, or of the first two components of a normal */
	struct relief_map *next; /* the next map of the same material */
};

static double height_from_rgb(const double x[3], bool grey)
{
	return grey ? x[0] : rec709_luminance(x);
}

static void eval_height(const void *data, double u, double v, struct relief_sample *out)
{
	const struct relief_map *b = data;
	struct texture_derivatives j;
	texture_eval_derivatives(&b->texture, u, v, &j);
	double mixed = b->scale * height_from_rgb(j.duv, j.is_grey);
	out->x = (vec3){b->scale * height_from_rgb(j.du, j.is_grey), b->scale * height_from_rgb(j.dv, j.is_grey), 0};
	out->du = (vec3){b->scale * height_from_rgb(j.duu, j.is_grey), mixed, 0};
	out->dv = (vec3){mixed, b->scale * height_from_rgb(j.dvv, j.is_grey), 0};
}

/* Components of the image from 0 to 1 stand for those of a normal from -1 to 1. */
static void eval_normal(const void *data, double u, double v, struct relief_sample *out)
{
	const struct relief_map *b = data;
	struct texture_derivatives j;
	texture_eval_derivatives(&b->texture, u, v, &j);
	double k = b->scale;
	out->x = (vec3){k * (2 * j.x[0] - 1), k * (2 * j.x[1] - 1), 2 * j.x[2] - 1};
	out->du = (vec3){2 * k * j.du[0], 2 * k * j.du[1], 2 * j.du[2]};
	out->dv = (vec3){2 * k * j.dv[0], 2 * k * j.dv[1], 2 * j.dv[2]};
}

static bool has_same_texture(const struct relief_map *a, const struct relief_map *b)
{
	if (!a->node || !b->node)
		return a->node == b->node &&
		       memcmp(a->texture.relief, b->texture.relief, sizeof a->texture.relief) == 0;
	return node_equals(a->node, b->node);
}

/* Returns a map equal to `wanted` that another part of the material has already, or NULL. Parts with equal maps have to
 * share them, since parts with different reliefs get shading frames of their own (tilted.h). */
static const struct relief_map *find_relief_map(const struct relief_map *wanted, const struct relief_map *maps)
{
	for (const struct relief_map *b = maps; b; b = b->next)
		if (b->relief.kind == wanted->relief.kind &&
		    b->relief.uses_handedness == wanted->relief.uses_handedness &&
		    b->relief.flips_invalid_normals == wanted->relief.flips_invalid_normals &&
		    b->relief.base == wanted->relief.base && b->scale == wanted->scale && has_same_texture(b, wanted))
			return b;
	return NULL;
}

/* Finds or creates the map of n. texture: NULL for the colour that n has. */
static int get_relief_map(const struct scene_node *n, const struct scene_node *texture, enum relief_kind kind,
			  const struct bsdf_build *build, const struct relief_map **out, struct error *e)
{
	const struct texture_build texture_build = bsdf_texture_build(build);
	struct relief_map wanted = {
		.relief = {.kind = kind,
			   .eval = kind == RELIEF_HEIGHT ? eval_height : eval_normal,
			   .flips_invalid_normals =
				   !build->base_relief && node_bool(n, "flip_invalid_normals", build->is_dialect_3),
			   .uses_handedness = node_bool(n, "handedness", false),
			   .base = build->base_relief},
		.node = texture,
		.scale = node_float(n, "scale", 1),
		.next = build->relief_maps ? *build->relief_maps : NULL};
	int code = texture ? 0 : texture_from_node(&wanted.texture, n, "normalmap", 0, COLOR_RELIEF, &texture_build, e);
	if (code)
		return code;
	*out = find_relief_map(&wanted, wanted.next);
	if (*out)
		return 0;
	struct relief_map *map = arena_alloc(build->arena, 1, sizeof *map);
	if (!map)
		return node_error(n, e, ENOMEM, "out of memory");
	*map = wanted;
	map->relief.data = map;
	if (texture)
		code = texture_create(&map->texture, texture, COLOR_RELIEF, &texture_build, e);
	if (!code && build->relief_maps)
		*build->relief_maps = map;
	*out = map;
	return code;
}

static unsigned nesting_of(const struct relief *r)
{
	unsigned depth = 0;
	for (; r; r = r->base)
		depth++;
	return depth;
}

static int create_relief_bsdf(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			      enum relief_kind kind, struct error *e)
{
	const struct scene_node *inner = node_child(n, PLUGIN_BSDF, 0), *texture = node_child(n, PLUGIN_TEXTURE, 0);
	const struct relief_map *map;
	if (node_ref(n, "normalmap"))
		texture = node_ref(n, "normalmap");
	if (!inner || !(texture || node_find_property(n, "normalmap")) || node_child(n, PLUGIN_BSDF, 1))
		return node_error(n, e, EINVAL, "needs a texture and exactly one BSDF inside");
	if (nesting_of(build->base_relief) == NESTED_MAX)
		return node_error(n, e, ENOTSUP, "more than %d bump or normal maps in each other", NESTED_MAX);
	int code = get_relief_map(n, texture, kind, build, &map, e);
	if (code)
		return code;
	struct bsdf_build inside = *build;
	inside.base_relief = &map->relief;
	code = bsdf_create(b, inner, &inside, e);
	if (code)
		return code;
	if (!b->relief)
		b->relief = &map->relief;
	b->is_textured = true;
	b->uses_tangents |= kind == RELIEF_NORMAL;
	return node_bool(n, "use_shadowing_function", build->is_dialect_3) ? add_shadowing(b, &map->relief, n, build, e)
									   : 0;
}

static int bumpmap_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	return create_relief_bsdf(b, n, build, RELIEF_HEIGHT, e);
}

static int normalmap_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	return create_relief_bsdf(b, n, build, RELIEF_NORMAL, e);
}

/* Mitsuba 3.7's parameters for places where the bent normal and the surface disagree. */
#define MITSUBA_3_7_PARAMS                                            \
	{.name = "flip_invalid_normals", .types = VALUE_BOOL},        \
	{                                                             \
		.name = "use_shadowing_function", .types = VALUE_BOOL \
	}

const struct bsdf_ops bsdf_ops_bumpmap = {
	.decl = {PLUGIN_BSDF, "bumpmap",
		 PARAMS({.name = "scale",
			 .types = VALUE_FLOAT | VALUE_INT | VALUE_DIALECT_3_ONLY,
			 .min = -PARAM_UV_MAX,
			 .max = PARAM_UV_MAX},
			MITSUBA_3_7_PARAMS),
		 1u << PLUGIN_BSDF | 1u << PLUGIN_TEXTURE, PARAM_UNDERSTOOD},
	.create = bumpmap_create,
};

/* `scale` is that of glTF. `handedness` is an extension for glTF: y points towards the top of the image everywhere,
 * whereas Mitsuba's y is n x t, which may point to the bottom. */
const struct bsdf_ops bsdf_ops_normalmap = {
	.decl = {PLUGIN_BSDF, "normalmap",
		 PARAMS({.name = "normalmap", .types = VALUE_RGB | VALUE_NODE, .max = 1},
			{.name = "scale",
			 .types = VALUE_FLOAT | VALUE_INT | VALUE_DIALECT_3_ONLY,
			 .min = -PARAM_UV_MAX,
			 .max = PARAM_UV_MAX},
			{.name = "handedness", .types = VALUE_BOOL}, MITSUBA_3_7_PARAMS),
		 1u << PLUGIN_BSDF | 1u << PLUGIN_TEXTURE, PARAM_UNDERSTOOD},
	.create = normalmap_create,
};
