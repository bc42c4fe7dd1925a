/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Another BSDF on a surface whose shading normals are bent by a height (`bumpmap`) or given by an image or one colour
 * (`normalmap`).
 * The BSDF itself is the inner one: the normals are bent by the geometry (worker/render/geom/relief.h), so that half
 * vectors and their derivatives take it into account.
 */
#include "common/base/color.h"
#include "worker/render/bsdf/bump_shadow.h"

#include <string.h>

struct bend {
	struct relief relief;
	const struct scene_node *node; /* of the texture; NULL: it is one colour */
	struct texture texture;
	double scale;	   /* of heights, or of a normal's first two components */
	struct bend *next; /* of the material */
};

static double height_of(const double x[3], bool grey)
{
	return grey ? x[0] : rec709_luminance(x);
}

static void height_at(const void *data, double u, double v, struct relief_value *out)
{
	const struct bend *b = data;
	struct texture_jet j;
	texture_jet(&b->texture, u, v, &j);
	double mixed = b->scale * height_of(j.duv, j.grey);
	out->x = (vec3){b->scale * height_of(j.du, j.grey), b->scale * height_of(j.dv, j.grey), 0};
	out->du = (vec3){b->scale * height_of(j.duu, j.grey), mixed, 0};
	out->dv = (vec3){mixed, b->scale * height_of(j.dvv, j.grey), 0};
}

/* Components from 0 to 1 represent -1 to 1. */
static void normal_at(const void *data, double u, double v, struct relief_value *out)
{
	const struct bend *b = data;
	struct texture_jet j;
	texture_jet(&b->texture, u, v, &j);
	double k = b->scale;
	out->x = (vec3){k * (2 * j.x[0] - 1), k * (2 * j.x[1] - 1), 2 * j.x[2] - 1};
	out->du = (vec3){2 * k * j.du[0], 2 * k * j.du[1], 2 * j.du[2]};
	out->dv = (vec3){2 * k * j.dv[0], 2 * k * j.dv[1], 2 * j.dv[2]};
}

static bool same_texture(const struct bend *a, const struct bend *b)
{
	if (!a->node || !b->node)
		return a->node == b->node &&
		       memcmp(a->texture.relief, b->texture.relief, sizeof a->texture.relief) == 0;
	return node_same(a->node, b->node);
}

/* One like it that the material has already, in another of its parts: a surface has one normal. */
static const struct bend *find_bend(const struct bend *like, const struct bend *made)
{
	for (const struct bend *b = made; b; b = b->next)
		if (b->relief.kind == like->relief.kind && b->relief.handed == like->relief.handed &&
		    b->relief.turns == like->relief.turns && b->scale == like->scale && same_texture(b, like))
			return b;
	return NULL;
}

/* That one, or a new one. texture: NULL for the colour that n has. */
static int bend_of(const struct scene_node *n, const struct scene_node *texture, enum relief_kind kind,
		   const struct bsdf_build *build, const struct bend **out, struct error *e)
{
	const struct texture_build of_texture = bsdf_texture_build(build);
	struct bend wanted = {.relief = {.kind = kind,
					 .at = kind == RELIEF_HEIGHT ? height_at : normal_at,
					 .turns = node_bool(n, "flip_invalid_normals", build->dialect_3),
					 .handed = node_bool(n, "handedness", false)},
			      .node = texture,
			      .scale = node_float(n, "scale", 1),
			      .next = build->bends ? *build->bends : NULL};
	int code = texture ? 0 : texture_from_node(&wanted.texture, n, "normalmap", 0, COLOR_RELIEF, &of_texture, e);
	if (code)
		return code;
	*out = find_bend(&wanted, wanted.next);
	if (*out)
		return 0;
	struct bend *bend = arena_alloc(build->arena, 1, sizeof *bend);
	if (!bend)
		return node_error(n, e, ENOMEM, "out of memory");
	*bend = wanted;
	bend->relief.data = bend;
	if (texture)
		code = texture_create(&bend->texture, texture, COLOR_RELIEF, &of_texture, e);
	if (!code && build->bends)
		*build->bends = bend;
	*out = bend;
	return code;
}

static int create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, enum relief_kind kind,
		  struct error *e)
{
	const struct scene_node *inner = node_child(n, PLUGIN_BSDF, 0), *texture = node_child(n, PLUGIN_TEXTURE, 0);
	const struct bend *bend;
	if (node_ref(n, "normalmap"))
		texture = node_ref(n, "normalmap");
	if (!inner || !(texture || node_find(n, "normalmap")) || node_child(n, PLUGIN_BSDF, 1))
		return node_error(n, e, EINVAL, "needs a texture and exactly one BSDF inside");
	int code = bend_of(n, texture, kind, build, &bend, e);
	if (!code)
		code = bsdf_create(b, inner, build, e);
	if (!code && (b->relief || b->uses_place))
		code = node_error(n, e, ENOTSUP, "one bump or normal map in another is not supported");
	if (code)
		return code;
	b->relief = &bend->relief;
	b->textured = true;
	b->uses_tangents |= kind == RELIEF_NORMAL;
	bool shadow = node_bool(n, "use_shadowing_function", build->dialect_3);
	return shadow ? bsdf_shadow_bumps(b, n, build, e) : 0;
}

static int bumpmap_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	return create(b, n, build, RELIEF_HEIGHT, e);
}

static int normalmap_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	return create(b, n, build, RELIEF_NORMAL, e);
}

/* What Mitsuba 3.7 does where the bent normal and the surface disagree. */
#define OF_MITSUBA_3_7                                                \
	{.name = "flip_invalid_normals", .types = VALUE_BOOL},        \
	{                                                             \
		.name = "use_shadowing_function", .types = VALUE_BOOL \
	}

const struct bsdf_ops bsdf_ops_bumpmap = {
	.decl = {PLUGIN_BSDF, "bumpmap",
		 PARAMS({.name = "scale",
			 .types = VALUE_FLOAT | VALUE_INT | VALUE_OF_3,
			 .min = -PARAM_UV_MAX,
			 .max = PARAM_UV_MAX},
			OF_MITSUBA_3_7),
		 1u << PLUGIN_BSDF | 1u << PLUGIN_TEXTURE, PARAM_UNDERSTOOD},
	.create = bumpmap_create,
};

/* scale: as in glTF. handedness (ours, for glTF): y points towards the top of the image everywhere; Mitsuba's y is
 * n x t, which may point to its bottom. */
const struct bsdf_ops bsdf_ops_normalmap = {
	.decl = {PLUGIN_BSDF, "normalmap",
		 PARAMS({.name = "normalmap", .types = VALUE_RGB | VALUE_NODE, .max = 1},
			{.name = "scale",
			 .types = VALUE_FLOAT | VALUE_INT | VALUE_OF_3,
			 .min = -PARAM_UV_MAX,
			 .max = PARAM_UV_MAX},
			{.name = "handedness", .types = VALUE_BOOL}, OF_MITSUBA_3_7),
		 1u << PLUGIN_BSDF | 1u << PLUGIN_TEXTURE, PARAM_UNDERSTOOD},
	.create = normalmap_create,
};
