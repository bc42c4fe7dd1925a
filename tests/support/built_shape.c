/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/built_shape.h"

struct built_shape built_shape(const struct memory_file *files, const struct plugin_decl *plugins)
{
	struct asset_source assets = memory_assets(files);
	struct built_shape b = {0};
	uint64_t dropped;
	b.result = scene_read(&b.scene, &assets, "s.xml", plugins, NULL, 0, &b.error);
	if (!b.result)
		b.result = shape_build(b.scene.objects[0], &assets, &b.arena, &b.g, &dropped, &b.error);
	return b;
}

void built_shape_release(struct built_shape *b)
{
	arena_fini(&b->arena);
	scene_fini(&b->scene);
}
