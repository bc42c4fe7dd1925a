/* SPDX-License-Identifier: Apache-2.0 */
/* A range of a file's bytes, stored as they are or encoded in base64. Any thread. */
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
	bool is_file_open;
	unsigned char *decoded; /* the bytes decoded from base64; NULL: `bytes` points into the file */
};

/* Opens `count` bytes starting at `offset`; a count of UINT64_MAX means up to the end of the file. Returns -EINVAL if
 * the range is not within the file or is not base64. Call asset_range_close() only after success. */
int asset_range_open(struct asset_range *r, const struct asset_source *assets, const char *name, uint64_t offset,
		     uint64_t count, bool base64, struct error *e);
void asset_range_close(struct asset_range *r, const struct asset_source *assets);

/* Replaces the range by what its base64 decodes to. name: for the message. */
int asset_range_decode_base64(struct asset_range *r, const char *name, struct error *e);
/* Encodes n bytes in base64, with a terminating 0. text: ASSET_RANGE_BASE64_SIZE(n) bytes. */
#define ASSET_RANGE_BASE64_SIZE(n) (((n) + 2) / 3 * 4 + 1)
void asset_range_encode_base64(const unsigned char *bytes, size_t n, char *text);

#endif
