/* SPDX-License-Identifier: Apache-2.0 */
/*
 * "VOL", the version 3, and as 32-bit little-endian numbers: the type (1: floats), three sizes, the number of channels,
 * a box of six floats, the values.
 *
 * Failures: another format, type or number of channels, a side of less than 2 or more than VOLUME_SIDE_MAX, a file that
 * is too short, a value that is not finite.
 */
#include "worker/render/shape/volume_file.h"

#include "common/base/bytes.h"
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/shape/mesh.h"

#include <string.h>

enum { VERSION = 3, FLOATS = 1, HEAD = 4 + 4 * 5 + 4 * 6, TICK_INTERVAL = 1 << 16 };

static int read_grid(const unsigned char *p, size_t size, const struct scene_node *n, const char *name,
		     struct volume_grid *out, struct error *e)
{
	uint64_t count = 1;
	if (size < HEAD || memcmp(p, "VOL", 3) != 0)
		return node_error(n, e, EINVAL, "%s: this is not a grid of numbers (.vol)", name);
	if (p[3] != VERSION || get32(p + 4) != FLOATS || get32(p + 20) != 1)
		return node_error(
			n, e, ENOTSUP,
			"%s: version %u, type %u, %u channels; supported are version 3, type 1 (floats), 1 channel",
			name, p[3], get32(p + 4), get32(p + 20));
	for (int i = 0; i < 3; i++) {
		out->size[i] = get32(p + 8 + 4 * i);
		if (out->size[i] < 2 || out->size[i] > VOLUME_SIDE_MAX)
			return node_error(n, e, ERANGE, "%s: %u values along %c; 2 to %d are supported", name,
					  out->size[i], "xyz"[i], VOLUME_SIDE_MAX);
		count *= out->size[i];
	}
	if ((size - HEAD) / 4 < count)
		return node_error(n, e, EINVAL, "%s: too short for %llu values", name, (unsigned long long)count);
	out->value = mem_alloc(count, sizeof *out->value);
	if (!out->value)
		return node_error(n, e, ENOMEM, "%s: out of memory", name);
	for (uint64_t i = 0; i < count; i++) {
		uint32_t bits = get32(p + HEAD + 4 * i);
		memcpy(&out->value[i], &bits, sizeof bits);
		if (!isfinite(out->value[i]))
			return node_error(n, e, EINVAL, "%s: value %llu is not finite", name, (unsigned long long)i);
		if (i % TICK_INTERVAL == 0)
			tick();
	}
	return 0;
}

int volume_file_read(const struct scene_node *n, const struct asset_source *assets, struct volume_grid *out,
		     struct error *e)
{
	struct asset a;
	*out = (struct volume_grid){.value = NULL};
	int rc = mesh_open(n, assets, &a, e);
	if (rc)
		return rc;
	rc = read_grid((const unsigned char *)a.bytes, a.size, n, node_string(n, "filename", ""), out, e);
	assets->close(assets->user, &a);
	if (rc)
		volume_grid_free(out);
	return rc;
}

void volume_grid_free(struct volume_grid *g)
{
	mem_free(g->value);
	g->value = NULL;
}
