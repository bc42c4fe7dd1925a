/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A source of files that keeps the last one open: where many shapes and pictures lie in one file (glTF) it is read
 * once. What it reads in all is bounded (-E2BIG): a short scene may ask for two large files by turns, a million times.
 * One thread; must outlive what it opened.
 */
#ifndef WORKER_RENDER_ASSET_ASSET_KEEPER_H
#define WORKER_RENDER_ASSET_ASSET_KEEPER_H

#include "worker/render/asset/asset.h"

#include <stdint.h>

#define ASSET_KEEPER_BYTES_MAX (UINT64_C(256) << 30)

struct asset_keeper {
	const struct asset_source *inner;
	char *name; /* NULL: nothing is kept */
	struct asset kept;
	unsigned users;
	uint64_t read; /* bytes, so far */
};

/* k->inner is set, the rest 0. */
struct asset_source asset_keeper_source(struct asset_keeper *k);
void asset_keeper_fini(struct asset_keeper *k);

#endif
