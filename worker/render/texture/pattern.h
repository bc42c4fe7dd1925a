/* SPDX-License-Identifier: Apache-2.0 */
/* Textures that are one of two others, depending on (u,v). Private to worker/render/texture. */
#ifndef WORKER_RENDER_TEXTURE_PATTERN_H
#define WORKER_RENDER_TEXTURE_PATTERN_H

#include "worker/render/texture/texture.h"
#include "worker/render/texture/uv.h"

struct pattern {
	struct texture color[2];
	struct uv_map map;
	unsigned (*which)(const struct pattern *p, double u, double v); /* index of the texture; (u,v) are mapped */
	double line_width;
};

/* Reads color0, color1 (with these defaults if they are absent) and the map; the caller sets the rest. */
int pattern_create(struct texture *t, const struct scene_node *n, const double defaults[2], enum color_role role,
		   const struct texture_build *build, struct error *e);
spectrum pattern_eval(const struct texture *t, const struct texture_point *at, const struct wavelengths *w);
double pattern_height(const struct texture *t, double u, double v);
void pattern_jet(const struct texture *t, double u, double v, struct texture_jet *j);
double pattern_max(const struct texture *t);
enum color_shape pattern_shape(const struct texture *t);

#define PATTERN_PARAMS                                                                                         \
	{.name = "color0", .types = VALUE_TEXTURE, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX},         \
		{.name = "color1", .types = VALUE_TEXTURE, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX}, \
		UV_PARAMS
/* The operations of a pattern NAME, which defines NAME_params and NAME_create. */
#define PATTERN_OPS(NAME)                                                            \
	const struct texture_ops texture_ops_##NAME = {                              \
		.decl = {PLUGIN_TEXTURE, #NAME, NAME##_params, 0, PARAM_UNDERSTOOD}, \
		.data_size = sizeof(struct pattern),                                 \
		.create = NAME##_create,                                             \
		.eval = pattern_eval,                                                \
		.height = pattern_height,                                            \
		.jet = pattern_jet,                                                  \
		.max = pattern_max,                                                  \
		.shape = pattern_shape,                                              \
	}

#endif
