/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Puts a BSDF on a surface whose shading normals are bent by a height map (`bumpmap`) or given by an image or one
 * colour (`normalmap`). The BSDF that results is the nested one: the geometry bends the normals
 * (worker/render/geom/relief.h), so that half vectors and their derivatives take them into account.
 *
 * Creation fails unless one texture (for `normalmap`, a texture or a colour) and one BSDF are nested, and if one such
 * map is nested in another.
 */
#include "common/base/color.h"
#include "worker/render/bsdf/create.h"

#include <string.h>

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
static double square_of_tangent(double cosine)
{
	double c2 = cosine * cosine;
	return fmax(1 - c2, 0) / c2;
}

/* Returns G. At 90 degrees to the unbent normal G is 0, or 1 if the normal is not bent. */
static double shadow(const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!p->place.frame)
		return 1;
	vec3 light = p->transport == TRANSPORT_RADIANCE ? wi : wo, n = p->place.frame(p->place.point, NULL).n;
	double a2 = fmin(square_of_tangent(n.z) / 8, 1);
	return a2 > 0 ? 2 / (1 + sqrt(1 + a2 * square_of_tangent(vec3_dot(n, light)))) : 1;
}

static spectrum shadowed_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct bsdf *inner = b->data;
	return spectrum_scale(shadow(p, wo, wi), inner->ops->eval(inner, p, wo, wi));
}

static double shadowed_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct bsdf *inner = b->data;
	return inner->ops->pdf_solid(inner, p, wo, wi);
}

/* The value is that of radiance, with wi towards the light. */
static spectrum shadowed_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct bsdf_point radiance = *p;
	radiance.transport = TRANSPORT_RADIANCE;
	return spectrum_scale(shadow(&radiance, wo, wi), bsdf_eval_halfvec(b->data, p, wo, wi));
}

static spectrum shadowed_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				    double *chance)
{
	spectrum weight = bsdf_eval_delta(b->data, p, wo, mode, wi, chance);
	return spectrum_is_zero(weight) ? weight : spectrum_scale(shadow(p, wo, *wi), weight);
}

static bool shadowed_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			    struct bsdf_sample *out)
{
	const struct bsdf *inner = b->data;
	if (!inner->ops->sample(inner, p, wo, u, out))
		return false;
	out->f = spectrum_scale(shadow(p, wo, out->wi), out->f);
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

/* Wraps b, whose relief is known, so that f of all its lobes is scaled by G. */
static int shadow_bumps(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	b->uses_place = true;
	return bsdf_wrap(b, &shadowed_ops, n, build, e);
}

/* ---- bent normals */

struct bend {
	struct relief relief;
	const struct scene_node *node; /* the node of the texture; NULL: one colour */
	struct texture texture;
	double scale;	   /* factor of heights, or of the first two components of a normal */
	struct bend *next; /* the next map of the same material */
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

/* Components of the image from 0 to 1 stand for those of a normal from -1 to 1. */
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

/* Returns a map equal to `like` that another part of the material has already, or NULL. Parts with equal maps have to
 * share them, since parts with different reliefs get shading frames of their own (tilted.h). */
static const struct bend *find_bend(const struct bend *like, const struct bend *made)
{
	for (const struct bend *b = made; b; b = b->next)
		if (b->relief.kind == like->relief.kind && b->relief.handed == like->relief.handed &&
		    b->relief.turns == like->relief.turns && b->scale == like->scale && same_texture(b, like))
			return b;
	return NULL;
}

/* Finds or creates the map of n. texture: NULL for the colour that n has. */
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
	return node_bool(n, "use_shadowing_function", build->dialect_3) ? shadow_bumps(b, n, build, e) : 0;
}

static int bumpmap_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	return create(b, n, build, RELIEF_HEIGHT, e);
}

static int normalmap_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	return create(b, n, build, RELIEF_NORMAL, e);
}

/* Mitsuba 3.7's parameters for places where the bent normal and the surface disagree. */
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

/* `scale` is that of glTF. `handedness` is an extension for glTF: y points towards the top of the image everywhere,
 * whereas Mitsuba's y is n x t, which may point to the bottom. */
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
