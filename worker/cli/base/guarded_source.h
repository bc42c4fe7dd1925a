/* SPDX-License-Identifier: Apache-2.0 */
/* Opens the files of a scene, and makes sure that none of them is an output of the command (common/exr/output_files.h).
 * Any thread. */
#ifndef WORKER_CLI_BASE_GUARDED_SOURCE_H
#define WORKER_CLI_BASE_GUARDED_SOURCE_H

#include "common/exr/output_files.h"
#include "worker/render/asset/asset.h"

struct guarded_source {
	struct asset_source inner;
	const struct output_files *outputs;
};

/* Returns a source that opens files as `inner` does, but fails with -EINVAL if an output would replace the file. g must
 * outlive the result. */
struct asset_source guarded_source(struct guarded_source *g, struct asset_source inner,
				   const struct output_files *outputs);

#endif
