/*
 * libFuzzer: pictures of all formats.
 *
 *   clang -std=c17 -D_GNU_SOURCE -I. -g -O1 -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
 *       tests/fuzz/fuzz_image.c tests/support/memory_assets.c common/base/mem.c common/base/arena.c common/base/error.c \
 *       common/film/exr_*.c worker/scene/image*.c worker/scene/number.c -lOpenEXRCore -lpng -ljpeg -lz -lm -o build/fuzz_image
 *   build/fuzz_image -max_total_time=60 -rss_limit_mb=2500 CORPUS_FOLDER
 */
#include "tests/support/memory_assets.h"
#include "worker/scene/image.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	const struct memory_file files[] = {{"i", bytes, size}, {0}};
	struct asset_source assets = memory_assets(files);
	struct arena arena = {.limit = 256 << 20};
	struct image img;
	struct error e;
	image_read(&assets, "i", false, &arena, &img, &e);
	arena_fini(&arena);
	return 0;
}
