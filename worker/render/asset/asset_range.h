/* SPDX-License-Identifier: Apache-2.0 */
/* A range of a file's bytes, as they stand there or written in base64. Any thread. */
#ifndef WORKER_RENDER_ASSET_ASSET_RANGE_H
#define WORKER_RENDER_ASSET_ASSET_RANGE_H

#include "common/base/error.h"
#include "worker/render/asset/asset.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct asset_range {
	const unsigned char *bytes;
	size_t size;
	struct asset file;
	bool opened;		/* the file */
	unsigned char *decoded; /* NULL: the file's own */
};

/* `count` bytes from `first` on; UINT64_MAX: to its end. -EINVAL where the range is not in the file, or is no base64.
 * asset_range_close after 0 alone. */
int asset_range_open(struct asset_range *r, const struct asset_source *assets, const char *name, uint64_t first,
		     uint64_t count, bool base64, struct error *e);
void asset_range_close(struct asset_range *r, const struct asset_source *assets);

/* Decodes base64. name: for the message. */
int asset_range_decode(struct asset_range *r, const char *name, struct error *e);
/* With a final 0. text: ASSET_RANGE_TEXT(n) bytes. */
#define ASSET_RANGE_TEXT(n) (((n) + 2) / 3 * 4 + 1)
void asset_range_encode(const unsigned char *bytes, size_t n, char *text);

#endif
