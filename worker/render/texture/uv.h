/* SPDX-License-Identifier: Apache-2.0 */
/* The affine map from the (u,v) of a surface to those of a texture: to_uv of 3.x, uscale ... voffset of 0.5/0.6. */
#ifndef WORKER_RENDER_TEXTURE_UV_H
#define WORKER_RENDER_TEXTURE_UV_H

#include "worker/render/scene/scene.h"

struct uv_map {
	double m[2][3];
};

static inline struct uv_map uv_map_read(const struct scene_node *n)
{
	mat4 t = node_transform(n, "to_uv");
	double both = node_float(n, "uvscale", 1),
	       s[2] = {node_float(n, "uscale", both), node_float(n, "vscale", both)};
	double o[2] = {node_float(n, "uoffset", 0), node_float(n, "voffset", 0)};
	struct uv_map map;
	for (int r = 0; r < 2; r++) {
		map.m[r][0] = s[r] * t.m[r][0];
		map.m[r][1] = s[r] * t.m[r][1];
		map.m[r][2] = s[r] * t.m[r][3] + o[r];
	}
	return map;
}

static inline void uv_map_apply(const struct uv_map *map, double *u, double *v)
{
	double x = *u, y = *v;
	*u = map->m[0][0] * x + map->m[0][1] * y + map->m[0][2];
	*v = map->m[1][0] * x + map->m[1][1] * y + map->m[1][2];
}

/* Larger offsets and factors would leave no significant digits of (u,v). */
#define UV_NUMBER(name_)                                                                                   \
	{                                                                                                  \
		.name = name_, .types = VALUE_FLOAT | VALUE_INT, .min = -PARAM_UV_MAX, .max = PARAM_UV_MAX \
	}
#define UV_PARAMS                                                                                                    \
	{.name = "to_uv", .types = VALUE_TRANSFORM}, UV_NUMBER("uvscale"), UV_NUMBER("uscale"), UV_NUMBER("vscale"), \
		UV_NUMBER("uoffset"), UV_NUMBER("voffset")

#endif
