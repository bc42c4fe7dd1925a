/* SPDX-License-Identifier: Apache-2.0 */
/* Parameters for the declarations of shapes. */
#ifndef WORKER_RENDER_SHAPE_DECLARE_H
#define WORKER_RENDER_SHAPE_DECLARE_H

#include "worker/render/plugin/param.h"
#include "worker/render/shape/displace.h"

/* A parameter of meshes from files (smooth.h). */
#define MESH_SMOOTH_PARAM                                                                   \
	{                                                                                   \
		"max_smooth_angle", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, 180, NULL \
	}
/* The parameters of every shape. */
#define SHAPE_PARAMS                                                                                      \
	{"to_world", UNDERSTOOD(VALUE_TRANSFORM_OR_ANIMATION)}, {"flip_normals", UNDERSTOOD(VALUE_BOOL)}, \
		{"interior", UNDERSTOOD(VALUE_NODE)}, {"exterior", UNDERSTOOD(VALUE_NODE)},               \
		{"silhouette_sampling_weight", IGNORED}, DISPLACE_PARAMS

#endif
