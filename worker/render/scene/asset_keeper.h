/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A source of files that keeps the last one open: where many shapes and pictures lie in one file (glTF) it is read
 * once. One thread; must outlive what it opened.
 */
#ifndef WORKER_RENDER_SCENE_ASSET_KEEPER_H
#define WORKER_RENDER_SCENE_ASSET_KEEPER_H

#include "worker/render/scene/asset.h"

struct asset_keeper {
	const struct asset_source *inner;
	char *name; /* NULL: nothing is kept */
	struct asset kept;
	unsigned users;
};

/* k->inner is set, the rest 0. */
struct asset_source asset_keeper_source(struct asset_keeper *k);
void asset_keeper_fini(struct asset_keeper *k);

#endif
