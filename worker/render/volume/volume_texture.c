/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The texture `volume`: the value of a volume at the position of the surface in the world. Three channels are
 * interpolated as RGB and then upsampled, like those of meshes and images. A probe has no position: its u and v are
 * mapped to points that fill the grid's box.
 */
#include "worker/render/volume/volume.h"

#include "worker/render/texture/texture.h"

struct volume_texture {
	struct volume volume;
	mat4 to_world; /* from the cells of the grid */
	enum color_role role;
};

static int volume_texture_create(struct texture *t, const struct scene_node *n, enum color_role role,
				 const struct texture_build *build, struct error *e)
{
	struct volume_texture *x = t->data;
	x->role = role;
	if (color_role_is_number(role))
		return node_error(n, e, ENOTSUP, "a volume cannot displace a surface or bend its normals");
	if (!build->volumes)
		return node_error(n, e, ENOTSUP, "a volume is a texture for surfaces only");
	int rc = volume_from_node(&x->volume, n, "volume", 0.75, role, false, build->volumes, e);
	if (!rc && x->volume.grid && !mat4_invert(x->volume.grid->to_cells, &x->to_world))
		rc = node_error(n, e, EINVAL, "its volume is too thin");
	return rc;
}

static bool is_rgb(const struct volume_texture *x)
{
	return x->volume.grid && x->volume.grid->channels > 1;
}

/* Returns the point of the world at which the volume is evaluated. For probes, the third coordinate runs through its
 * range once for each step of the second. */
static vec3 evaluation_point(const struct volume_texture *x, const struct texture_point *point)
{
	const struct grid *g = x->volume.grid;
	if (!point->is_probe || !g)
		return point->p;
	const double part[3] = {point->u, point->v, fmod(point->u * 64 * 0.618 + point->v * 64, 1)};
	double cell[3];
	for (int i = 0; i < 3; i++)
		cell[i] = g->cell_min[i] + part[i] * (g->cell_max[i] - g->cell_min[i]);
	return mat4_point(&x->to_world, (vec3){cell[0], cell[1], cell[2]});
}

static spectrum volume_texture_eval(const struct texture *t, const struct texture_point *point,
				    const struct wavelengths *w)
{
	const struct volume_texture *x = t->data;
	vec3 p = evaluation_point(x, point);
	if (!is_rgb(x))
		return volume_eval(&x->volume, p, false, w);
	double rgb[GRID_CHANNELS_MAX];
	grid_eval(x->volume.grid, p, rgb);
	return x->role == COLOR_ILLUMINANT ? color_eval_rgb_illuminant(rgb, w) : color_eval_rgb_reflectance(rgb, w);
}

/* An upsampled reflectance may exceed its RGB components. */
static double volume_texture_max(const struct texture *t)
{
	const struct volume_texture *x = t->data;
	return is_rgb(x) && x->role == COLOR_REFLECTANCE ? 1 : volume_max(&x->volume);
}

static enum color_kind volume_texture_color_kind(const struct texture *t)
{
	const struct volume_texture *x = t->data;
	return is_rgb(x) ? COLOR_KIND_OTHER : x->volume.color.kind;
}

const struct texture_ops texture_ops_volume = {
	.decl = {PLUGIN_TEXTURE, "volume", PARAMS({.name = "volume", .types = VALUE_VOLUME, .max = PARAM_LIGHT_MAX}), 0,
		 PARAM_UNDERSTOOD},
	.data_size = sizeof(struct volume_texture),
	.create = volume_texture_create,
	.eval = volume_texture_eval,
	.max = volume_texture_max,
	.color_kind = volume_texture_color_kind,
};
