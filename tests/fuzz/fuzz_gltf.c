/* SPDX-License-Identifier: Apache-2.0 */
/*
 * libFuzzer: scenes in glTF, as .gltf and as .glb, up to the shapes' meshes and the settings. The first byte says which
 * format, and whether unsupported features are left out. Every other file that the scene names has the scene's own
 * bytes.
 */
#include "tests/fuzz/seeds.h"
#include "tests/support/gltf_files.h"
#include "worker/render/render.h"
#include "worker/render/scene/settings.h"
#include "worker/render/shape/shape.h"

#include <string.h>

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	static struct gltf_files f;
	static unsigned char bytes[1 + sizeof f.file];
	(void)argc, (void)argv;
	if (!seeds_are_requested())
		return 0;
	for (int i = 0; i < 2 * GLTF_FORMS; i++) {
		enum gltf_form form = (enum gltf_form)(i % GLTF_FORMS);
		gltf_files_make(&f);
		if (i >= GLTF_FORMS)
			gltf_files_compress(&f, "EXT_meshopt_compression");
		gltf_files_pack(&f, form);
		bytes[0] = (unsigned char)(form == GLTF_BINARY);
		memcpy(bytes + 1, f.file, f.file_size);
		seed_write_file("gltf", (uint64_t)i, bytes, 1 + f.file_size);
	}
	exit(0);
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

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	if (size == 0)
		return 0;
	const char *name = bytes[0] & 1 ? "s.glb" : "s.gltf";
	const struct memory_file files[] = {{name, bytes + 1, size - 1},
					    {"the mesh.bin", bytes + 1, size - 1},
					    {"rgb.hdr", bytes + 1, size - 1},
					    {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct scene_settings set;
	struct error e;
	if ((bytes[0] & 2 ? scene_read_lenient : scene_read)(&s, &assets, name, render_plugins(), NULL, 0, &e))
		return 0;
	scene_settings_read(&s, 0, 0, 1, &set, &e);
	build_shapes(&s, &assets);
	struct render_options options = {.width = 32, .height = 32, .max_depth = 8};
	struct render_summary summary;
	world_check(&s, &assets, &options, &summary, &e);
	scene_fini(&s);
	return 0;
}
