/* SPDX-License-Identifier: Apache-2.0 */
/* Reads a whole image from a source of files. */
#ifndef TESTS_SUPPORT_IMAGE_READ_H
#define TESTS_SUPPORT_IMAGE_READ_H

#include "worker/render/asset/asset.h"
#include "worker/render/image/image.h"

static inline int image_read(const struct asset_source *assets, const char *name, bool raw, struct arena *arena,
			     struct image *out, struct error *e)
{
	*out = (struct image){0};
	struct asset a;
	int r = assets->open(assets->user, name, &a, e);
	if (r)
		return r;
	r = image_decode(a.bytes, a.size, name, raw, IMAGE_ALL, arena, out, e);
	assets->close(assets->user, &a);
	return r;
}

#endif
