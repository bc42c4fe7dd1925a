/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/emitter/emitter.h"

#include <string.h>

#define EMITTER(name) extern const struct emitter_ops emitter_ops_##name;
#include "worker/render/emitter/emitter_list.h"
#undef EMITTER

const struct emitter_ops *const emitter_registry[] = {
#define EMITTER(name) &emitter_ops_##name,
#include "worker/render/emitter/emitter_list.h"
#undef EMITTER
	NULL,
};

static const struct emitter_ops *find_ops(const struct scene_node *n)
{
	for (const struct emitter_ops *const *ops = emitter_registry; *ops; ops++)
		if (strcmp((*ops)->decl.type, n->type) == 0)
			return *ops;
	return NULL;
}

bool emitter_needs_surface(const struct scene_node *n)
{
	const struct emitter_ops *ops = find_ops(n);
	return ops && ops->needs_surface;
}

bool emitter_is_volumetric(const struct scene_node *n)
{
	const struct emitter_ops *ops = find_ops(n);
	return ops && ops->is_volumetric;
}

int emitter_create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	const struct emitter_ops *ops = find_ops(n);
	if (!ops)
		return node_error(n, e, ENOTSUP, "\"%s\" is not a supported emitter", n->type);
	if (ops->needs_surface && !build->surface)
		return node_error(n, e, EINVAL, "\"%s\" must be inside a shape", n->type);
	if (!ops->needs_surface && build->surface)
		return node_error(n, e, EINVAL, "\"%s\" cannot be inside a shape", n->type);
	*em = (struct emitter){.ops = ops};
	if (ops->data_size > 0) {
		em->data = arena_alloc(build->arena, 1, ops->data_size);
		if (!em->data)
			return node_error(n, e, ENOMEM, "out of memory");
	}
	return ops->create(em, n, build, e);
}

void emitter_move(const struct emitter *em, double time, struct emitter_storage *storage)
{
	mat4 to_world = motion_transform_at(em->motion, time);
	assert(em->ops->data_size <= sizeof storage->data);
	memcpy(storage->data, em->data, em->ops->data_size);
	storage->em = *em;
	storage->em.data = storage->data;
	storage->em.motion = NULL;
	em->ops->set_transform(&storage->em, &to_world);
}

int emitter_read_texture(struct texture *t, const struct scene_node *n, const char *name, enum color_role role,
			 const struct emitter_build *build, struct error *e)
{
	const struct texture_build texture_build = {build->assets,
						    build->arena,
						    build->is_dialect_3,
						    build->attributes,
						    build->surface ? build->volumes : NULL,
						    false};
	return texture_from_node(t, n, name, 1, role, &texture_build, e);
}
