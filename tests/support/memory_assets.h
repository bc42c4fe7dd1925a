/* SPDX-License-Identifier: Apache-2.0 */
/* A source of assets in memory, for scenes without files. */
#ifndef TESTS_SUPPORT_MEMORY_ASSETS_H
#define TESTS_SUPPORT_MEMORY_ASSETS_H

#include "worker/render/asset/asset.h"

struct memory_file {
	const char *name;
	const void *bytes;
	size_t size;
};

/* files ends with a NULL name; opening any other name gives -ENOENT. The files must outlive the source. */
struct asset_source memory_assets(const struct memory_file *files);

#endif
