/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A source of files that keeps the last file open, so that a file that holds many shapes and pictures (glTF) is read
 * once. The total number of bytes read is limited (-E2BIG), because a short scene may ask for two large files in turn,
 * a million times. One thread; the keeper must outlive the files it has opened.
 */
#ifndef WORKER_RENDER_ASSET_ASSET_KEEPER_H
#define WORKER_RENDER_ASSET_ASSET_KEEPER_H

#include "worker/render/asset/asset.h"

#include <stdint.h>

#define ASSET_KEEPER_BYTES_MAX (UINT64_C(256) << 30)

struct asset_keeper {
	const struct asset_source *inner_source;
	char *kept_name; /* NULL: nothing is kept */
	struct asset kept_asset;
	unsigned user_count;
	uint64_t bytes_read;
};

/* k->inner_source must be set and all other members 0. */
struct asset_source asset_keeper_source(struct asset_keeper *k);
void asset_keeper_fini(struct asset_keeper *k);

#endif
