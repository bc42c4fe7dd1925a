/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tiles as workers send them. The first byte chooses: a tile of a film; the result of a lease with one tile, or with
 * two, whose message is made here so that the bytes reach the decoder; an image as the coordinator keeps it.
 */
#include "common/base/mem.h"
#include "common/exr/exr_read.h"
#include "common/exr/exr_tile.h"
#include "common/wire/batch_wire.h"
#include "tests/fuzz/messages.h"

#include <string.h>

enum { WIDTH = TILE_SIZE + 2, HEIGHT = 3 /* two tiles, the second one small */ };

static void read_tile(const uint8_t *bytes, size_t size)
{
	struct tile t;
	struct error e;
	unsigned char *rewritten;
	size_t n;
	if (exr_tile_read(bytes, size, WIDTH, HEIGHT, &t, &e))
		return;
	if (exr_tile_write(&t, WIDTH, HEIGHT, &rewritten, &n, &e) == 0)
		mem_free(rewritten);
	mem_free(t.xyz);
}

/* Reads the result of a lease of samples, so that there are neither chain states nor moments. */
static void read_result(const uint8_t *bytes, size_t size, bool has_two_tiles)
{
	static const struct plan_request request = {.integrator = "path",
						    .kind = PLAN_SAMPLES,
						    .width = WIDTH,
						    .height = HEIGHT,
						    .spp = 1,
						    .max_depth = 4,
						    .groups = 4};
	struct plan plan;
	struct batch batch;
	struct error e;
	Farm__LeaseKey key;
	Farm__LeaseResult m;
	uint64_t counters[BATCH_COUNTERS] = {0};
	double classes[PATH_CLASSES] = {0};
	uint32_t sizes[2] = {(uint32_t)size, 0};
	if (plan_make(&request, &plan, &e))
		return;
	struct lease_key k = {.job = 1, .kind = LEASE_RENDER};
	lease_key_to_wire(&k, &key);
	farm__lease_result__init(&m);
	m.key = &key;
	m.n_counters = BATCH_COUNTERS;
	m.counters = counters;
	m.n_classes = PATH_CLASSES;
	m.classes = classes;
	m.n_tile_sizes = 1;
	m.tile_sizes = sizes;
	if (has_two_tiles && size > 2) { /* with two tiles the fuzzer chooses where the first one ends */
		m.n_tile_sizes = 2;
		sizes[0] = (uint32_t)bytes[size - 1] << 8 | bytes[size - 2];
		size -= 2;
		sizes[0] = sizes[0] < size ? sizes[0] : (uint32_t)size;
		sizes[1] = (uint32_t)size - sizes[0];
	}
	struct plan_range rows = plan_row_range(&plan, 0);
	counters[COUNT_SAMPLES] = (rows.end - rows.begin) * (plan.crop_width + 2 * (uint64_t)plan.border) * plan.epoch;
	if (batch_unpack(&batch, &plan, &m, bytes, size, &e) == 0)
		batch_fini(&batch);
}

static void read_image(const uint8_t *bytes, size_t size)
{
	struct exr_image img;
	struct error e;
	if (exr_read(bytes, size, &img, &e) == 0)
		exr_image_fini(&img);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	if (!size)
		return 0;
	unsigned kind = *bytes;
	if (kind % 4 == 0)
		read_tile(bytes + 1, size - 1);
	else if (kind % 4 < 3)
		read_result(bytes + 1, size - 1, kind % 4 == 2);
	else
		read_image(bytes + 1, size - 1);
	return 0;
}
