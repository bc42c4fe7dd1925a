/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/displacement.h"

#include "worker/render/shape/displace.h"
#include "worker/render/texture/texture.h"

const struct property *displacement_property(const struct scene_node *shape)
{
	return node_find_property(shape, "displacement");
}

static double sample_height(const void *user, double u, double v)
{
	return texture_height(user, u, v);
}

int displacement_apply(struct shape_geometry *g, const struct scene_node *shape, const struct asset_source *assets,
		       bool dialect_3, double tessellation, struct arena *arena, struct error *e)
{
	if (!displacement_property(shape)) {
		const char *orphan =
			node_find_property(shape, "displacement_scale") ? "displacement_scale" : "displacement_level";
		return node_find_property(shape, orphan)
			       ? node_error(shape, e, EINVAL, "%s without a texture named displacement", orphan)
			       : 0;
	}
	if (!node_find_property(shape, "displacement_level"))
		return node_error(shape, e, EINVAL,
				  "displacement needs displacement_level, 0 to %d: each triangle becomes 4^level",
				  DISPLACE_LEVEL_MAX);
	struct arena picture = {0};
	struct texture t;
	const struct texture_build build = {assets, &picture, dialect_3, NULL, NULL, false};
	int rc = texture_from_node(&t, shape, "displacement", 0, COLOR_HEIGHT, &build, e);
	struct displacement d = {sample_height,
				 &t,
				 texture_is_constant(&t),
				 node_float(shape, "displacement_scale", 1),
				 (uint32_t)node_int(shape, "displacement_level", 0),
				 tessellation};
	if (!rc)
		rc = displace_geometry(g, &d, arena, shape, e);
	arena_fini(&picture);
	return rc;
}
