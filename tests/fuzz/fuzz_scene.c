/*
 * libFuzzer: a scene file and a mesh, in one input with a zero byte between them.
 */
#include "tests/fuzz/messages.h"
#include "tests/support/memory_assets.h"
#include "tests/support/scene_tables.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	const uint8_t *zero = memchr(bytes, 0, size);
	size_t first = zero ? (size_t)(zero - bytes) : size, second = zero ? size - first - 1 : 0;
	const struct memory_file files[] = {
		{"s.xml", bytes, first}, {"m.obj", zero ? zero + 1 : bytes, second}, {"i.xml", bytes, first}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	if (scene_read(&s, &assets, "s.xml", scene_tables(), NULL, 0, &e))
		return 0;
	struct scene_settings set;
	scene_settings_read(&s, 0, 0, &set, &e);
	struct arena arena = {.limit = 256 << 20};
	for (uint32_t i = 0; i < s.object_count; i++) {
		struct shape_geometry g;
		uint64_t dropped;
		if (s.objects[i]->cls == PLUGIN_SHAPE)
			shape_build(s.objects[i], &assets, &arena, &g, &dropped, &e);
	}
	arena_fini(&arena);
	scene_fini(&s);
	return 0;
}
