/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's files, from the scene file up to the world before Embree has it: the scene, a mesh, and a picture or a grid
 * in one input (the scene up to the first zero byte, u16 BE size of the mesh, mesh, picture). Scenes that ask for many
 * triangles by displacement would get them, so these are left out here.
 */
#include "tests/fuzz/messages.h"
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"
#include "worker/render/shape/shape.h"

#include <string.h>

enum { LEVEL_MAX = 3, SIDE = 32 };

struct input {
	const uint8_t *scene, *mesh, *picture;
	size_t scene_size, mesh_size, picture_size;
};

static struct input split_input(const uint8_t *bytes, size_t size)
{
	const uint8_t *zero = size ? memchr(bytes, 0, size) : NULL;
	struct input in = {
		.scene = bytes, .scene_size = zero ? (size_t)(zero - bytes) : size, .mesh = bytes, .picture = bytes};
	size_t remaining = size - in.scene_size;
	if (remaining < 3)
		return in;
	in.mesh = zero + 3;
	remaining -= 3;
	in.mesh_size = (size_t)zero[1] << 8 | zero[2];
	in.mesh_size = in.mesh_size < remaining ? in.mesh_size : remaining;
	in.picture = in.mesh + in.mesh_size;
	in.picture_size = remaining - in.mesh_size;
	return in;
}

static void build_shapes(const struct scene *s, const struct asset_source *assets)
{
	struct arena arena = {.limit = 256 << 20};
	struct error e;
	for (uint32_t i = 0; i < s->object_count; i++) {
		struct shape_geometry g;
		uint64_t dropped;
		if (s->objects[i]->cls == PLUGIN_SHAPE)
			shape_build(s->objects[i], assets, &arena, &g, &dropped, &e);
	}
	arena_fini(&arena);
}

static bool is_moderate(const struct scene *s)
{
	for (uint32_t i = 0; i < s->object_count; i++)
		if (node_int(s->objects[i], "displacement_level", 0) > LEVEL_MAX)
			return false;
	return true;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	struct input in = split_input(bytes, size);
	const struct memory_file files[] = {{"s.xml", in.scene, in.scene_size},
					    {"i.xml", in.scene, in.scene_size},
					    {"m.obj", in.mesh, in.mesh_size},
					    {"p.png", in.picture, in.picture_size},
					    {"p.exr", in.picture, in.picture_size},
					    {"g.vol", in.picture, in.picture_size},
					    {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		return 0;
	struct scene_settings set;
	scene_settings_read(&s, 0, 0, 1, &set, &e);
	build_shapes(&s, &assets);
	struct render_options options = {.width = SIDE, .height = SIDE, .max_depth = 8};
	struct render_summary summary;
	if (is_moderate(&s))
		world_check(&s, &assets, &options, &summary, &e);
	scene_fini(&s);
	return 0;
}
