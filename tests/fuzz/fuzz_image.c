/* SPDX-License-Identifier: Apache-2.0 */
/*
 * libFuzzer: pictures of all formats.
 */
#include "tests/fuzz/messages.h"
#include "tests/support/memory_assets.h"
#include "tests/support/image_read.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	static const char *const names[] = {"i", "i.tga"}; /* TGA is recognised by the name only */
	const struct memory_file files[] = {{names[0], bytes, size}, {names[1], bytes, size}, {0}};
	struct asset_source assets = memory_assets(files);
	for (int k = 0; k < 2; k++) {
		struct arena arena = {.limit = 256 << 20};
		struct image img;
		struct error e;
		image_read(&assets, names[k], false, &arena, &img, &e);
		arena_fini(&arena);
	}
	return 0;
}
