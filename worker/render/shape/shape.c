/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/shape.h"

#include "worker/render/shape/mesh_finish.h"

#include <string.h>

#define SHAPE(name) extern const struct shape_ops shape_ops_##name;
#include "worker/render/shape/shape_list.h"
#undef SHAPE

const struct shape_ops *const shape_registry[] = {
#define SHAPE(name) &shape_ops_##name,
#include "worker/render/shape/shape_list.h"
#undef SHAPE
	NULL,
};

static int finish_shape(struct shape_geometry *out, const struct scene_node *n, struct arena *arena, uint64_t *dropped,
			struct error *e)
{
	struct mesh_finish_options f = {out->is_in_world_space ? mat4_identity() : node_transform(n, "to_world"),
					node_bool(n, "flip_normals", false),
					out->has_face_normals || node_bool(n, "face_normals", false),
					node_float(n, "max_smooth_angle", -1)};
	int r = mesh_finish(&out->mesh, &f, arena, dropped, n, e);
	if (out->is_generated && out->mesh.triangle_count > 0)
		*dropped = 0;
	return r;
}

int shape_curves_to_mesh(struct shape_geometry *g, const struct scene_node *n, struct arena *arena, uint64_t *dropped,
			 struct error *e)
{
	struct mesh mesh;
	int rc = curve_make_mesh(&g->curve, arena, &mesh);
	if (rc == -EFBIG)
		return node_error(n, e, EFBIG, "its curves make more than %d triangles", MESH_TRIANGLES_MAX);
	if (rc)
		return node_error(n, e, -rc, "out of memory");
	*g = (struct shape_geometry){.kind = SHAPE_MESH, .mesh = mesh, .is_in_world_space = true, .is_generated = true};
	return finish_shape(g, n, arena, dropped, e);
}

int shape_build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		struct shape_geometry *out, uint64_t *dropped, struct error *e)
{
	*out = (struct shape_geometry){.kind = SHAPE_MESH};
	*dropped = 0;
	const struct shape_ops *const *ops = shape_registry;
	while (*ops && strcmp((*ops)->decl.type, n->type) != 0)
		ops++;
	if (!*ops || !(*ops)->build)
		return node_error(n, e, ENOTSUP, "\"%s\" is not a supported shape", n->type);
	int r = (*ops)->build(n, assets, arena, out, e);
	return r || out->kind != SHAPE_MESH ? r : finish_shape(out, n, arena, dropped, e);
}
